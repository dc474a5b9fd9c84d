"""Vector environment over several processes; observations lie in shared memory."""

from __future__ import annotations

import contextlib
import itertools
import math
import mmap
import os
import sys
import tempfile
import weakref
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv

from internav_data.core.main_module import dumped, loaded
from internav_data.core.processes import GRACE_S, Child
from internav_data.envs.copies import PlainSpec, with_absolute_path
from internav_data.envs.slot import EpisodeSnapshot, check_options, take_sensors, task_classes
from internav_data.envs.spaces import buffer_shapes
from internav_data.envs.vector import (
    OPTIONS,
    InterNavVectorEnv,
    checked_batch,
    declare_spaces,
    reset_choices,
    split_seeds,
)
from internav_data.physics.cache import SolverCounts
from internav_data.records.errors import InternavError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from multiprocessing.connection import Connection
    from pathlib import Path

    from numpy.typing import NDArray

    from internav_data.core.typing import Bools
    from internav_data.dataset import Dataset
    from internav_data.envs.sensors import Sensor
    from internav_data.envs.slot import Arguments
    from internav_data.envs.types import Observations, Stepped
    from internav_data.records import Episode

ALIGNMENT = 64
"""Bytes at a multiple of which each buffer begins in shared memory."""


def _arrays(
    memory: mmap.mmap, count: int, size: int, sensors: Sequence[str | Sensor]
) -> Observations:
    """Return views of shared memory as the buffers of a batch."""
    buffers, offset = {}, 0
    for name, (shape, dtype) in buffer_shapes(count, size, sensors).items():
        length = math.prod(shape)
        buffers[name] = np.frombuffer(memory, dtype, length, offset).reshape(shape)
        offset = _aligned(offset + buffers[name].nbytes)
    return buffers


def _memory_size(count: int, size: int, sensors: Sequence[str | Sensor]) -> int:
    """Return the bytes of a batch's buffers; at least 1, as no empty file can be mapped."""
    shapes = buffer_shapes(count, size, sensors).values()
    return sum(_aligned(math.prod(shape) * np.dtype(dtype).itemsize) for shape, dtype in shapes) + 1


def _aligned(size: int) -> int:
    return -(-size // ALIGNMENT) * ALIGNMENT


@contextlib.contextmanager
def _shared_file(size: int) -> Iterator[int]:
    """Yield the descriptor of a file without a name that lies in memory where the system can."""
    linux = sys.platform == "linux"
    name = "internav-observations"
    with os.fdopen(os.memfd_create(name), "r+b") if linux else tempfile.TemporaryFile() as file:
        file.truncate(size)
        yield file.fileno()


def serve(pipe: Connection[Any, Any]) -> None:
    """Serve requests from a pipe until it asks to close: the main function of a process.

    The first message holds the arguments. A request is (method, (arguments, keyword arguments));
    an answer is (True, result, done) or (False, error, done), where `done`, (n,) bool, tells which
    environments are done now: an error may come after some have begun anew. It is None where the
    process ends for the error.
    """
    try:
        env = _environments(*loaded(*pipe.recv()))
        pipe.send((True, None, env.done))
        while True:
            name, given = pipe.recv()
            if name == "close":
                return
            try:
                answer = getattr(env, name)(*given[0], **given[1])
            except InternavError as error:
                pipe.send((False, error, env.done))
                continue
            # Observations lie in the shared memory already: only the rest goes through the pipe.
            moved = name in {"reset", "step", "restore"}
            pipe.send((True, answer[1:] if moved else answer, env.done))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        raise
    except Exception as error:  # noqa: BLE001 - the parent raises it
        pipe.send((False, error, None))


def _environments(
    descriptor: int, count: int, rows: tuple[int, int], arguments: dict[str, Any]
) -> InterNavVectorEnv:
    """Return environments that write into some rows of a batch's buffers in a shared file."""
    size, sensors = arguments["image_size"], arguments["sensors"]
    memory = mmap.mmap(descriptor, _memory_size(count, size, sensors))
    os.close(descriptor)
    whole = _arrays(memory, count, size, sensors)
    own = {name: array[rows[0] : rows[1]] for name, array in whole.items()}
    return InterNavVectorEnv(rows[1] - rows[0], copy=False, buffers=own, **arguments)


def _kill(processes: Sequence[Child]) -> None:
    for process in processes:
        process.end(0.0)
        process.close()


def concatenate_infos(parts: Sequence[dict[str, Any]], counts: Sequence[int]) -> dict[str, Any]:
    """Join the infos of parts of a batch, as Gymnasium lays them out.

    Parameters
    ----------
    parts
        Infos of each part: arrays (count, …) by key, or dictionaries of them.
    counts
        Number of environments in each part.
    """
    whole: dict[str, Any] = {}
    ends = np.cumsum(counts)
    for key in dict.fromkeys(key for part in parts for key in part):
        given = [part.get(key) for part in parts]
        first = next(value for value in given if value is not None)
        if isinstance(first, dict):
            whole[key] = concatenate_infos([value or {} for value in given], counts)
            continue
        # Of numbers that one part has as whole ones, another may have fractions.
        dtype = np.result_type(*(value.dtype for value in given if value is not None))
        fill = None if dtype.kind == "O" else 0
        column = np.full(int(ends[-1]), fill, dtype=dtype)
        for value, count, end in zip(given, counts, ends.tolist(), strict=True):
            if value is not None:
                column[end - count : end] = value
        whole[key] = column
    return whole


class InterNavProcesses(PlainSpec, VectorEnv[Any, Any, Any]):
    """N environments stepped in several processes, each an `InterNavVectorEnv` of its share.

    Results are those of one `InterNavVectorEnv` of all, to the last bit.

    Parameters
    ----------
    num_envs, dataset, image_size, autoreset_mode, render_mode, copy, sensors, **arguments
        Arguments of `InterNavVectorEnv`; a loaded dataset is opened again in each process.
    workers
        Number of processes, at most one for each environment.

    Raises
    ------
    UsageError
        An argument is out of its bounds or unknown, or cannot be sent to another process.
    """

    def __init__(
        self,
        num_envs: int,
        dataset: str | Path | Dataset[Episode],
        workers: int = 2,
        image_size: int = 64,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        copy: bool = True,
        sensors: Sequence[str | Sensor] | None = None,
        **arguments: Any,  # noqa: ANN401 - those of `InterNavVectorEnv`
    ) -> None:
        sensors = take_sensors(sensors, cast("Arguments", arguments))
        if not 1 <= workers <= num_envs:
            raise UsageError(f"workers: expected 1 … {num_envs} (num_envs), got {workers}")
        self._mode = declare_spaces(
            self, num_envs, image_size, sensors, autoreset_mode=autoreset_mode,
            render_mode=render_mode,
        )  # fmt: skip
        self._copy, self._done = copy, np.zeros(num_envs, np.bool_)
        self._ordered = np.zeros(num_envs, np.bool_)  # environments that have an order of episodes
        given = dict(
            arguments, dataset=with_absolute_path(dataset), image_size=image_size,
            autoreset_mode=self._mode, render_mode=render_mode,
        )  # fmt: skip
        given["sensors"], tasks = sensors, task_classes(arguments, num_envs)
        bounds = [num_envs * k // workers for k in range(workers + 1)]
        self._rows = list(itertools.pairwise(bounds))
        self._counts = [high - low for low, high in self._rows]
        self._processes: list[Child] = []
        self._asked = [False] * workers  # processes whose answer has not been read
        # Environments that nobody closes, or that cannot be made.
        self._end = weakref.finalize(self, _kill, self._processes)
        # No locks: each process writes rows of its own, and only before it answers.
        size = _memory_size(num_envs, image_size, sensors)
        with _shared_file(size) as fd:
            self._buffers = _arrays(mmap.mmap(fd, size), num_envs, image_size, sensors)
            shares = [
                dumped((fd, num_envs, rows, {**given, "task": tasks[slice(*rows)]}))
                for rows in self._rows
            ]
            for _ in shares:
                self._processes.append(Child(serve, quiet=False, pass_fds=[fd]))
        for process, share in zip(self._processes, shares, strict=True):
            process.send(share)
        try:
            self._answers()
        except BaseException:
            self._end()
            raise

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin episodes; see `InterNavVectorEnv.reset`.

        Observations are arrays (N, …) by sensor.
        """
        chosen = check_options(options, OPTIONS)
        seeds = split_seeds(seed, self.num_envs)
        mask, ids, actions, starts = reset_choices(chosen, self.num_envs)
        super().reset(seed=seeds[0])
        for k in np.flatnonzero(mask & ~self._ordered).tolist():
            if seeds[k] is None:  # drawn here, as one process draws them for all
                seeds[k] = int(self.np_random.integers(2**32))
        asked = []
        for k, (low, high) in enumerate(self._rows):
            if mask[low:high].any():
                own: dict[str, Any] = {"reset_mask": mask[low:high], "episode_id": ids[low:high]}
                if "actions" in chosen:
                    own["actions"] = actions[low:high]
                if "start" in chosen:
                    own["start"] = starts[low:high]
                self._ask(k, "reset", seed=seeds[low:high], options=own)
                asked.append(k)
        answers = dict(zip(asked, self._answers(asked), strict=True))
        infos = [answers[k][0] if k in answers else {} for k in range(len(self._rows))]
        self._ordered |= mask
        return self._observations(), concatenate_infos(infos, self._counts)

    def step(self, actions: NDArray[np.int64] | Sequence[int]) -> Stepped:
        """Take actions (N,) int64; see `InterNavVectorEnv.step`.

        Raises
        ------
        UsageError
            As `InterNavVectorEnv.step`; no environment of any process has taken a step then.
        """
        asked = checked_batch(actions, self._done, self._mode)
        for k, (low, high) in enumerate(self._rows):
            self._ask(k, "step", asked[low:high])
        rewards, terminated, truncated, infos = zip(*self._answers(), strict=True)
        return (
            self._observations(),
            np.concatenate(rewards),
            np.concatenate(terminated),
            np.concatenate(truncated),
            concatenate_infos(infos, self._counts),
        )

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return each agent's view, N of (300, 300, 3) uint8; None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(picture for pictures in self._ask_all("render") for picture in pictures)

    def action_masks(self) -> Bools:
        """Return which actions could succeed, (N, actions) bool: `internav_data.world.masks`."""
        return np.concatenate(self._ask_all("action_masks"))

    def solver_counts(self) -> SolverCounts:
        """Return the counters of the processes' pushes, summed."""
        return SolverCounts.total(self._ask_all("solver_counts"))

    def state(self) -> tuple[EpisodeSnapshot, ...]:
        """Return a snapshot of each environment."""
        return tuple(state for states in self._ask_all("state") for state in states)

    def restore(self, states: Sequence[EpisodeSnapshot]) -> tuple[Observations, dict[str, Any]]:
        """Become the environments of snapshots; return observations, arrays (N, …) by sensor.

        Raises
        ------
        UsageError
            The number of snapshots is not `num_envs`.
        """
        if len(states) != self.num_envs:
            raise UsageError(f"restore: expected {self.num_envs} states, got {len(states)}")
        for k, (low, high) in enumerate(self._rows):
            self._ask(k, "restore", list(states[low:high]))
        (infos,) = zip(*self._answers(), strict=True)
        self._ordered[:] = True
        return self._observations(), concatenate_infos(infos, self._counts)

    def __getstate__(self) -> dict[str, Any]:
        raise UsageError(
            "InterNav: environments in processes cannot be copied or pickled: make others with the "
            "same arguments, and restore() there what state() returns here"
        )

    def close_extras(self, **_: Any) -> None:  # noqa: ANN401 - Gymnasium's signature
        """Stop the processes."""
        for process in self._processes:
            process.send(("close", ((), {})))
        for process in self._processes:
            process.end(GRACE_S)
        self._end()

    def _ask_all(self, name: str) -> list[Any]:
        """Return every process's answer to a question without arguments."""
        for k in range(len(self._processes)):
            self._ask(k, name)
        return self._answers()

    def _ask(self, k: int, name: str, *given: Any, **named: Any) -> None:  # noqa: ANN401 - of any method
        if self.closed:
            raise UsageError("environments: they were closed; make them again to go on")
        if self._asked[k]:
            # Its answer to an earlier call is still to come, and would be taken for this one's.
            raise InternavError(
                f"environments: an earlier call was interrupted before process {k + 1} of "
                f"{len(self._processes)} had answered; make the environment again"
            )
        self._processes[k].send((name, (given, named)))
        self._asked[k] = True

    def _answers(self, of: Sequence[int] | None = None) -> list[Any]:
        """Return the answers of some processes, or raise the first error.

        All answers are read before an error is raised: no pipe is left full, and what the other
        processes have done is known.
        """
        answers: list[Any] = []
        errors: list[Exception] = []
        for k in range(len(self._processes)) if of is None else of:
            try:
                good, answer, done = self._processes[k].pipe.recv()
            except (EOFError, OSError):
                good, answer, done = False, InternavError(self._death(k)), None
            self._asked[k] = False
            if done is not None:
                self._done[slice(*self._rows[k])] = done
            (answers if good else errors).append(answer)
        if errors:
            raise errors[0]
        return answers

    def _death(self, k: int) -> str:
        return (
            f"environments: process {k + 1} of {len(self._processes)} "
            f"{self._processes[k].exit_cause()}; make the environment again, with fewer workers or "
            "num_envs"
        )

    def _observations(self) -> Observations:
        if not self._copy:
            return self._buffers
        return {name: buffer.copy() for name, buffer in self._buffers.items()}
