"""A run: begun, gone on with, or only predicted."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import torch

from internav_data.camp.agents import agent_names, make_agent
from internav_data.camp.agents.hierarchy import Hierarchy
from internav_data.camp.checkpoint import TrainState, has_checkpoint, read
from internav_data.camp.cloning import forecast_cloning
from internav_data.camp.config import CampConfig, plain
from internav_data.camp.data import TrainingData
from internav_data.camp.distributed import device_of, ranks_of
from internav_data.camp.logging import LOG
from internav_data.camp.stages import PARTS, check_parts, plan
from internav_data.camp.train import Trainer
from internav_data.core.config import config_toml
from internav_data.core.storage import write_atomically
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import CorruptDataError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from pathlib import Path

    from internav_data.camp.checkpoint import Checkpoint
    from internav_data.camp.stages import TrainingStage
    from internav_data.camp.train import Tell

CONFIG: Final = "config.toml"
"""The resolved settings of a run, for people and for `--config`."""
_MEASURED: Final = 2
"""Updates that a prediction is made of, after one that warms up."""


@dataclass(frozen=True, slots=True)
class Request:
    """What is asked for."""

    dataset: Path
    out: Path
    method: str = "camp"
    config: CampConfig = dataclasses.field(default_factory=CampConfig)
    parts: tuple[str, ...] = PARTS
    """Stages after cloning; none: cloning alone."""
    clones: bool = False
    """Clone the dataset's expert first."""
    device: str = "auto"


def begin(
    request: Request, tell: Tell | None = None, interrupted: Callable[[], int] = lambda: 0
) -> Trainer:
    """Train a new run to its end.

    Raises
    ------
    UsageError
        There is a run already, or something cannot be meant.
    """
    out = request.out
    if has_checkpoint(out) or ((out / LOG).exists() and not (out / CONFIG).exists()):
        raise UsageError(
            f"{out}: a run is there already: go on with it by --resume, or choose another --out"
        )
    if out.exists() and not out.is_dir():
        raise UsageError(f"{out}: --out: expected a folder, this is a file")
    trainer, stages = _prepared(request, tell, interrupted)
    if trainer.ranks.first:
        out.mkdir(parents=True, exist_ok=True)
        write_atomically(out / CONFIG, config_toml(request.config, "camp-train").encode())
    trainer.fit(stages)
    return trainer


def resume(
    request: Request,
    asked: Mapping[str, Any],
    tell: Tell | None = None,
    interrupted: Callable[[], int] = lambda: 0,
) -> Trainer:
    """Go on with a run from its last checkpoint.

    Parameters
    ----------
    request
        Where, on which dataset and device; its config counts for nothing.
    asked
        What was asked for besides, to be compared: `method`, `clones`, and `config` as far as
        `keys` go (all of it without them); `parts` are gone through.
    tell, interrupted
        See `Trainer`.

    Raises
    ------
    UsageError
        The checkpoint is of another method, config or dataset.
    CorruptDataError
        It is damaged.
    """
    since = read(request.out)
    if not since.training:
        raise UsageError(
            f"{request.out}: an agent alone, without what a run needs to go on; resume the run "
            "that it came from"
        )
    if asked.get("method") not in {None, since.method}:
        raise UsageError(
            f"{request.out}: a run of method {since.method!r}, asked for {asked['method']!r}: "
            "leave --method out, or choose another --out"
        )
    if asked.get("config") is not None:
        _compare(request.out, plain(since.config), plain(asked["config"]), asked.get("keys"))
    place = _place(since)
    if asked.get("clones") and not place.clones:
        raise UsageError(
            f"{request.out}: this run began without the expert; leave --pretrain out, or choose "
            "another --out"
        )
    if asked.get("parts") is not None:
        place.parts = list(asked["parts"])
    request = dataclasses.replace(
        request, method=since.method, config=since.config, parts=tuple(place.parts)
    )
    trainer, stages = _prepared(request, tell, interrupted, since, place)
    known = since.progress.get("dataset")
    if known != trainer.data.fingerprint:
        raise UsageError(
            f"{request.dataset}: fingerprint {trainer.data.fingerprint}, the run was trained on "
            f"{known}: give the same dataset"
        )
    _check_part(request.out, place, trainer, stages)
    trainer.fit(stages)
    return trainer


def forecast(request: Request) -> list[tuple[str, int, float]]:
    """Return (stage, environment steps, seconds) of a run, from a short measurement.

    Nothing is written. Validation and checkpoints are not counted.
    """
    trainer, stages = _prepared(request, None, lambda: 0)
    given = request.config.ppo
    found = []
    if request.clones:
        updates, seconds = forecast_cloning(trainer, _MEASURED)
        found.append(("cloning", 0, updates * seconds))
    for stage in stages:
        now = trainer.open(stage)
        trainer.place.critics[stage.critic] = given.critic_warmup_rollouts  # not new: whole updates
        try:
            trainer.update(now)
            began = time.perf_counter()
            for _ in range(_MEASURED):
                trainer.update(now)
            each = (time.perf_counter() - began) / _MEASURED
        finally:
            now.env.close()
        steps = stage.updates * given.num_envs * given.num_steps
        found.append((stage.name, steps, each * stage.updates))
    return found


def _prepared(
    request: Request,
    tell: Tell | None,
    interrupted: Callable[[], int],
    since: Checkpoint | None = None,
    place: TrainState | None = None,
) -> tuple[Trainer, list[TrainingStage]]:
    config = request.config
    torch.set_num_threads(config.run.threads)
    # Nothing here draws from torch's own generator, but a user's agent may.
    drawn = generator(config.seed, Purpose.TRAINING, attempt=TrainingStream.TORCH).integers(2**62)
    torch.manual_seed(int(drawn))
    data = TrainingData(request.dataset, config.data.filter)
    with torch.device("meta"):
        agent = make_agent(request.method, config)
    if not agent.optimised():
        names = ", ".join(name for name in agent_names() if name != request.method)
        raise UsageError(f"method {request.method!r} has nothing to learn; expected one of {names}")
    if not request.parts and not request.clones:
        raise UsageError("--stages cloning: there is nothing to clone without --pretrain bc")
    hierarchical = isinstance(agent, Hierarchy)
    stages = plan(config, request.parts, hierarchical=hierarchical) if request.parts else []
    if request.clones and config.agent.forbidden:
        raise UsageError(
            "agent.forbidden and --pretrain bc: the expert does what is forbidden; leave one "
            "of them out"
        )
    for single in {stage.single_room for stage in stages}:
        data.episodes(single_room=single)
    place = place or TrainState(list(request.parts), request.clones)
    trainer = Trainer(
        request.out, data, request.method, config, ranks_of(device_of(request.device)), place,
        since=since, tell=tell, interrupted=interrupted,
    )  # fmt: skip
    return trainer, stages


def _place(since: Checkpoint) -> TrainState:
    """Return where a run was.

    Raises
    ------
    CorruptDataError
        The checkpoint does not say.
    """
    blank = dataclasses.asdict(TrainState([], clones=False))
    said: dict[str, Any] = {name: since.progress.get(name) for name in blank}
    for name, value in blank.items():
        kinds = (int, float) if isinstance(value, float) else type(value)
        if not isinstance(said[name], kinds):
            raise CorruptDataError(f"checkpoint: progress: {name}: got {said[name]!r}")
    counts = [since.progress.get("log"), *said["critics"].values()]
    window = since.progress.get("window")
    if not all(type(count) is int and count >= 0 for count in counts):
        raise CorruptDataError(f"checkpoint: progress: log, critics: expected counts, got {counts}")
    if not isinstance(window, list) or not all(isinstance(each, dict) for each in window):
        raise CorruptDataError("checkpoint: progress: window: expected a list of episodes")
    place = TrainState(**said)
    if place.parts:
        try:
            check_parts([str(part) for part in place.parts])
        except UsageError as error:
            raise CorruptDataError(f"checkpoint: progress: parts: {error}") from error
    return place


def _check_part(
    out: Path, place: TrainState, trainer: Trainer, stages: Sequence[TrainingStage]
) -> None:
    """Refuse to leave a stage unfinished."""
    known = plan(trainer.config, PARTS, hierarchical=isinstance(trainer.agent, Hierarchy))
    unfinished = {stage.name for stage in known if place.done < stage.updates}
    if place.stage in unfinished and place.stage not in {stage.name for stage in stages}:
        part = place.stage.split("-")[0]
        raise UsageError(
            f"{out}: stage {place.stage} is not finished: go on with it first (--stages {part},…)"
        )


def _compare(
    out: Path,
    known: Any,  # noqa: ANN401 - plain values
    asked: Any,  # noqa: ANN401
    keys: Collection[str] | None,
    key: str = "",
) -> None:
    """Refuse settings that are others than a run's; only those in `keys`, where there are any."""
    if isinstance(known, dict):
        for name, value in known.items():
            _compare(out, value, asked[name], keys, f"{key}.{name}".lstrip("."))
    elif known != asked and (keys is None or key in keys):
        raise UsageError(
            f"{out}: {key} is {known!r} in this run, asked for {asked!r}: leave settings out "
            "with --resume, or choose another --out"
        )
