"""Which tasks are trained in which order, for how many steps (section 5.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.camp.config import CampConfig

PARTS: Final = ("auxiliary", "single", "all")
"""What `--stages` can name, in order."""
TASKS: Final = ("navigate", "push", "pick")
"""Auxiliary tasks, named after the policies that they train; see `internav_data.envs.tasks`."""
_NUMBERS: Final = ("cloning", *PARTS, *(f"auxiliary-{name}" for name in TASKS))


@dataclass(frozen=True, slots=True)
class TrainingStage:
    """A run of updates with an optimiser of its own."""

    name: str
    part: str
    """Of `PARTS`."""
    tasks: tuple[str, ...]
    """Task of each environment; empty for the main task."""
    single_room: bool
    """Only scenes of a single room."""
    rate: float
    """Of Adam at the beginning."""
    updates: int
    critic: str
    """Whose values are learnt: critics are new once each."""
    decay_from: float
    """How much of the decay is over when it begins; 1 is all."""
    decay_to: float
    """… and when it ends."""


def plan(config: CampConfig, parts: Sequence[str], *, hierarchical: bool) -> list[TrainingStage]:
    """Return the stages of a run.

    Every method gets the same environment steps: flat ones spend those of the auxiliary tasks on
    the main task in single rooms.

    Parameters
    ----------
    config
        Of the run.
    parts
        Some of `PARTS`.
    hierarchical
        Whether there are action policies to be trained in auxiliary tasks.

    Raises
    ------
    UsageError
        An unknown part, or more tasks side by side than environments.
    """
    check_parts(parts)
    given, count = config.stages, config.ppo.num_envs
    names = list(TASKS) if hierarchical and not given.side_by_side else []
    if hierarchical and given.side_by_side and given.auxiliary_share and count < len(TASKS):
        raise UsageError(
            f"ppo.num_envs is {count}: three auxiliary tasks side by side need 3 at least; "
            "or set stages.side_by_side=false"
        )
    shares = [
        *((("auxiliary", task), given.auxiliary_share / len(names)) for task in names),
        *([] if names else [(("auxiliary", ""), given.auxiliary_share)]),
        (("single", ""), given.single_room_share),
        (("all", ""), 1.0 - given.auxiliary_share - given.single_room_share),
    ]
    whole = max(1, round(given.total_timesteps / (count * config.ppo.num_steps)))
    stages, share_before = [], 0.0
    for (part, task), share in shares:
        first, last = round(whole * share_before), round(whole * (share_before + share))
        share_before += share
        if part not in parts or last == first:
            continue
        over = (first / whole, last / whole) if given.decay_over == "all" else (0.0, 1.0)
        stages.append(_stage(config, part, task, last - first, over, hierarchical=hierarchical))
    if not stages:
        raise UsageError(
            f"stages.total_timesteps is {given.total_timesteps}: less than one update of "
            f"{count * config.ppo.num_steps} steps is left for {', '.join(parts)}"
        )
    return stages


def check_parts(parts: Sequence[str]) -> None:
    """Refuse what is no run of stages."""
    first = PARTS.index(parts[0]) if parts and parts[0] in PARTS else -1
    if first < 0 or tuple(parts) != PARTS[first : first + len(parts)]:
        raise UsageError(
            f"--stages {','.join(parts)!r}: expected some of {','.join(PARTS)} that follow each "
            "other, in this order"
        )


def order_seed(seed: int, stage: str) -> int:
    """Return the seed of environment 0 in a stage; environment k has the k-th after it."""
    rng = generator(
        seed, Purpose.TRAINING, attempt=TrainingStream.EPISODES, draw=_NUMBERS.index(stage)
    )
    return int(rng.integers(2**31))


def _stage(
    config: CampConfig,
    part: str,
    task: str,
    updates: int,
    over: tuple[float, float],
    *,
    hierarchical: bool,
) -> TrainingStage:
    auxiliary = part == "auxiliary" and hierarchical
    count, given = config.ppo.num_envs, config.stages
    tasks: tuple[str, ...] = ()
    if auxiliary:
        side_by_side = tuple(TASKS[k * len(TASKS) // count] for k in range(count))
        tasks = (task,) * count if task else side_by_side
    name = f"{part}-{task}" if task else part
    rate = given.joint_learning_rate if hierarchical and not auxiliary else given.learning_rate
    return TrainingStage(
        name, part, tasks, part != "all", rate, updates, name if auxiliary else "main", *over
    )
