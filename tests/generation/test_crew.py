import os
import time

import crew_stubs
import pytest

from internav_data.generation.messages import Done, Failed
from internav_data.generation.worker_pool import CannotStartError, Recipe, WorkerPool
from internav_data.records.errors import InternavError, UsageError


def outcomes(recipe, tasks, size=2, **options):
    with WorkerPool(size, recipe, **options) as crew:
        return list(crew.run(tasks))


def test_all_tasks_are_done_once():
    results = outcomes(Recipe(crew_stubs.square, 1), range(20))
    assert sorted((r.task, r.value) for r in results) == [(n, n * n + 1) for n in range(20)]


def test_the_crew_takes_further_tasks():
    with WorkerPool(1, Recipe(crew_stubs.square, 0)) as crew:
        first = [r.value for r in crew.run([2])]
        pids = crew.processes
        second = [r.value for r in crew.run([3, 4])]
        assert crew.processes == pids, "workers are kept between runs"
    assert (first, second) == ([4], [9, 16])


def test_no_more_workers_than_tasks():
    with WorkerPool(8, Recipe(crew_stubs.square, 0)) as crew:
        list(crew.run([1]))
        assert len(crew.processes) == 1


def test_deaths_cost_a_retry_and_the_third_gives_the_task_up(tmp_path):
    results = outcomes(Recipe(crew_stubs.troubled, str(tmp_path)), range(12))
    done = {r.task for r in results if isinstance(r, Done)}
    failed = {r.task: r.reason for r in results if isinstance(r, Failed)}
    assert done == {0, 1, 2, 3, 4, 6, 8, 9, 10}
    assert set(failed) == {5, 7, 11}
    assert "SIGSEGV, 3 times" in failed[5]
    assert failed[7] == "no way can be blocked here"
    assert failed[11].startswith("ValueError: a bug (crew_stubs.py:")
    begun = {n: (tmp_path / f"begun-{n}").read_text().split() for n in range(12)}
    assert len(begun[3]) == 2
    assert len(set(begun[5])) == 3, "each try in a new process"
    assert all(len(begun[n]) == 1 for n in range(12) if n not in {3, 5})


def test_a_refused_setup_is_the_callers_error():
    with pytest.raises(UsageError, match=r"duck\.obj is no mesh"):
        outcomes(Recipe(crew_stubs.refusing, "duck.obj"), [1, 2, 3])


def test_workers_that_cannot_start_end_the_run():
    with pytest.raises(CannotStartError, match="ended with code 9"):
        outcomes(Recipe(crew_stubs.stillborn, None), [1])


def test_a_full_disk_ends_the_run():
    with pytest.raises(InternavError, match=r"No space left on device \(/data/1\)") as caught:
        outcomes(Recipe(crew_stubs.full_disk, None), [1])
    assert caught.value.exit_code == 1


def test_stopping_finishes_what_is_under_way():
    ended = []
    with WorkerPool(2, Recipe(crew_stubs.slow, 0.2), stop=lambda: bool(ended)) as crew:
        for result in crew.run(range(1000)):
            ended.append(result.task)  # noqa: PERF401 - the flag reads it meanwhile
    assert 2 <= len(ended) <= 4


def test_workers_are_gone_afterwards():
    with WorkerPool(2, Recipe(crew_stubs.square, 0)) as crew:
        list(crew.run(range(4)))
        pids = crew.processes
    assert pids
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_an_error_in_the_caller_ends_workers_at_once():
    began = time.monotonic()
    with pytest.raises(RuntimeError), WorkerPool(1, Recipe(crew_stubs.slow, 60)) as crew:
        for _ in crew.run([1], tick=lambda: (_ for _ in ()).throw(RuntimeError)):
            pass
    assert time.monotonic() - began < 10
