import errno
import inspect
import os
import pickle
import time

import pytest
import worker_stubs

from internav_data.core.messages import Done, Failed, Recipe
from internav_data.core.storage import OutsideError
from internav_data.core.worker import run_task, set_up
from internav_data.core.worker_pool import CannotStartError, WorkerPool
from internav_data.records import errors
from internav_data.records.errors import NotFiniteError, QuarantineError, UsageError

ERRORS = [
    kind
    for _, kind in inspect.getmembers(errors, inspect.isclass)
    if issubclass(kind, errors.InternavError)
]


def outcomes(recipe, tasks, size=2):
    with WorkerPool(size, recipe) as pool:
        return list(pool.run(tasks))


def test_all_tasks_are_done_once():
    results = outcomes(Recipe(worker_stubs.square, 1), range(20))
    assert sorted((r.task, r.value) for r in results) == [(n, n * n + 1) for n in range(20)]


def test_workers_are_kept_between_runs():
    with WorkerPool(1, Recipe(worker_stubs.square, 0)) as pool:
        first = [r.value for r in pool.run([2])]
        pids = pool.processes
        second = [r.value for r in pool.run([3, 4])]
        assert pool.processes == pids, "workers are kept between runs"
    assert (first, second) == ([4], [9, 16])


def test_no_more_workers_than_tasks():
    with WorkerPool(8, Recipe(worker_stubs.square, 0)) as pool:
        list(pool.run([1]))
        assert len(pool.processes) == 1


def test_a_crash_costs_a_retry_and_the_third_gives_the_task_up(tmp_path):
    results = outcomes(Recipe(worker_stubs.troubled, str(tmp_path)), range(12))
    done = {r.task for r in results if isinstance(r, Done)}
    failed = {r.task: r.reason for r in results if isinstance(r, Failed)}
    assert done == {0, 1, 2, 3, 4, 6, 8, 9, 10}
    assert set(failed) == {5, 7, 11}
    assert "SIGSEGV, 3 times" in failed[5]
    assert failed[7] == "no way can be blocked here"
    assert failed[11].startswith("ValueError: a bug (worker_stubs.py:")
    begun = {n: (tmp_path / f"begun-{n}").read_text().split() for n in range(12)}
    assert len(begun[3]) == 2
    assert len(set(begun[5])) == 3, "each try in a new process"
    assert all(len(begun[n]) == 1 for n in range(12) if n not in {3, 5})


def test_an_error_of_setup_is_raised_in_the_caller():
    with pytest.raises(UsageError, match=r"duck\.obj is no mesh"):
        outcomes(Recipe(worker_stubs.refusing, "duck.obj"), [1, 2, 3])


@pytest.mark.parametrize("kind", [*ERRORS, OutsideError])
def test_an_error_keeps_its_class_and_so_the_commands_exit_code(kind):
    fatal = [set_up(Recipe(worker_stubs.refusing_as, kind))]
    if kind is not QuarantineError:  # it ends its task alone
        fatal.append(run_task(worker_stubs.raising(kind), 1))
    for message in pickle.loads(pickle.dumps(fatal)):  # noqa: S301 - our own
        error = message.error()
        assert type(error) is kind
        assert "nothing to do" in str(error)


def test_an_error_of_a_task_is_raised_in_the_caller():
    with pytest.raises(NotFiniteError, match="task 1: nothing to do"):
        outcomes(Recipe(worker_stubs.not_finite, None), [1])


def test_workers_that_cannot_start_end_the_run():
    with pytest.raises(CannotStartError, match="ended with code 9"):
        outcomes(Recipe(worker_stubs.stillborn, None), [1])


def test_a_full_disk_ends_the_run():
    with pytest.raises(OSError, match="No space left on device") as caught:
        outcomes(Recipe(worker_stubs.full_disk, None), [1])
    assert (caught.value.errno, caught.value.filename) == (errno.ENOSPC, "/data/1")


def test_after_a_stop_only_running_tasks_end(tmp_path):
    ended = []
    with WorkerPool(2, Recipe(worker_stubs.noted, str(tmp_path))) as pool:
        for result in pool.run(range(1000), tick=lambda: not ended):
            ended.append(result.task)  # noqa: PERF401 - the flag reads it meanwhile
    # Two may have ended at once and two more have begun meanwhile; one worker may have slept.
    assert 1 <= len(ended) <= 4
    assert sorted(ended) == sorted(int(path.name) for path in tmp_path.iterdir())


def test_workers_are_gone_afterwards():
    with WorkerPool(2, Recipe(worker_stubs.square, 0)) as pool:
        list(pool.run(range(4)))
        pids = pool.processes
    assert pids
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_an_error_in_the_caller_ends_workers_at_once():
    began = time.monotonic()
    with pytest.raises(RuntimeError), WorkerPool(1, Recipe(worker_stubs.slow, 60)) as pool:
        for _ in pool.run([1], tick=lambda: (_ for _ in ()).throw(RuntimeError)):
            pass
    assert time.monotonic() - began < 45, "it does not wait for the task"


def test_a_worker_killed_within_a_message_costs_a_retry_too(tmp_path):
    results = outcomes(Recipe(worker_stubs.cut_short, str(tmp_path / "began")), [1], 1)
    assert results == [Done(1, 1)]
