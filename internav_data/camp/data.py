"""Training and validation episodes of a run, and environments over them."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.camp.agents.protocol import Agent
from internav_data.camp.config import CampConfig, ExpertColumn
from internav_data.camp.policy import AgentPolicy
from internav_data.camp.stages import TrainingStage
from internav_data.dataset import Dataset, load_dataset
from internav_data.dataset.select import condition
from internav_data.envs.tasks import InteractiveNavigation, Task
from internav_data.evaluation.evaluator import EvaluationConfig, evaluate
from internav_data.evaluation.metrics import summary
from internav_data.records import Episode
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from internav_data.envs.loop import Environments
    from internav_data.envs.sensors import Sensor

_SINGLE = ("room_count", "==", 1)
_MEANS = ("success", "spl", "sts", "distance_m", "steps")


class TrainingData:
    """A dataset's training and validation splits.

    Parameters
    ----------
    path
        A folder that `internav-gen generate` wrote.
    where
        Conditions on columns, as in "shortest_path_m<=6".
    expert
        Column of the experts to clone.
    task
        Main task: reward, end and metrics of training episodes.

    Raises
    ------
    CorruptDataError
        The dataset is damaged or of another version.
    UsageError
        The dataset has no training episodes, or no outcomes.
    """

    def __init__(
        self,
        path: Path,
        where: Sequence[str] = (),
        expert: ExpertColumn = "expert",
        task: type[Task] = InteractiveNavigation,
    ) -> None:
        self._expert, self._task = expert, task
        self.path, self._where = path, [condition(text) for text in where]
        episodes = self.episodes()
        if any(obstacle.outcomes is None for obstacle in episodes[0].obstacles):
            raise UsageError(
                f"{path}: its obstacles have no outcomes; generate it anew with this release"
            )
        self.fingerprint = episodes.fingerprint

    def episodes(self, *, single_room: bool = False) -> Dataset[Episode]:
        """Return the training split, or its scenes of a single room.

        Raises
        ------
        UsageError
            There are no such episodes.
        """
        conditions = [*self._where, *([_SINGLE] if single_room else [])]
        found = load_dataset(self.path, "train", conditions or None)
        if not len(found):
            what = "scenes of a single room" if single_room else "training episodes"
            what += " for which --filter holds" if self._where else ""
            advice = "`internav-gen stats` tells what it holds"
            if single_room:
                advice = "generate some (--rooms 1-3), or train --stages all"
            elif not self._where:
                advice = "of every 120 scenes the first two are val and test, so make more --scenes"
            raise UsageError(f"{self.path}: there are no {what}; {advice}")
        return found

    def episodes_of(self, stage: TrainingStage) -> Dataset[Episode]:
        """Return the training episodes of a stage."""
        if stage.clones:
            return self.demonstrated
        return self.episodes(single_room=stage.single_room)

    @functools.cached_property
    def demonstrated(self) -> Dataset[Episode]:
        """Episodes of the training split that have an expert, for cloning.

        Raises
        ------
        UsageError
            None of them has one.
        """
        everything = self.episodes()
        blind = self._expert == "blind_expert"
        option = "with --blind-expert" if blind else "without --keep-unsolvable"
        found = load_dataset(self.path, "train", [*self._where, (self._expert, "is not", None)])
        if not len(found):
            raise UsageError(
                f"{self.path}: none of {len(everything)} training episodes has an expert to clone "
                f"(column {self._expert}); generate some {option}, or train without --pretrain bc"
            )
        # A dataset without gaps keeps its own fingerprint, and its houses stay loaded.
        return everything if len(found) == len(everything) else found

    @functools.cached_property
    def without_expert(self) -> int:
        """Number of training episodes that cloning skips."""
        return len(self.episodes()) - len(self.demonstrated)

    def environments(
        self,
        stage: TrainingStage,
        config: CampConfig,
        local: range,
        sensors: Sequence[str | Sensor],
    ) -> Environments:
        """Return a stage's environments with the numbers in `local`."""
        from internav_data.envs.make import make_vector  # noqa: PLC0415 - the camera's kernels

        env: Any = make_vector(
            len(local), self.episodes_of(stage),
            min(config.run.workers, len(local)),
            autoreset_mode="Disabled", copy=False, sensors=sensors,
            task=stage.tasks[local.start : local.stop] or self._task,
            image_size=config.network.image_size, max_steps=config.run.max_steps,
            failed_done_reward=config.data.failed_done_reward,
            house_cache_size=config.data.house_cache_size,
        )  # fmt: skip
        return env  # type: ignore[no-any-return] # what `Environments` asks is there

    def validate(
        self, agent: Agent[Any], method: str, config: CampConfig
    ) -> dict[str, float] | None:
        """Return an agent's mean metrics on the validation split, None without episodes."""
        limit = config.run.validation_episodes
        episodes = load_dataset(self.path, "val", self._where or None)
        if not limit or not len(episodes):
            return None
        policy = AgentPolicy(method, agent, config.network.image_size, greedy=False)
        settings = EvaluationConfig(
            batch=min(config.ppo.num_envs, limit),
            workers=config.run.workers,
            max_steps=config.run.max_steps,
            limit=limit,
        )
        found = summary(evaluate(policy, episodes, settings))
        means = {name: found.values[name] or 0.0 for name in _MEANS}
        return {**means, "episodes": float(found.episodes)}
