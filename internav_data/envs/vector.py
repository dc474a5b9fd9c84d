"""Vector environment in one process; all environments share one camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from internav_data.envs.copies import Rebuilt, with_absolute_path
from internav_data.envs.episode import WHOLE, check_actions
from internav_data.envs.slot import (
    Arguments,
    EnvSlot,
    EpisodeSnapshot,
    as_list,
    check_choice,
    check_options,
    check_render_mode,
    check_seed,
    step_info,
    take_sensors,
)
from internav_data.envs.spaces import RENDER_SIZE, ObservationBuffer, observation_space
from internav_data.physics.registry import solver_counts
from internav_data.records.errors import UsageError
from internav_data.render.camera import Camera
from internav_data.world import ACTION_COUNT
from internav_data.world.masks import action_mask

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from internav_data.core.typing import Bools
    from internav_data.dataset import Dataset
    from internav_data.envs.sensors import Sensor
    from internav_data.envs.types import Observations, Stepped
    from internav_data.physics.cache import SolverCounts
    from internav_data.records import Episode

_RARE = ("episode_id", "metrics", "final_obs", "final_info")
"""Keys of infos that few steps have."""
OPTIONS = ("episode_id", "actions", "start", "reset_mask")


def declare_spaces(
    env: VectorEnv[Any, Any, Any],
    count: int,
    size: int,
    sensors: Sequence[str | Sensor],
    *,
    autoreset_mode: AutoresetMode | str,
    render_mode: str | None,
) -> AutoresetMode:
    """Set spaces and metadata of a vector environment; return its autoreset mode.

    Raises
    ------
    UsageError
        There is no such mode.
    """
    from gymnasium import spaces  # noqa: PLC0415 - a short name in a short place

    modes = {each.value: each for each in AutoresetMode}
    mode = modes.get(autoreset_mode) if isinstance(autoreset_mode, str) else autoreset_mode
    if not isinstance(mode, AutoresetMode):
        raise UsageError(f"autoreset_mode: expected one of {list(modes)}, got {autoreset_mode!r}")
    check_render_mode(render_mode)
    env.render_mode = render_mode
    env.num_envs = count
    env.single_observation_space = observation_space(size, sensors)
    env.single_action_space = spaces.Discrete(ACTION_COUNT)
    env.observation_space = batch_space(env.single_observation_space, count)
    env.action_space = batch_space(env.single_action_space, count)
    env.metadata = {"autoreset_mode": mode, "render_modes": ["rgb_array"], "render_fps": 4}
    return mode


def checked_batch(
    actions: NDArray[np.int64] | Sequence[int], done: Bools, mode: AutoresetMode
) -> list[int]:
    """Return the actions of a batch, all of which can be taken: (N,).

    Raises
    ------
    UsageError
        The shape is not (N,), an action is unknown, or an environment is done and waits for a
        reset.
    """
    if np.shape(actions) != done.shape:
        raise UsageError(f"step: expected {len(done)} actions, got shape {np.shape(actions)}")
    asked = check_actions(np.asarray(actions).tolist())
    if done.any() and mode == AutoresetMode.DISABLED:
        raise UsageError(
            f"step: environment {int(np.argmax(done))} is done; reset it by "
            "options={'reset_mask': …}"
        )
    return asked


def split_seeds(seed: int | Sequence[int | None] | None, count: int) -> list[int | None]:
    """Return the seed of each environment: seed, seed + 1, … for a number.

    Raises
    ------
    UsageError
        The number of seeds is not `count`, or one is no whole number of 0 or more.
    """
    if seed is None:
        return [None] * count
    if isinstance(seed, WHOLE):
        check_seed(seed)
        return [int(seed) + k for k in range(count)]
    seeds = as_list(seed, "seed", f"a whole number of 0 or more, or {count} of them")
    if len(seeds) != count:
        raise UsageError(f"seed: expected {count} seeds, got {len(seeds)}")
    return [check_seed(each) for each in seeds]


class InterNavVectorEnv(Rebuilt, VectorEnv[Any, Any, Any]):
    """N environments stepped in one process.

    Environment k is `InterNavEnv` reset with seed + k, to the last bit, except that infos have
    metrics at an episode's end alone.

    Parameters
    ----------
    num_envs
        Number of environments, N.
    dataset, image_size, render_mode, sensors, **arguments
        Arguments of `InterNavEnv`; `task` may name a task for each environment.
    autoreset_mode : gymnasium.vector.AutoresetMode, or its value
        "NextStep": after an episode's last step the next `step` begins another; it ignores that
        action and pays 0. "SameStep": the last step itself begins another, and infos have its own
        observation and info as `final_obs` and `final_info`. "Disabled": an environment that is
        done must be reset by `options={"reset_mask": …}`.
    copy
        False: return the buffers that the next step overwrites, not copies.
    buffers : dict of arrays
        Arrays (N, …) to write observations into, one a sensor; made if not given.

    Raises
    ------
    CorruptDataError
        There is no dataset, or it is damaged.
    UsageError
        An argument is out of its bounds or unknown.
    """

    def __init__(
        self,
        num_envs: int,
        dataset: str | Path | Dataset[Episode],
        image_size: int = 64,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        copy: bool = True,
        sensors: Sequence[str | Sensor] | None = None,
        buffers: Observations | None = None,
        **arguments: Unpack[Arguments],
    ) -> None:
        dataset, sensors = with_absolute_path(dataset), take_sensors(sensors, arguments)
        self._arguments = dict(
            arguments, num_envs=num_envs, dataset=dataset, image_size=image_size,
            autoreset_mode=autoreset_mode, render_mode=render_mode, copy=copy, sensors=sensors,
        )  # fmt: skip
        self.slots = EnvSlot.make(num_envs, dataset, arguments)
        self._mode = declare_spaces(
            self, num_envs, image_size, sensors, autoreset_mode=autoreset_mode,
            render_mode=render_mode,
        )  # fmt: skip
        camera = Camera(image_size)
        if buffers is None:
            self._buffer = ObservationBuffer.of(camera, num_envs, sensors)
        else:
            self._buffer = ObservationBuffer(camera, sensors, buffers)
        self._copy = copy
        self._large: Camera | None = None
        self.done = np.zeros(num_envs, np.bool_)
        """Environments whose episode is over, (N,) bool."""

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin an episode in every environment, or in some.

        Parameters
        ----------
        seed
            Seed of environment 0; environment k gets seed + k. Or N seeds. None goes on.
        options
            `reset_mask` (N,) bool: environments to reset; all if not given. `episode_id`: one for
            all, or N of them (None: the next of the order). `actions`: N sequences of actions to
            take at once. `start`: N nodes and quarter turns (i, j, quarter) to begin at (None: the
            start that the task chooses).

        Raises
        ------
        UsageError
            The seed or an option is wrong or of another length, or there is no such episode.
        """
        chosen = check_options(options, OPTIONS)
        seeds = split_seeds(seed, self.num_envs)
        mask, ids, actions, starts = reset_choices(chosen, self.num_envs)
        super().reset(seed=seeds[0])
        infos: dict[str, Any] = {}
        for k in np.flatnonzero(mask).tolist():
            slot, own = self.slots[k], seeds[k]
            if own is None and not slot.ordered:
                own = int(self.np_random.integers(2**32))
            if own is not None:
                slot.seed(own)
            infos = self._add_info(infos, self._begin(k, ids[k], actions[k], starts[k]), k)
        return self._observations(), infos

    def step(self, actions: NDArray[np.int64] | Sequence[int]) -> Stepped:
        """Act in every environment.

        Parameters
        ----------
        actions : (N,) int64
            Actions, 0 … 11, or -1 to wait.

        Raises
        ------
        UsageError
            The shape is not (N,), an action is unknown, or an environment is done and nothing
            resets it; then no environment has taken a step.
        """
        asked = checked_batch(actions, self.done, self._mode)
        count = self.num_envs
        rewards = np.zeros(count)
        terminated, truncated = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
        stepped: list[tuple[int, dict[str, Any]]] = []
        for k, action in enumerate(asked):
            if self.done[k]:  # next-step autoreset: this action is ignored
                stepped.append((k, self._begin(k)))
                continue
            run = self.slots[k].run
            step = run.step(action)
            rewards[k], terminated[k], truncated[k] = step
            self._buffer.write(k, run)
            info = step_info(run, step)
            self.done[k] = run.done
            if run.done and self._mode == AutoresetMode.SAME_STEP:
                last = {"final_obs": self._buffer.one(k), "final_info": info}
                info = {**last, **self._begin(k)}
            stepped.append((k, info))
        infos = self._joined(stepped)
        return self._observations(), rewards, terminated, truncated, infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Return each agent's view, N of (300, 300, 3) uint8; None without a render mode."""
        if self.render_mode is None:
            return None
        if self._large is None:
            self._large = Camera(RENDER_SIZE)
        return tuple(self._large.render([slot.run.view()]).rgb[0] for slot in self.slots)

    def action_masks(self) -> Bools:
        """Return which actions could succeed, (N, actions) bool: `internav_data.world.masks`."""
        return np.stack([action_mask(slot.run.world) for slot in self.slots])

    def snapshots(self) -> list[EpisodeSnapshot | None]:
        """Return a snapshot of each environment, None where no episode has begun."""
        return [slot.state() if slot.has_episode else None for slot in self.slots]

    def restore_snapshots(self, snapshots: Sequence[EpisodeSnapshot | None]) -> None:
        """Restore what `snapshots` returned."""
        for k, state in enumerate(snapshots):
            if state is not None:
                self._restore_slot(k, state)

    def solver_counts(self) -> SolverCounts:
        """Return the counters of this process's pushes, of other environments too."""
        return solver_counts()

    def state(self) -> tuple[EpisodeSnapshot, ...]:
        """Return a snapshot of each environment."""
        return tuple(slot.state() for slot in self.slots)

    def restore(self, states: Sequence[EpisodeSnapshot]) -> tuple[Observations, dict[str, Any]]:
        """Become the environments of snapshots; return observations, arrays (N, …) by sensor.

        Raises
        ------
        UsageError
            The number of snapshots is not `num_envs`.
        """
        if len(states) != self.num_envs:
            raise UsageError(f"restore: expected {self.num_envs} states, got {len(states)}")
        infos: dict[str, Any] = {}
        for k, state in enumerate(states):
            self._restore_slot(k, state)
            infos = self._add_info(infos, {"episode_id": state.episode_id}, k)
        return self._observations(), infos

    def _restore_slot(self, k: int, state: EpisodeSnapshot) -> None:
        run = self.slots[k].restore(state)
        self.done[k] = run.done
        self._buffer.write(k, run)

    def _begin(
        self,
        k: int,
        episode_id: str | None = None,
        actions: Sequence[int] = (),
        start: Sequence[int] | None = None,
    ) -> dict[str, Any]:
        run = self.slots[k].begin(episode_id, actions, start)
        self.done[k] = run.done
        self._buffer.write(k, run)
        return {"episode_id": run.episode.episode_id}

    def _joined(self, parts: list[tuple[int, dict[str, Any]]]) -> dict[str, Any]:
        """Join infos by slot, as Gymnasium lays them out.

        `VectorEnv._add_info` copies arrays for each environment and key; keys of every step are
        joined at once.
        """
        infos: dict[str, Any] = {}
        stepped = [k for k, info in parts if "target" in info]
        if stepped:
            mask = np.zeros(self.num_envs, np.bool_)
            mask[stepped] = True
            kinds = (("action_success", np.bool_), ("reason", object), ("target", np.int64))
            for name, kind in kinds:
                empty = None if kind is object else 0
                column = np.array([info.get(name, empty) for _, info in parts], dtype=kind)
                infos[name], infos[f"_{name}"] = column, mask.copy()
        _unify_metrics([info for _, info in parts])
        for k, info in parts:
            rest: dict[str, Any] = {key: info[key] for key in _RARE if key in info}
            if rest:
                infos = self._add_info(infos, rest, k)
        return infos

    def _observations(self) -> Observations:
        return self._buffer.copied() if self._copy else self._buffer.buffers


def _unify_metrics(infos: Sequence[dict[str, Any]]) -> None:
    """Give each metric of a step one type in all environments: a task may return 0 here, 0.5 there.

    Gymnasium makes an array of the first one's type, and would cut 0.5 to 0.
    """
    found = [
        info for one in infos for info in (one, one.get("final_info", {})) if "metrics" in info
    ]
    kinds: dict[str, set[type]] = {}
    for info in found:
        for name, value in info["metrics"].items():
            kinds.setdefault(name, set()).add(type(value))
    mixed = {
        name: float if any(issubclass(kind, float) for kind in given) else int
        for name, given in kinds.items()
        if len(given) > 1 and all(issubclass(kind, int | float) for kind in given)
    }
    for info in found if mixed else ():
        info["metrics"] = {
            name: mixed[name](value) if name in mixed else value
            for name, value in info["metrics"].items()
        }


def reset_choices(
    chosen: dict[str, Any], count: int
) -> tuple[Bools, list[str | None], list[Sequence[int]], list[Sequence[int] | None]]:
    """Return the mask (count,) bool of slots to reset, and a value of each option for each slot.

    The values are the episode's id, the actions to take at once and the start.

    Raises
    ------
    UsageError
        The mask is not (count,) bool or is empty, an option has another length, or the actions or
        the start of a slot to reset are wrong.
    """
    given_mask = chosen.get("reset_mask", np.ones(count, np.bool_))
    try:
        mask = np.asarray(given_mask)
    except ValueError as error:  # lists of several lengths
        raise UsageError(
            f"options['reset_mask']: expected {count} booleans, got {given_mask!r}"
        ) from error
    if mask.shape != (count,) or mask.dtype != np.bool_ or not mask.any():
        raise UsageError(
            f"options['reset_mask']: expected {count} booleans, one of them true at least; "
            f"got {mask.dtype} of shape {mask.shape}"
        )
    ids = chosen.get("episode_id")
    ids = [ids] * count if ids is None or isinstance(ids, str) else ids
    options = {
        "episode_id": ids,
        "actions": chosen.get("actions", [()] * count),
        "start": chosen.get("start", [None] * count),
    }
    for option, given in options.items():
        name = f"options[{option!r}]"
        options[option] = each = as_list(given, name, f"a list, one for each of {count}")
        if len(each) != count:
            raise UsageError(f"{name}: expected {count} of them, got {len(each)}")
    ids, actions, starts = options.values()
    for k in np.flatnonzero(mask).tolist():
        actions[k], starts[k] = check_choice(ids[k], actions[k], starts[k])
    return mask, ids, actions, starts
