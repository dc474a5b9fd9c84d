"""The auxiliary tasks (section 5.2): to walk, to push, to carry, each for itself."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.camp.agents.options import NAVIGATE, PUSH
from internav_data.camp.stages import TASKS
from internav_data.camp.tasks import WithoutObstacles, env_state
from internav_data.envs.auxiliary import AuxiliaryStart, auxiliary_starts, is_cleared
from internav_data.envs.processes import concatenate_infos
from internav_data.envs.spaces import layout
from internav_data.envs.tasks import STEP, SUCCESS
from internav_data.envs.vector import InterNavVectorEnv
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.world.actions import INTERACTION_KINDS, Action

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from internav_data.dataset import Dataset
    from internav_data.envs.types import Observations, Stepped
    from internav_data.records import Episode

CHOSEN_ACTION: Final = 0.1
"""r_as and r_af: an interaction succeeds (once for each object), or fails."""
_STARTS_KEPT: Final = 8192


class AuxiliaryTasks:
    """Point navigation without obstacles; an obstacle to be pushed, or carried, out of the way.

    Push and Pick begin beside an obstacle drawn from those of their kind and pay 10 for Done once
    it is cleared, 0.1 for the first success with each object, -0.1 for each failure, and what
    interactions pay in the main task.

    Parameters
    ----------
    dataset
        Whose episodes.
    tasks
        The option that each environment is about, ascending.
    **arguments
        Of the environment.
    """

    def __init__(
        self,
        dataset: Dataset[Episode],
        tasks: Sequence[int],
        **arguments: Any,  # noqa: ANN401 - those of `InterNavVectorEnv`
    ) -> None:
        self.num_envs = len(tasks)
        walks = sum(task == NAVIGATE for task in tasks)
        self._counts = [count for count in (walks, len(tasks) - walks) if count]
        self._tasks, self._first = tasks, walks
        size, ids = arguments["image_size"], arguments.get("ids", False)
        shapes = layout(self.num_envs, size, ids=ids).items()
        self._seen = {name: np.zeros(shape, dtype) for name, (shape, dtype) in shapes}
        plain = WithoutObstacles(dataset.path, dataset.split, dataset.filters)
        self._parts = [
            (low, high, InterNavVectorEnv(
                high - low, data, autoreset=False, copy=False,
                buffers={name: array[low:high] for name, array in self._seen.items()}, **arguments,
            ))
            for low, high, data in ((0, walks, plain), (walks, len(tasks), dataset)) if high > low
        ]  # fmt: skip
        self._source = self._parts[-1][2].slots[0].source
        self._starts = lru_cache(_STARTS_KEPT)(self._starts_of)
        blank: dict[str, Any] = {"cursor": 0, "before": None, "paid": [], "extra": 0.0}
        self._notes = [dict(blank, paid=[]) for _ in tasks]
        self._seed = 0

    def begin(self, seed: int) -> Observations:
        """See `Task`."""
        self._seed = seed
        for low, _, env in self._parts:
            env.reset(seed=seed + low)
        for note in self._notes:
            note["cursor"] = 0
        return self.reset(options={"reset_mask": np.ones(self.num_envs, np.bool_)})[0]

    def reset(
        self,
        *,
        seed: int | None = None,  # noqa: ARG002 - `begin` takes it
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """See `Task`."""
        mask = (options or {})["reset_mask"]
        for low, high, env in self._parts:
            own: dict[str, Any] = {"reset_mask": mask[low:high]}
            if not own["reset_mask"].any():
                continue
            if low == self._first:
                chosen = [self._choose(k) if mask[k] else (None, None) for k in range(low, high)]
                own |= {"episode_id": [c[0] for c in chosen], "start": [c[1] for c in chosen]}
            env.reset(options=own)
        for k in np.flatnonzero(mask).tolist():
            self._notes[k] |= {"before": self._way(k), "paid": [], "extra": 0.0}
        return self._seen, {}

    def step(self, actions: NDArray[np.int64]) -> Stepped:
        """See `Task`."""
        found = [env.step(actions[low:high]) for low, high, env in self._parts]
        _, rewards, ended, cut, _ = (list(column) for column in zip(*found, strict=True))
        infos = concatenate_infos([part[4] for part in found], self._counts)
        reward, over = np.concatenate(rewards), np.concatenate(ended)
        told = infos.get("metrics", {})
        if told:
            told["auxiliary_reward"] = np.zeros(self.num_envs)
        for k in range(self._first, self.num_envs):
            note, extra = self._notes[k], 0.0
            if Action(actions[k]).kind in INTERACTION_KINDS:
                extra = self._chosen(note, int(infos["target"][k]), infos["action_success"][k])
            note["extra"] += extra
            before, reward[k] = reward[k], reward[k] + extra
            if over[k]:
                cleared = is_cleared(note["before"], self._way(k))
                reward[k] = STEP + SUCCESS * cleared
                told["success"][k] = cleared
                told["return"][k] += reward[k] - before
            if told:
                told["return"][k] += note["extra"]
                told["auxiliary_reward"][k] = note["extra"]
        if told:
            done, options = over | np.concatenate(cut), np.array(self._tasks)
            for option, name in TASKS.items():
                told[f"success_{name}"] = told["success"]
                told[f"_success_{name}"] = done & (options == option)
        return self._seen, reward, over, np.concatenate(cut), infos

    def state(self) -> list[dict[str, Any]]:
        """See `Task`."""
        states = [state for _, _, env in self._parts for state in env.state()]
        return [
            {**asdict(state), **note, "order": self._seed + k}
            for k, (state, note) in enumerate(zip(states, self._notes, strict=True))
        ]

    def restore(self, states: Sequence[Mapping[str, Any]]) -> Observations:
        """See `Task`."""
        if len(states) != self.num_envs:
            raise CorruptDataError(f"{len(states)} environments; expected {self.num_envs}")
        try:
            self._seed = int(states[0]["order"])
            self._notes = [
                {
                    "cursor": int(said["cursor"]),
                    "before": None if said["before"] is None else int(said["before"]),
                    "paid": [int(number) for number in said["paid"]],
                    "extra": float(said["extra"]),
                }
                for said in states
            ]
        except (KeyError, TypeError, ValueError) as error:
            raise CorruptDataError(f"environments: {error!r}") from error
        for low, high, env in self._parts:
            env.restore([env_state(said) for said in states[low:high]])
        return self._seen

    def close(self) -> None:
        """See `Task`."""
        for _, _, env in self._parts:
            env.close()

    def _chosen(self, note: dict[str, Any], target: int, success: object) -> float:
        """Return r_as - r_af."""
        if not success:
            return -CHOSEN_ACTION
        if target in note["paid"]:
            return 0.0
        note["paid"].append(target)
        return CHOSEN_ACTION

    def _way(self, k: int) -> int | None:
        """Return the lattice distance from where environment k began, as things lie now."""
        low, _, env = self._parts[-1] if k >= self._first else self._parts[0]
        run = env.slots[k - low].run
        here = run.start or (run.world.i, run.world.j)
        steps: int | None = run.world.lattice.distance((here[0], here[1]), run.world.goal)
        return steps

    def _choose(self, k: int) -> tuple[str, tuple[int, int, int]]:
        """Return the next episode that has something for environment k, and where to begin."""
        kind = "push" if self._tasks[k] == PUSH else "pick"
        order = self._source.order(self._seed + k, episodes_per_house=1, shuffle=True)
        note = self._notes[k]
        for _ in range(len(self._source.dataset)):
            number = order.number(note["cursor"])
            note["cursor"] += 1
            starts = self._starts(number, kind)
            if starts:
                obstacles = sorted({start.obstacle for start in starts})
                rng = generator(
                    self._seed + k,
                    Purpose.TRAINING,
                    attempt=TrainingStream.AUXILIARY,
                    draw=note["cursor"],
                )
                obstacle = obstacles[int(rng.integers(len(obstacles)))]
                start = next(each for each in starts if each.obstacle == obstacle)
                return self._source.episode(number).episode_id, (start.i, start.j, start.quarter)
        raise UsageError(
            f"{self._source.dataset!r}: no obstacle to learn to {kind} in scenes of a single room; "
            "generate more of them, or train --stages single,all"
        )

    def _starts_of(self, number: int, kind: Any) -> tuple[AuxiliaryStart, ...]:  # noqa: ANN401 - Kind
        episode = self._source.episode(number)
        stage = self._source.loaded_house(episode).model
        return auxiliary_starts(stage, episode, self._source.dataset.assets, kind)
