"""What is kept on disk is what was solved; whatever happens to the file, answers stay right."""

import os
import sqlite3
import struct
import subprocess
import sys
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from internav_data.records import Asset, Part, Pose
from internav_data.world import Body, Motion, Rest, Setting, engine_of_this_process, solving_anew
from internav_data.world.bullet import bullet
from internav_data.world.engine import (
    Remembering,
    _origin,
    _read_motion,
    _read_rest,
    _write_motion,
    _write_rest,
)
from internav_data.world.push import SHOVES
from internav_data.world.solutions import FILE_NAME, Solutions, cache_folder

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
BOX = Asset(
    asset_id="box",
    type="box",
    size=(0.4, 0.4, 0.3),
    mass_kg=3.0,
    friction=0.5,
    pushable=True,
    pickable=True,
    spawnable=True,
    blocks=True,
    parts=(Part("box", (0.0, 0.0, 0.15), (0.4, 0.4, 0.3), UPRIGHT, (), (9, 9, 9), "wood"),),
)
LONE = Setting((Body(BOX, Pose(0.0, 0.0, 0.001, UPRIGHT), moves=True),))
PAIR = Setting((*LONE.bodies, Body(BOX, Pose(0.7, 0.1, 0.001, UPRIGHT), moves=True)))
SHOVE = SHOVES["force"]


class Counting:
    """An engine that counts what it is asked."""

    name, build = "counting", "1"

    def __init__(self):
        self.asked = 0

    def push(self, setting, shove):
        self.asked += 1
        return bullet().push(setting, shove)

    def settle(self, setting):
        self.asked += 1
        return bullet().settle(setting)


def remembering(folder, origin="here", engine=None):
    return Remembering(engine or Counting(), Solutions(folder), origin)


@pytest.mark.parametrize("setting", [LONE, PAIR], ids=["lone", "pair"])
def test_a_later_process_reads_what_was_solved_to_the_last_bit(tmp_path, setting):
    first = remembering(tmp_path)
    pushed, settled = first.push(setting, SHOVE), first.settle(setting)
    assert first.engine.asked == 2
    first.solutions.flush()
    later = remembering(tmp_path)
    assert later.push(setting, SHOVE) == pushed == bullet().push(setting, SHOVE)
    assert later.settle(setting) == settled == bullet().settle(setting)
    assert later.engine.asked == 0


def test_every_difference_in_what_is_asked_is_another_question(tmp_path):
    engine = remembering(tmp_path)
    body = LONE.bodies[0]
    asked = [
        (LONE, SHOVE),
        (LONE, SHOVES["kick"]),
        (PAIR, SHOVE),
        (Setting((replace(body, asset=replace(BOX, friction=0.6)),)), SHOVE),
        (Setting((replace(body, asset=replace(BOX, mass_kg=3.5)),)), SHOVE),
        (Setting((replace(body, pose=Pose(0.0, 0.0, 0.001, (0.0, 0.0, 1.0, 0.0))),)), SHOVE),
        (Setting((body, replace(PAIR.bodies[1], moves=False))), SHOVE),
    ]
    for setting, shove in asked:
        engine.push(setting, shove)
    engine.settle(LONE)
    assert engine.engine.asked == len(asked) + 1
    assert engine.solutions.count() == len(asked) + 1


def test_other_rules_or_machines_are_not_believed(tmp_path):
    first = remembering(tmp_path)
    first.push(LONE, SHOVE)
    first.solutions.flush()
    later = remembering(tmp_path, origin="another processor")
    later.push(LONE, SHOVE)
    assert later.engine.asked == 1


def test_the_origin_names_engine_code_and_processor():
    origin = _origin(bullet().build)
    assert bullet().build in origin
    assert len(origin) > 100
    assert _origin("other rules") != origin


finite = st.floats(allow_nan=False, width=64)
poses = st.builds(lambda *n: Pose(*n[:3], n[3:]), *[finite] * 7)


@given(
    st.lists(st.tuples(poses, st.tuples(*[finite] * 8), st.binary(max_size=60)), max_size=4),
    finite,
    st.booleans(),
)
def test_motions_come_back_as_they_were(movers, seconds, at_rest):
    motion = Motion(
        tuple(m[0] for m in movers),
        tuple(m[1] for m in movers),
        tuple(m[2] for m in movers),
        seconds,
        at_rest,
    )
    written = _write_motion(motion)
    assert repr(_read_motion(written)) == repr(motion)  # tells -0.0 from 0.0
    assert all(_read_motion(written[:k]) is None for k in range(len(written)))


@given(poses, finite, finite, finite, st.booleans())
def test_rests_come_back_as_they_were(pose, seconds, penetration_m, reach_m, at_rest):
    rest = Rest(pose, seconds, at_rest, penetration_m, reach_m)
    assert repr(_read_rest(_write_rest(rest))) == repr(rest)
    assert _read_rest(_write_rest(rest)[:-1]) is None


@given(st.binary(max_size=400))
def test_no_bytes_make_reading_fail(value):
    _read_motion(value)
    _read_rest(value)


def test_many_movers_claimed_are_not_believed():
    assert _read_motion(struct.pack("<d?H", 1.0, True, 65535)) is None


def kept(folder):
    engine = remembering(folder)
    motion = engine.push(LONE, SHOVE)
    engine.solutions.flush()
    return motion


def rows(folder, *question):
    with sqlite3.connect(folder / FILE_NAME) as file:
        return file.execute(*question).fetchall()


def test_a_damaged_value_is_solved_anew(tmp_path):
    motion = kept(tmp_path)
    [(key, value)] = rows(tmp_path, "SELECT key, value FROM solutions")
    for at in (0, 5, len(value) - 1):
        damaged = bytearray(value)
        damaged[at] ^= 1
        rows(tmp_path, "UPDATE solutions SET value = ? WHERE key = ?", (bytes(damaged), key))
        later = remembering(tmp_path)
        assert later.push(LONE, SHOVE) == motion
        assert later.engine.asked == 1
    rows(tmp_path, "UPDATE solutions SET value = 'text'")
    assert remembering(tmp_path).push(LONE, SHOVE) == motion


@pytest.mark.parametrize("content", [b"", b"no database, but a text\n" * 400])
def test_what_is_no_database_is_begun_anew(tmp_path, content):
    (tmp_path / FILE_NAME).write_bytes(content)
    motion = kept(tmp_path)
    later = remembering(tmp_path)
    assert later.push(LONE, SHOVE) == motion
    assert later.engine.asked == 0


def test_pages_overwritten_while_it_is_open_cost_no_answer(tmp_path):
    engine = remembering(tmp_path)
    motion = engine.push(LONE, SHOVE)
    for k in range(40):
        engine.solutions.put(bytes([k]) * 32, bytes(3000))
    engine.solutions.flush()
    path = tmp_path / FILE_NAME
    path.write_bytes(b"x" * path.stat().st_size)
    fresh = remembering(tmp_path)
    assert engine.push(LONE, SHOVE) == motion
    assert fresh.push(LONE, SHOVE) == motion
    engine.solutions.flush()
    assert kept(tmp_path) == motion


def test_a_folder_that_cannot_be_made_keeps_nothing(tmp_path):
    (tmp_path / "file").write_text("in the way")
    engine = remembering(tmp_path / "file" / "below")
    assert engine.push(LONE, SHOVE) == bullet().push(LONE, SHOVE)
    assert engine.solutions.count() == 0


def test_a_read_only_file_is_read(tmp_path):
    kept(tmp_path)
    engine = remembering(tmp_path)
    engine.solutions._file.execute("PRAGMA query_only = ON")
    engine.push(LONE, SHOVE)
    assert engine.engine.asked == 0
    engine.push(PAIR, SHOVE)
    assert engine.solutions.count() == 1


def test_a_full_file_takes_no_more_and_is_begun_anew(tmp_path, monkeypatch):
    module = sys.modules["internav_data.world.solutions"]
    monkeypatch.setattr(module, "BYTES_AT_MOST", 1_200_000)
    first = Solutions(tmp_path)
    for k in range(1000):
        first.put(k.to_bytes(32, "little"), os.urandom(3000))
    first.flush()
    assert 0 < first.count() < 1000
    assert (tmp_path / FILE_NAME).stat().st_size <= 1_200_000
    assert Solutions(tmp_path).count() == 0


def test_values_beyond_any_use_are_not_kept(tmp_path):
    held = Solutions(tmp_path)
    held.put(b"k", bytes(5 << 20))
    assert held.count() == 0


def test_a_writer_who_is_waited_for_in_vain_costs_no_answer(tmp_path):
    motion = kept(tmp_path)
    with sqlite3.connect(tmp_path / FILE_NAME, isolation_level=None) as other:
        other.execute("BEGIN EXCLUSIVE")
        engine = remembering(tmp_path)
        assert engine.push(LONE, SHOVE) == motion
        engine.solutions.flush()
    assert remembering(tmp_path).push(LONE, SHOVE) == motion


def test_several_processes_write_at_once(tmp_path):
    script = (
        "import sys; from pathlib import Path\n"
        "from internav_data.world.solutions import Solutions\n"
        "kept = Solutions(Path(sys.argv[1])); first = int(sys.argv[2])\n"
        "for k in range(first, first + 300):\n"
        "    kept.put(k.to_bytes(32, 'little'), k.to_bytes(4, 'little') * 700)\n"
        "kept.flush()\n"
    )
    writers = [
        subprocess.Popen([sys.executable, "-c", script, str(tmp_path), str(first)])
        for first in (0, 200, 400)
    ]
    assert [writer.wait(60) for writer in writers] == [0, 0, 0]
    found = Solutions(tmp_path)
    # A writer gives up what it would have to wait for too long; what is there is whole.
    assert 300 <= found.count() <= 700
    for k in range(700):
        assert found.get(k.to_bytes(32, "little")) in (None, k.to_bytes(4, "little") * 700)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_leaves_its_parents_file_alone(tmp_path):
    held = Solutions(tmp_path)
    held.put(b"parent" * 5, b"1")
    child = os.fork()
    if child == 0:
        held.put(b"child" * 6, b"2")
        held.flush()
        os._exit(0 if held.get(b"parent" * 5) is None else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert held.count() == 1
    assert held.get(b"parent" * 5) == b"1"


def test_solving_anew_believes_nothing_that_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr("internav_data.world.engine.solutions", lambda: held)
    held = Solutions(tmp_path)
    engine = engine_of_this_process()
    lie = replace(engine.push(LONE, SHOVE), seconds=123.0)
    held.put(engine._key(repr(SHOVE), LONE), _write_motion(lie))
    held.flush()
    assert engine_of_this_process().push(LONE, SHOVE) == lie
    with solving_anew():
        assert engine_of_this_process().push(LONE, SHOVE) == bullet().push(LONE, SHOVE) != lie
    assert engine_of_this_process().push(LONE, SHOVE) == lie


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
