"""The reader of small files: what is refused, in one line, without waiting or taking memory."""

from __future__ import annotations

import json
import os
import socket
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from internav_data.core.files import (
    FileLimits,
    open_regular,
    parse_json,
    parse_toml,
    read_file,
    read_json,
    read_text,
    read_toml,
)
from internav_data.core.storage import write_atomically
from internav_data.records.errors import CorruptDataError, UsageError

LIMITS = FileLimits("list", UsageError, "write it again", 1000, 4, 50, 1e6)


def _refused(call, *arguments):
    with pytest.raises(UsageError) as caught:
        call(*arguments)
    text = str(caught.value)
    assert "\n" not in text
    assert text.startswith("list ")
    assert text.endswith(": write it again")
    assert len(text) < 600
    return text


def _pipe(path):
    os.mkfifo(path)


def _socket(path):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (_pipe, "a pipe"),
        (_socket, "a socket"),
        (lambda path: path.symlink_to("/dev/zero"), "a device"),
        (lambda path: path.mkdir(), "a folder"),
    ],
)
def test_what_could_block_or_never_end_is_not_opened(tmp_path, monkeypatch, make, kind):
    monkeypatch.chdir(tmp_path)  # a socket's name is short
    make(tmp_path / "x")
    assert kind in _refused(read_file, "x", LIMITS)
    with pytest.raises(OSError, match="expected a regular file"):
        open_regular(tmp_path / "x")


def test_what_took_the_place_of_a_file_is_not_read(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("1")
    os.mkfifo(tmp_path / "pipe")
    looked = (tmp_path / "file").stat()
    monkeypatch.setattr(Path, "stat", lambda _: looked)
    assert "a pipe" in _refused(read_file, tmp_path / "pipe", LIMITS)


@pytest.mark.parametrize("make", [_pipe, lambda path: path.symlink_to("/dev/zero")])
def test_what_is_no_file_is_never_replaced_by_one(tmp_path, make):
    """A superuser's `--out /dev/null` would make a file of the machine's null device."""
    path = tmp_path / "out"
    make(path)
    before = path.lstat()
    with pytest.raises(OSError, match="expected a regular file"):
        write_atomically(path, b"new")
    assert path.lstat() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_large_file_takes_no_memory(tmp_path):
    with (tmp_path / "sparse").open("wb") as file:
        file.truncate(1 << 40)
    tracemalloc.start()
    assert "at most 1,000 bytes" in _refused(read_file, tmp_path / "sparse", LIMITS)
    assert tracemalloc.get_traced_memory()[1] < 1 << 20
    tracemalloc.stop()


def test_a_file_that_states_no_size_is_read_within_the_limit(tmp_path):
    tight = FileLimits("list", UsageError, "write it again", max_bytes=3)
    assert "at most 3 bytes" in _refused(read_file, "/proc/self/status", tight)
    (tmp_path / "three").write_text("abc")
    assert read_text(tmp_path / "three", tight) == "abc"


def test_absent_and_unnameable_files(tmp_path):
    assert "No such file" in _refused(read_file, tmp_path / "none", LIMITS)
    assert "NUL" in _refused(read_file, "a\0b", LIMITS)
    assert "too long" in _refused(read_file, tmp_path / ("n" * 400), LIMITS)


def test_byte_order_marks_are_accepted_and_other_encodings_named(tmp_path):
    path = tmp_path / "x"
    path.write_bytes(b"\xef\xbb\xbf[1]")
    assert read_json(path, LIMITS) == [1]
    path.write_bytes(b"\xef\xbb\xbfa = 1")
    assert read_toml(path, LIMITS) == {"a": 1}
    path.write_bytes("[1]".encode("utf-16"))
    assert "not UTF-8" in _refused(read_json, path, LIMITS)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ('{"a": 1, "b": 2, "a": 3}', "'a' is there twice"),
        ('{"a": [NaN]}', "a[0]: nan is no finite number"),
        ("[-Infinity]", "[0]: -inf is no finite number"),
        ('{"a": [1, 1e999]}', "a[1]: inf is no finite number"),
        ('{"a": {"b": 1e308}}', "a.b: 1e+308 is out of range, expected at most 1e+06"),
        ("[" + "9" * 100 + "]", "a number of 333 bits is out of range"),
        ("[" * 5 + "]" * 5, "nested too deeply, expected at most 4"),
        ("[" * 40 + "]" * 40, "nested too deeply"),
        (r'["\ud800"]', "no Unicode text"),
        (r'["a\u0000"]', "NUL"),
        (r'{"\ud800": 1}', "no Unicode text"),
        ("[" + "1," * 60 + "1]", "at most 50 values"),
        ("[1", "not JSON"),
        ("", "not JSON"),
    ],
)
def test_json_that_is_refused(text, problem):
    assert problem in _refused(parse_json, text.encode(), "x", LIMITS)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a = 1\na = 2", "Cannot overwrite"),
        ("a = nan", "a: nan is no finite number"),
        ("a = [1.0, -inf]", "a[1]: -inf"),
        ("[t]\na = 1e308", "t.a: 1e+308 is out of range"),
        ("a = " + "9" * 900, "bits is out of range"),
        ("a = 0x" + "f" * 900, "a number of 3600 bits"),
        ("a = " + "[" * 5 + "]" * 5, "nested too deeply, expected at most 4"),
        ("a = 1979-05-27", "a date or time"),
        ("a = 07:32:00", "a date or time"),
        (".".join("a" * 40) + " = 1", "more than 32 parts"),
        ('"a b" . ' * 40 + "c = 1", "more than 32 parts"),
        ("a =", "not TOML"),
    ],
)
def test_toml_that_is_refused(text, problem):
    assert problem in _refused(parse_toml, text.encode(), "x", LIMITS)


def test_numbers_and_nestings_that_only_wide_limits_let_through():
    wide = FileLimits(max_bytes=1 << 20)
    deep = 100_000
    for parse, text in (
        (parse_json, "[" * deep + "]" * deep),
        (parse_json, '{"a":' * deep + "1" + "}" * deep),
        (parse_json, "9" * 5000),
        (parse_toml, "a = " + "[" * deep + "]" * deep),
        (parse_toml, "a = " + "9" * 5000),
        (parse_toml, ".".join("a" * deep) + " = 1"),
        (parse_toml, "[" + ".".join("a" * deep) + "]"),
    ):
        with pytest.raises(CorruptDataError, match=r"deeply|digits|parts|too much"):
            parse(text.encode(), "x", wide)


_plain = st.recursive(
    st.none() | st.integers(-(10**6), 10**6) | st.floats(-1e6, 1e6) | st.text("aé,="),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text("ab"), inner, max_size=3),
    max_leaves=6,
)


@given(_plain)
def test_other_json_is_read_as_it_is(value):
    wide = FileLimits(max_depth=60)
    assert parse_json(json.dumps(value).encode(), "x", wide) == value


@given(st.binary(max_size=60) | st.text('[]{}",:=.\\0aeN-+\n#', max_size=60).map(str.encode))
def test_any_bytes_are_read_or_refused(data):
    for parse in (parse_json, parse_toml):
        try:
            parse(data, "x", LIMITS)
        except UsageError as error:
            assert "\n" not in str(error)  # noqa: PT017 - most are refused, some are read


def test_a_hostile_file_of_the_largest_size_takes_little_memory():
    limits = FileLimits(max_bytes=32 << 20, max_values=10_000)
    data = b"[" + b"[]," * (10 << 20) + b"[]]"
    tracemalloc.start()
    with pytest.raises(CorruptDataError, match="holds too much"):
        parse_json(data, "x", limits)
    assert tracemalloc.get_traced_memory()[1] < 1 << 20
    tracemalloc.stop()
