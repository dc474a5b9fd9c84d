"""Entries of the result cache are complete or absent, whoever else reads, writes or dies."""

import contextlib
import functools
import hashlib
import os
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from threaded import run_in_threads

from internav_data.physics.result_cache import FILE_NAME, ResultCache, cache_folder
from internav_data.physics.result_index import RowIndex, prefix_of


def digest(number):
    """Return a key as they are: random to the eye."""
    return hashlib.sha256(b"%d" % number).digest()


def fill(held, numbers, size=3000):
    for number in numbers:
        held.put(digest(number), number.to_bytes(4, "little") * (size // 4))


def known(held, numbers, size=3000):
    """Return which numbers are found, and check their values."""
    found = {number: held.get(digest(number)) for number in numbers}
    there = {number for number, value in found.items() if value is not None}
    assert all(found[number] == number.to_bytes(4, "little") * (size // 4) for number in there)
    return there


def test_a_damaged_schema_is_made_anew(tmp_path):
    path = tmp_path / FILE_NAME
    fill(held := ResultCache(tmp_path), range(3))
    held.flush()
    whole = path.read_bytes()
    at = whole.index(b"CREATE TABLE batches")
    for place in range(at - 40, at + 72):
        damaged = bytearray(whole)
        damaged[place] ^= 0x80
        path.write_bytes(bytes(damaged))
        known(held := ResultCache(tmp_path), range(3))
        fill(held, [7])
        held.flush()
        assert known(ResultCache(tmp_path), [7]), place


def test_of_a_full_file_those_go_that_nobody_asked_for_longest(tmp_path, monkeypatch):
    module = sys.modules["internav_data.physics.result_cache"]
    monkeypatch.setattr(module, "MAX_BYTES", 3_000_000)
    monkeypatch.setattr(module, "_BATCH", 32)
    writer, reader = ResultCache(tmp_path), ResultCache(tmp_path)
    asked = set(range(20))
    for first in range(0, 4000, 100):
        fill(writer, range(first, first + 100))
        assert reader.get(digest(first)) is not None  # a new one: the reader looks at the end
        assert known(reader, asked) == asked, "what is read stays, although it was written first"
        reader.flush()
        assert (tmp_path / FILE_NAME).stat().st_size <= 3_000_000
    writer.flush()
    left = known(ResultCache(tmp_path), range(4000))
    assert asked < left
    others = sorted(left - asked)
    assert 300 < len(others) < 900
    assert others == list(range(others[0], 4000)), "the oldest of the others have left"


def test_reading_a_file_with_room_writes_nothing(tmp_path):
    held = ResultCache(tmp_path)
    fill(held, range(600))
    held.flush()
    before = (tmp_path / FILE_NAME).read_bytes()
    reader = ResultCache(tmp_path)
    assert len(known(reader, range(600))) == 600
    reader.flush()
    assert (tmp_path / FILE_NAME).read_bytes() == before


@pytest.mark.skipif(not Path("/proc/self/io").exists(), reason="bytes written are Linux's to tell")
def test_a_value_is_written_once(tmp_path):
    """A B-tree of random keys under a rollback journal wrote eight times as much."""

    def written():
        return int(Path("/proc/self/io").read_text().split("wchar:")[1].split()[0])

    held, before = ResultCache(tmp_path), written()
    fill(held, range(6400), 1000)
    held.flush()
    assert (written() - before) / 6_400_000 < 1.6


def test_threads_share_a_cache(tmp_path):
    held, wrong = ResultCache(tmp_path), []

    def work(thread):
        fill(held, range(thread * 50, thread * 50 + 700))
        if not known(held, range(1100)):
            wrong.append(thread)

    run_in_threads(work, 8)
    held.flush()
    assert wrong == []
    assert known(ResultCache(tmp_path), range(1050)) == set(range(1050))


@settings(max_examples=40)
@given(st.lists(st.lists(st.integers(0, 60), max_size=8), max_size=30), st.integers(1, 12))
def test_the_index_finds_the_latest_row_of_each_key(batches, most):
    index, rows, first = RowIndex(), {}, 1
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("internav_data.physics.result_index._RECENT", most)
        for numbers in batches:
            index.add([(first, b"".join(prefix_of(digest(n)) for n in numbers))])
            rows.update({number: first + k for k, number in enumerate(numbers)})
            first += max(1, len(numbers))
            assert index.end == first
    assert all(index.row(digest(number)) == rows.get(number) for number in range(61))


def test_values_beyond_any_use_are_not_kept(tmp_path):
    held = ResultCache(tmp_path)
    held.put(b"k", bytes(5 << 20))
    assert held.count() == 0


def test_an_empty_file_that_another_holds_is_left_to_it(tmp_path, monkeypatch):
    monkeypatch.setattr("internav_data.physics.result_cache.OPENING_S", 0.2)
    with contextlib.closing(opened(tmp_path)) as other:
        other.execute("BEGIN IMMEDIATE")
        other.execute("CREATE TABLE other (name TEXT)")
        assert not ResultCache(tmp_path).is_open
        other.execute("COMMIT")
        assert other.execute("SELECT name FROM sqlite_schema").fetchall() == [("other",)]
        assert (tmp_path / FILE_NAME).is_file()


def opened(folder):
    return sqlite3.connect(folder / FILE_NAME, isolation_level=None, timeout=0.1)


def free_to_write(folder):
    """Return whether another process could write at once: no transaction is open."""
    with contextlib.closing(opened(folder)) as other:
        try:
            other.execute("BEGIN IMMEDIATE")
        except sqlite3.OperationalError:
            return False
    return True


def test_a_reader_in_the_way_of_a_commit_leaves_no_transaction_open(tmp_path):
    held = ResultCache(tmp_path)
    held.put(b"first", b"1")
    held.flush()
    with contextlib.closing(opened(tmp_path)) as reader:
        reader.execute("BEGIN")
        reader.execute("SELECT * FROM solutions").fetchall()
        held.put(b"second", b"2")
        held.flush()
        reader.execute("COMMIT")
    assert free_to_write(tmp_path)
    held.put(b"third", b"3")
    held.flush()
    assert ResultCache(tmp_path).get(b"third") == b"3"


def test_an_interrupt_while_writing_leaves_no_transaction_open(tmp_path, monkeypatch):
    class Interrupted(sqlite3.Connection):
        def execute(self, question, *values):
            answer = super().execute(question, *values)
            if question.startswith("INSERT"):
                raise KeyboardInterrupt
            return answer

    with monkeypatch.context() as patch:
        patch.setattr(sqlite3, "connect", functools.partial(sqlite3.connect, factory=Interrupted))
        held = ResultCache(tmp_path)
    held.put(b"first", b"1")
    with pytest.raises(KeyboardInterrupt):
        held.flush()
    assert free_to_write(tmp_path)
    other = ResultCache(tmp_path)
    other.put(b"second", b"2")
    assert other.count() == 1


def test_what_was_put_is_known_before_it_is_written(tmp_path):
    held = ResultCache(tmp_path)
    held.put(b"key", b"value")
    assert held.get(b"key") == b"value"
    assert ResultCache(tmp_path).get(b"key") is None


def test_several_processes_write_at_once(tmp_path):
    script = (
        "import sys; from pathlib import Path\n"
        "from internav_data.physics import result_cache\n"
        # Long enough on any machine: a writer drops values that it would have to wait for.
        "result_cache.OPENING_S = result_cache.WAIT_S = 60.0\n"
        "from internav_data.physics.result_cache import ResultCache\n"
        "kept = ResultCache(Path(sys.argv[1])); first = int(sys.argv[2])\n"
        "for k in range(first, first + 300):\n"
        "    kept.put(k.to_bytes(32, 'little'), k.to_bytes(4, 'little') * 700)\n"
        "kept.flush()\n"
    )
    writers = [
        subprocess.Popen([sys.executable, "-c", script, str(tmp_path), str(first)])
        for first in (0, 200, 400)
    ]
    assert [writer.wait(180) for writer in writers] == [0, 0, 0]
    found = ResultCache(tmp_path)
    assert found.count() == 700
    for k in range(700):
        assert found.get(k.to_bytes(32, "little")) == k.to_bytes(4, "little") * 700


def test_who_finds_the_tables_made_meanwhile_writes_and_lets_others_write(tmp_path, monkeypatch):
    first, looked = [], []

    class Late(sqlite3.Connection):
        """Connection that looks for tables just before another process makes them."""

        def execute(self, question, *values):
            cursor = super().execute(question, *values)
            if question.startswith("SELECT type") and not looked:
                looked.append(question)
                found = cursor.fetchall()
                first.append(ResultCache(tmp_path))
                return super().execute("SELECT 1 WHERE ?", [bool(found)])
            return cursor

    monkeypatch.setattr(sqlite3, "connect", functools.partial(sqlite3.connect, factory=Late))
    late = ResultCache(tmp_path)
    for number, cache in enumerate((late, *first)):
        fill(cache, [number])
        cache.flush()
    assert known(ResultCache(tmp_path), range(2)) == {0, 1}


def test_a_process_that_drops_all_values_knows_of_those_that_others_wrote(tmp_path):
    behind, other = ResultCache(tmp_path), ResultCache(tmp_path)
    fill(other, range(5))
    other.flush()
    with pytest.warns(UserWarning, match="all solutions in it are deleted"):
        behind.drop("a solution in this cache was wrong")
    for cache, numbers in ((behind, range(10, 18)), (other, range(20, 28))):
        fill(cache, numbers)
        cache.flush()
    assert behind.is_open
    assert other.is_open
    assert known(other, range(30)) == {*range(10, 18), *range(20, 28)}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_leaves_its_parents_file_alone(tmp_path):
    held = ResultCache(tmp_path)
    held.put(b"parent" * 5, b"1")
    child = os.fork()
    if child == 0:
        held.put(b"child" * 6, b"2")
        held.flush()
        os._exit(0 if held.get(b"parent" * 5) is None else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert held.count() == 1
    assert held.get(b"parent" * 5) == b"1"


def test_where_solutions_are_kept_can_be_chosen(tmp_path, monkeypatch):
    monkeypatch.setenv("INTERNAV_CACHE_DIR", str(tmp_path))
    assert cache_folder() == tmp_path
    monkeypatch.setenv("INTERNAV_CACHE_DIR", "")
    assert cache_folder() is None
    monkeypatch.delenv("INTERNAV_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    folder = cache_folder()
    assert folder is not None
    assert folder.name == "internav"


def test_a_user_without_a_home_keeps_nothing(monkeypatch):
    monkeypatch.delenv("INTERNAV_CACHE_DIR")

    def homeless(*_, **__):
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr("internav_data.physics.result_cache.user_cache_path", homeless)
    assert cache_folder() is None
    monkeypatch.setattr(
        "internav_data.physics.result_cache.user_cache_path", lambda *_, **__: Path("~/.cache")
    )
    assert cache_folder() is None
