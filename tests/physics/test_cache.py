"""The solver returns solutions to the last bit, whatever happens to the cache's file."""

import contextlib
import functools
import hashlib
import math
import shutil
import sqlite3
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from builders import UPRIGHT, crate
from engines import default_engine
from hypothesis import given
from hypothesis import strategies as st

from internav_data.physics import (
    Body,
    PhysicsScene,
    PushSolution,
    SettleSolution,
    cache_disabled,
    get_solver,
)
from internav_data.physics.cache import (
    Solver,
    SolverCounts,
    origin,
    pack_push,
    pack_settle,
    unpack_push,
    unpack_settle,
)
from internav_data.physics.result_cache import FILE_NAME, ResultCache
from internav_data.physics.solving import solve_push, solve_settle
from internav_data.records import PUSH_SPECS, Pose

BOX = crate("Box_0", (0.4, 0.4, 0.3), mass_kg=3.0, friction=0.5, pickable=True)
LONE = PhysicsScene((Body.of(BOX, Pose(0.0, 0.0, 0.001, UPRIGHT)),))
PAIR = PhysicsScene((*LONE.bodies, Body.of(BOX, Pose(0.7, 0.1, 0.001, UPRIGHT))))
FORCE = PUSH_SPECS["force"]


class Counting:
    """The default engine under another name; it counts the scenes that it loads."""

    name, build, libraries = "counting", "1", default_engine().libraries
    contact_margin_m, step_s = 0.0, default_engine().step_s

    def __init__(self):
        self.asked = 0

    def load(self, scene):
        self.asked += 1
        return default_engine().load(scene)


def remembering(folder, origin="here", engine=None):
    return Solver(engine or Counting(), ResultCache(folder), origin)


def test_a_later_process_reads_what_was_solved_to_the_last_bit(tmp_path):
    first = remembering(tmp_path)
    pushed, settled = first.push(LONE, FORCE), first.settle(LONE)
    assert first.engine.asked == 2
    first.result_cache.flush()
    later = remembering(tmp_path)
    assert later.push(LONE, FORCE) == pushed == solve_push(default_engine(), LONE, FORCE)
    assert later.settle(LONE) == settled == solve_settle(default_engine(), LONE)
    assert later.engine.asked == 0


def test_a_push_among_others_is_kept_by_its_process_alone(tmp_path):
    solver = remembering(tmp_path)
    pushed = solver.push(PAIR, FORCE)
    assert solver.push(PAIR, FORCE) is pushed
    assert solver.engine.asked == 1
    assert solver.result_cache.count() == 0
    assert remembering(tmp_path).push(PAIR, FORCE) == pushed


def test_pushes_that_no_cache_knew_are_counted(tmp_path):
    first = remembering(tmp_path)
    first.push(LONE, FORCE), first.push(LONE, FORCE), first.push(PAIR, FORCE)
    assert first.counts == SolverCounts(asked=3, solved=2)
    first.result_cache.flush()
    second = remembering(tmp_path)  # reads the push of one object from the file
    second.push(LONE, FORCE), second.push(PAIR, FORCE)
    assert second.counts == SolverCounts(asked=2, solved=1)
    both = SolverCounts.total([first.counts, second.counts])
    assert both == SolverCounts(asked=5, solved=3)
    assert both.new_share(since=first.counts) == 0.5
    assert both.new_share(since=both) == 0.0


def test_memory_of_solutions_is_counted_in_bytes(monkeypatch):
    monkeypatch.setattr("internav_data.physics.cache._LONE_BYTES", 50_000)
    solver = Solver(Counting(), None, "here")
    bodies = [replace(LONE.bodies[0], pose=Pose(0.01 * k, 0.0, 0.0, UPRIGHT)) for k in range(30)]
    paths = sum(len(solver.push(PhysicsScene((body,)), FORCE).paths[0]) for body in bodies)
    assert paths > 50_000
    assert 2 < len(solver._lone) < 50_000 // (paths // 30)  # noqa: SLF001 - entries in memory


@pytest.fixture
def every_key_sampled(monkeypatch):
    monkeypatch.setattr("internav_data.physics.cache.SAMPLE", 1)


@pytest.mark.usefixtures("every_key_sampled")
def test_a_wrong_solution_is_found_on_use_and_the_cache_dropped(tmp_path):
    solution = kept(tmp_path)
    wise = remembering(tmp_path)
    assert wise.push(LONE, FORCE) == solution
    assert wise.engine.asked == 1
    assert wise.result_cache.count() == 1, "what is right stays"
    liar = Counting()
    liar.step_s /= 2.0
    lying = remembering(tmp_path / "other", engine=liar)
    lie = lying.push(LONE, FORCE)
    lying.settle(LONE)
    lying.result_cache.flush()
    other = ResultCache(tmp_path / "other")
    later = remembering(tmp_path / "other")
    with pytest.warns(UserWarning, match=r"a solution in this cache was wrong.*deleted"):
        assert later.push(LONE, FORCE) == solution != lie
    assert later.result_cache.count() == 0
    key = later._key(repr(FORCE), LONE)  # noqa: SLF001 - the key of a push
    assert other.get(key) is None, "other processes do not believe it either"
    other.put(key, b"new")
    other.flush()
    assert later.result_cache.get(key) == other.get(key) == b"new"


def test_one_key_of_a_thousand_is_sampled(tmp_path):
    kept(tmp_path)
    later = remembering(tmp_path)
    later.push(LONE, FORCE)
    assert later.engine.asked == 0
    share = sum(int.from_bytes(hashlib.sha256(b"%d" % k).digest()[-8:]) % 1000 == 0
                for k in range(100_000))  # fmt: skip
    assert 50 < share < 150


def test_a_value_under_another_key_is_not_believed(tmp_path):
    first = remembering(tmp_path)
    wider = PhysicsScene((replace(LONE.bodies[0], pose=Pose(0.5, 0.0, 0.001, UPRIGHT)),))
    pushed = [first.push(scene, FORCE) for scene in (LONE, wider)]
    first.result_cache.flush()
    assert pushed[0] != pushed[1]
    (one,), (two,) = rows(tmp_path, "SELECT value FROM solutions ORDER BY id")
    for row, value in ((1, two), (2, one)):
        rows(tmp_path, "UPDATE solutions SET value = ? WHERE id = ?", (value, row))
    later = remembering(tmp_path)
    assert [later.push(scene, FORCE) for scene in (LONE, wider)] == pushed
    assert later.engine.asked == 2
    later.result_cache.flush()
    again = remembering(tmp_path)
    assert [again.push(scene, FORCE) for scene in (LONE, wider)] == pushed
    assert again.engine.asked == 0, "what was damaged has been written anew"


def test_every_difference_in_what_is_asked_is_another_question(tmp_path):
    solver = remembering(tmp_path)
    body = LONE.bodies[0]
    asked = [
        (LONE, FORCE),
        (LONE, PUSH_SPECS["kick"]),
        (LONE, PUSH_SPECS["step"]),
        (PAIR, FORCE),
        (PhysicsScene((replace(body, dynamics=replace(body.dynamics, friction=0.6)),)), FORCE),
        (PhysicsScene((replace(body, dynamics=replace(body.dynamics, mass_kg=3.5)),)), FORCE),
        (PhysicsScene((replace(body, pose=Pose(0.0, 0.0, 0.001, (0.0, 0.0, 1.0, 0.0))),)), FORCE),
        (PhysicsScene((body, replace(PAIR.bodies[1], moves=False))), FORCE),
    ]
    for scene, spec in asked:
        solver.push(scene, spec)
    solver.settle(LONE)
    assert solver.engine.asked == len(asked) + 1
    assert solver.result_cache.count() == len(asked) + 1 - 2, "those of two bodies stay in memory"


def test_other_rules_or_machines_are_not_believed(tmp_path):
    first = remembering(tmp_path)
    first.push(LONE, FORCE)
    first.result_cache.flush()
    later = remembering(tmp_path, origin="another processor")
    later.push(LONE, FORCE)
    assert later.engine.asked == 1


@pytest.mark.parametrize(
    "part",
    ["_CODE", "platform.python_version", "platform.libc_ver", "metadata.distribution"],
)
def test_whatever_answers_depend_on_is_in_the_origin(monkeypatch, part):
    here = origin.__wrapped__(default_engine())
    older = SimpleNamespace(
        name=default_engine().name, build="0, rules 0", libraries=default_engine().libraries
    )
    assert origin.__wrapped__(older) != here == origin.__wrapped__(default_engine())
    other = {
        "_CODE": "other code",
        "platform.python_version": lambda: "3.99",
        "platform.libc_ver": lambda: ("other", "1"),
        "metadata.distribution": lambda name: Record(f"another build of {name}"),
    }[part]
    monkeypatch.setattr(f"internav_data.physics.cache.{part}", other)
    assert origin.__wrapped__(default_engine()) not in (None, here)


def test_every_module_that_physics_imports_is_in_the_digest(tmp_path):
    module = sys.modules["internav_data.physics.cache"]
    root = Path(module.__file__).parents[2]
    found = module.solver_modules(root)
    for name in ("physics.pushing", "physics.engines.bullet", "geometry.obj", "records.poses"):
        assert f"internav_data.{name}" in found
    for file in found.values():
        copied = tmp_path / file.relative_to(root)
        copied.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, copied)
    here = module.code_digest(root)
    assert module.code_digest(tmp_path) == here
    assert here in origin(default_engine())
    seen = {here}
    for file in found.values():
        copied = tmp_path / file.relative_to(root)
        copied.write_text(copied.read_text() + "# changed\n")
        seen.add(module.code_digest(tmp_path))
    assert len(seen) == 1 + len(found)


class Record:
    def __init__(self, text):
        self.text = text

    def read_text(self, name):
        return self.text if name == "RECORD" else None


def test_where_a_build_cannot_be_told_nothing_is_kept(monkeypatch):
    monkeypatch.setattr("internav_data.physics.cache.metadata.distribution", lambda _: Record(None))
    assert origin.__wrapped__(default_engine()) is None
    monkeypatch.undo()
    other = SimpleNamespace(name="other", build="1", libraries=("no such library",))
    assert origin.__wrapped__(other) is None


finite = st.floats(allow_nan=False, allow_infinity=False, width=64)


poses = st.builds(lambda *n: Pose(*n[:3], n[3:]), *[finite] * 7)


paths = st.integers(1, 3).flatmap(lambda n: st.binary(min_size=28 * n, max_size=28 * n))


push_solutions = st.builds(
    lambda movers, seconds, at_rest: PushSolution(
        tuple(m[0] for m in movers),
        tuple(m[1] for m in movers),
        tuple(m[2] for m in movers),
        seconds,
        at_rest,
    ),
    st.lists(st.tuples(poses, st.tuples(*[finite] * 8), paths), min_size=1, max_size=4),
    finite,
    st.booleans(),
)


@given(push_solutions)
def test_motions_come_back_as_they_were(solution):
    count, written = len(solution.poses), pack_push(solution)
    assert repr(unpack_push(written, count)) == repr(solution)  # tells -0.0 from 0.0
    assert all(unpack_push(written[:k], count) is None for k in range(len(written)))
    assert unpack_push(written + b"x", count) is None
    assert unpack_push(written, count + 1) is None
    assert unpack_push(written, count - 1) is None


@given(push_solutions, st.sampled_from([math.nan, math.inf, -math.inf]))
def test_a_motion_that_is_not_finite_is_none(solution, number):
    pose = replace(solution.poses[-1], y=number)
    for wrong in (
        replace(solution, poses=(*solution.poses[:-1], pose)),
        replace(solution, seconds=number),
        replace(solution, sweeps=((number, *solution.sweeps[0][1:]), *solution.sweeps[1:])),
        replace(solution, paths=(*solution.paths[:-1], b"")),
        replace(solution, paths=(*solution.paths[:-1], b"abc")),
    ):
        assert unpack_push(pack_push(wrong), len(solution.poses)) is None


@given(poses, finite, finite, finite, st.booleans())
def test_rests_come_back_as_they_were(pose, seconds, penetration_m, reach_m, at_rest):
    rest = SettleSolution(pose, seconds, at_rest, penetration_m, reach_m)
    assert repr(unpack_settle(pack_settle(rest))) == repr(rest)
    assert unpack_settle(pack_settle(rest)[:-1]) is None
    assert unpack_settle(pack_settle(replace(rest, reach_m=math.nan))) is None


@given(st.binary(max_size=400), st.integers(0, 3))
def test_no_bytes_make_reading_fail(value, movers):
    unpack_push(value, movers)
    unpack_settle(value)


def kept(folder):
    solver = remembering(folder)
    solution = solver.push(LONE, FORCE)
    solver.result_cache.flush()
    return solution


def rows(folder, *question):
    with contextlib.closing(opened(folder)) as file:
        return file.execute(*question).fetchall()


def test_a_damaged_value_is_solved_anew(tmp_path):
    solution = kept(tmp_path)
    [(row, value)] = rows(tmp_path, "SELECT id, value FROM solutions")
    for at in (0, 5, len(value) - 1):
        damaged = bytearray(value)
        damaged[at] ^= 1
        rows(tmp_path, "UPDATE solutions SET value = ? WHERE id = ?", (bytes(damaged), row))
        later = remembering(tmp_path)
        assert later.push(LONE, FORCE) == solution
        assert later.engine.asked == 1
    rows(tmp_path, "UPDATE solutions SET value = 'text'")
    assert remembering(tmp_path).push(LONE, FORCE) == solution


@pytest.mark.parametrize("content", [b"", b"no database, but a text\n" * 400])
def test_what_is_no_database_is_begun_anew(tmp_path, content):
    (tmp_path / FILE_NAME).write_bytes(content)
    solution = kept(tmp_path)
    later = remembering(tmp_path)
    assert later.push(LONE, FORCE) == solution
    assert later.engine.asked == 0


@pytest.mark.parametrize(
    "schema",
    [
        "CREATE TABLE solutions (name TEXT)",
        """CREATE VIEW solutions AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i FROM n)
        SELECT i AS key, i AS value FROM n""",
        "CREATE TABLE something (else_ TEXT)",
    ],
)
def test_another_database_is_begun_anew(tmp_path, schema):
    rows(tmp_path, schema)
    solution = kept(tmp_path)
    later = remembering(tmp_path)
    assert later.push(LONE, FORCE) == solution
    assert later.engine.asked == 0


@pytest.mark.parametrize("where", [0.0, 0.3, 0.6])
def test_a_file_damaged_anywhere_costs_no_answer_and_is_begun_anew(tmp_path, where):
    solver = remembering(tmp_path)
    solution = solver.push(LONE, FORCE)
    for k in range(200):
        solver.result_cache.put(bytes([k]) * 32, bytes(3000))
    solver.result_cache.flush()
    path = tmp_path / FILE_NAME
    with path.open("r+b") as file:
        file.seek(int(where * path.stat().st_size))
        file.write(b"\xff" * (path.stat().st_size - file.tell()))
    asked = [bytes([k]) * 32 for k in range(200)]
    for _ in range(2):
        later = remembering(tmp_path)
        assert {later.result_cache.get(key) for key in asked} <= {None, bytes(3000)}
        assert later.push(LONE, FORCE) == solver.push(LONE, FORCE) == solution
    assert kept(tmp_path) == solution
    assert remembering(tmp_path).result_cache.count() >= 1


def test_a_folder_that_cannot_be_made_keeps_nothing(tmp_path):
    (tmp_path / "file").write_text("in the way")
    solver = remembering(tmp_path / "file" / "below")
    assert solver.push(LONE, FORCE) == solve_push(default_engine(), LONE, FORCE)
    assert solver.result_cache.count() == 0


def test_a_read_only_file_is_read(tmp_path, monkeypatch):
    kept(tmp_path)

    class ReadOnly(sqlite3.Connection):
        def __init__(self, *args, **kwargs):
            super().__init__(*args, **kwargs)
            self.execute("PRAGMA query_only = ON")

    monkeypatch.setattr(sqlite3, "connect", functools.partial(sqlite3.connect, factory=ReadOnly))
    solver = remembering(tmp_path)
    solver.push(LONE, FORCE)
    assert solver.engine.asked == 0
    solver.push(PAIR, FORCE)
    assert solver.result_cache.count() == 1


def test_a_writer_who_is_waited_for_in_vain_costs_no_answer(tmp_path, monkeypatch):
    monkeypatch.setattr("internav_data.physics.result_cache.OPENING_S", 0.2)
    solution = kept(tmp_path)
    held = remembering(tmp_path)
    with contextlib.closing(opened(tmp_path)) as other:
        other.execute("BEGIN EXCLUSIVE")
        shut_out = remembering(tmp_path)
        for solver in (held, shut_out):
            assert solver.push(LONE, FORCE) == solution
            solver.result_cache.flush()
    assert not shut_out.result_cache.is_open
    assert held.push(LONE, FORCE) == remembering(tmp_path).push(LONE, FORCE) == solution


def opened(folder):
    return sqlite3.connect(folder / FILE_NAME, isolation_level=None, timeout=0.1)


def test_solving_anew_believes_nothing_that_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr("internav_data.physics.registry.result_cache", lambda: held)

    class Recording(ResultCache):
        """Result cache that remembers the last key."""

        def put(self, key, value):
            self.last = key
            super().put(key, value)

    held = Recording(tmp_path)
    lie = replace(get_solver().push(LONE, FORCE), seconds=123.0)
    held.put(held.last, pack_push(lie))
    held.flush()
    held = ResultCache(tmp_path)
    assert get_solver().push(LONE, FORCE) == lie
    with cache_disabled():
        assert get_solver().push(LONE, FORCE) == solve_push(default_engine(), LONE, FORCE) != lie
    assert get_solver().push(LONE, FORCE) == lie
