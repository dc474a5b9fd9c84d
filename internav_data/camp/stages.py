"""Schedule of a run: its stages, their tasks and their numbers of updates (section 5.2)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from internav_data.camp.config import CampConfig
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import UsageError

CLONING: Final = "cloning"
"""Name of the stage that comes first with `--pretrain bc`."""
PARTS: Final = ("auxiliary", "single", "all")
"""Parts that `--stages` can name, in order."""
TASKS: Final = ("navigate", "push", "pick")
"""Auxiliary tasks, named after the policies that they train; see `internav_data.envs.tasks`."""
_NUMBERS: Final = (CLONING, *PARTS, *(f"auxiliary-{name}" for name in TASKS))


@dataclass(frozen=True, slots=True)
class TrainingStage:
    """Updates in a row with one optimiser, on the same tasks."""

    name: str
    tasks: tuple[str, ...]
    """Task of each environment; empty for the main task."""
    single_room: bool
    """Whether only scenes of a single room are used."""
    rate: float
    """Initial learning rate of Adam."""
    updates: int
    """Number of updates."""
    critic: str
    """Name of the critic that learns: each is new once."""
    decay_from: float = 0.0
    """Share of the learning rate's decay that is over when the stage begins; 1 is all of it."""
    decay_to: float = 1.0
    """Share that is over when the stage ends."""

    @property
    def clones(self) -> bool:
        """Whether experts are cloned in this stage."""
        return self.name == CLONING


def _cloning_stage(config: CampConfig) -> TrainingStage:
    """Return the stage that clones the dataset's experts."""
    cloning = config.cloning
    an_epoch = max(1, round(cloning.frames / (cloning.num_envs * cloning.num_steps)))
    rate, updates = cloning.learning_rate, an_epoch * cloning.epochs
    return TrainingStage(CLONING, (), single_room=False, rate=rate, updates=updates, critic="main")


def schedule(
    config: CampConfig, parts: Sequence[str], *, hierarchical: bool, clones: bool = False
) -> list[TrainingStage]:
    """Return the stages of a run.

    Every method gets the same environment steps: flat ones spend those of the auxiliary tasks on
    the main task in single rooms.

    Parameters
    ----------
    config
        Training config.
    parts
        Some of `PARTS`, one after the other; none for cloning alone.
    hierarchical
        Whether there are action policies to be trained in auxiliary tasks.
    clones
        Whether experts are cloned first.

    Raises
    ------
    UsageError
        An unknown part, more tasks side by side than environments, or less than one update to do.
    """
    stages, share_before = [_cloning_stage(config)] if clones else [], 0.0
    if clones and not parts:
        return stages
    check_parts(parts)
    stages_config, count = config.stages, config.ppo.num_envs
    steps = count * config.ppo.num_steps
    if stages_config.total_timesteps < steps:
        raise UsageError(
            f"stages.total_timesteps (--steps) is {stages_config.total_timesteps}: less than one "
            f"update of {steps} steps (ppo.num_envs x ppo.num_steps); ask for as many at least"
        )
    shares = _shares(config, hierarchical=hierarchical)
    updates = round(stages_config.total_timesteps / steps)
    extra = round(stages_config.extra_timesteps / steps)
    for name, (tasks, share) in shares.items():
        first, last = round(updates * share_before), round(updates * (share_before + share))
        share_before += share
        if name == PARTS[-1]:
            last += extra
        if name.split("-")[0] not in parts or last == first:
            continue
        decay = (first / (updates + extra), last / (updates + extra))
        joint = hierarchical and not tasks
        stages.append(
            TrainingStage(
                name, tasks, name != "all",
                stages_config.joint_learning_rate if joint else stages_config.learning_rate,
                last - first, name if tasks else "main",
                *(decay if stages_config.decay_over == "all" else (0.0, 1.0)),
            )
        )  # fmt: skip
    if len(stages) == clones:
        raise UsageError(
            f"stages.total_timesteps is {stages_config.total_timesteps}: less than one update of "
            f"{steps} steps is left for {', '.join(parts)} (stages.min_auxiliary_timesteps is "
            f"{stages_config.min_auxiliary_timesteps})"
        )
    return stages


def _shares(config: CampConfig, *, hierarchical: bool) -> dict[str, tuple[tuple[str, ...], float]]:
    """Return the tasks of each environment, and the share of all steps, by stage.

    Raises
    ------
    UsageError
        There are more tasks side by side than environments.
    """
    stages, count = config.stages, config.ppo.num_envs
    short = stages.total_timesteps < stages.min_auxiliary_timesteps
    auxiliary = 0.0 if short else stages.auxiliary_share
    if hierarchical and stages.side_by_side and auxiliary and count < len(TASKS):
        raise UsageError(
            f"ppo.num_envs is {count}: three auxiliary tasks side by side need 3 at least; "
            "or set stages.side_by_side=false"
        )
    shares: dict[str, tuple[tuple[str, ...], float]] = {}
    if hierarchical and not stages.side_by_side:
        for task in TASKS:
            shares[f"auxiliary-{task}"] = ((task,) * count, auxiliary / len(TASKS))
    else:
        tasks = tuple(TASKS[k * len(TASKS) // count] for k in range(count)) if hierarchical else ()
        shares["auxiliary"] = (tasks, auxiliary)
    single = stages.single_room_share
    return shares | {"single": ((), single), "all": ((), 1.0 - auxiliary - single)}


def check_parts(parts: Sequence[str]) -> None:
    """Check that parts follow each other.

    Raises
    ------
    UsageError
        A part is unknown, or one between them is missing.
    """
    first = PARTS.index(parts[0]) if parts and parts[0] in PARTS else -1
    if first < 0 or tuple(parts) != PARTS[first : first + len(parts)]:
        raise UsageError(
            f"--stages {','.join(parts)!r}: expected some of {','.join(PARTS)} that follow each "
            "other, in this order"
        )


def torch_seed(seed: int, stage: str, update: int) -> int:
    """Return the seed of torch's own random numbers in an update of a stage."""
    key = (_NUMBERS.index(stage), TrainingStream.TORCH)
    return int(generator(seed, Purpose.TRAINING, *key, draw=update).integers(2**62))


def order_seed(seed: int, stage: str) -> int:
    """Return the seed of environment 0 in a stage; environment k has the k-th after it."""
    rng = generator(
        seed, Purpose.TRAINING, attempt=TrainingStream.EPISODES, draw=_NUMBERS.index(stage)
    )
    return int(rng.integers(2**31))
