"""Threads of a process get the solutions of one, and nothing else enters the cache."""

import os
import subprocess
import sys
from dataclasses import replace

import pytest
from builders import UPRIGHT, chair, crate
from engines import default_engine
from threaded import run_in_threads

from internav_data.physics import Body, PhysicsScene, cache_disabled, get_solver
from internav_data.physics.cache import Solver, pack_push
from internav_data.physics.result_cache import ResultCache
from internav_data.records import PUSH_SPECS, Pose

FORCE = PUSH_SPECS["force"]
BOX = crate("Box_0", (0.4, 0.4, 0.3), mass_kg=3.0, friction=0.5)
BODIES = [
    Body.of(thing, Pose(0.0, 0.0, 0.001, (0.0, 0.0, s, c)))
    for thing in (BOX, chair())
    for s, c in ((0.0, 1.0), (0.6, 0.8), (1.0, 0.0))
]
LONE = [PhysicsScene((body,)) for body in BODIES]
CROWDED = [
    PhysicsScene((body, replace(BODIES[0], pose=Pose(0.8, 0.1, 0.001, UPRIGHT)))) for body in BODIES
]


def solved(solver):
    pushed = [solver.push(scene, FORCE) for scene in (*LONE, *CROWDED)]
    return pushed, [solver.settle(scene) for scene in LONE]


def uncached():
    return Solver(default_engine(), None, "here")


@pytest.fixture(scope="module")
def alone():
    return solved(uncached())


def test_threads_in_one_engine_solve_as_one_does(alone):
    assert run_in_threads(lambda _: solved(uncached()), 4) == [alone] * 4


def test_threads_keep_what_one_would_keep(alone, tmp_path):
    held = ResultCache(tmp_path)
    engine = Solver(default_engine(), held, "here")
    assert run_in_threads(lambda _: solved(engine), 8) == [alone] * 8
    assert held.count() == 2 * len(LONE)
    later = ResultCache(tmp_path)
    for scene, solution in zip(LONE, alone[0], strict=False):
        assert later.get(engine._key(repr(FORCE), scene)) == pack_push(solution)  # noqa: SLF001 - a key


def test_one_threads_doubt_is_not_anothers():
    """A validator in one thread believes nothing on disk, whatever begins or ends in another."""

    def work(number):
        engines = set()
        for _ in range(200):
            if number % 2:
                with cache_disabled():
                    engines.add(get_solver())
            else:
                engines.add(get_solver())
        return engines

    found = run_in_threads(work, 4)
    assert [len(engines) for engines in found] == [1] * 4
    assert found[0] == found[2] != found[1] == found[3]


FORKS = """
import os
import signal
from threaded import run_in_threads
from test_threads import FORCE, LONE, default_engine, solved, uncached
from internav_data.physics.solving import solve_push

def work(number):
    if number:
        return [solved(uncached()) for _ in range(2)] == [alone] * 2
    codes = []
    for _ in range(3):
        child = os.fork()
        if child == 0:
            signal.alarm(60)  # one that waits for a lock for ever ends
            os._exit(0 if solve_push(default_engine(), LONE[0], FORCE) == alone[0][0] else 1)
        codes.append(os.waitpid(child, 0)[1])
    return codes == [0, 0, 0]

alone = solved(uncached())
print(run_in_threads(work, 3))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_fork_while_another_thread_solves_solves_too():
    """The lock's holder stays behind in the parent.

    In a process that coverage.py does not trace: its tracers have a lock of their own, which a
    child would wait for before any line of ours.
    """
    untraced = {name: v for name, v in os.environ.items() if not name.startswith("COVERAGE_")}
    run = subprocess.run(
        [sys.executable, "-c", FORKS],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env=untraced | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert (run.stdout, run.returncode) == ("[True, True, True]\n", 0), run.stderr
