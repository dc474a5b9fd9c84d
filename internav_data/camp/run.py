"""Runs: begin one, resume it, or forecast its time."""

from __future__ import annotations

import dataclasses
import time
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

import torch

from internav_data.camp.agents import Hierarchy, agent_names, make_agent
from internav_data.camp.checkpoint import TrainState, has_checkpoint, read
from internav_data.camp.config import CampConfig
from internav_data.camp.data import TrainingData
from internav_data.camp.distributed import device_of, distributed_context
from internav_data.camp.logging import LOG
from internav_data.camp.stages import CLONING, PARTS, cloning_stage, schedule
from internav_data.camp.train import Trainer
from internav_data.core.config import config_toml, known_keys, plain
from internav_data.core.storage import write_atomically
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from pathlib import Path

    from internav_data.camp.checkpoint import Checkpoint
    from internav_data.camp.stages import TrainingStage
    from internav_data.camp.train import Callback

CONFIG: Final = "config.toml"
"""File of a run's resolved settings, for people and for `--config`."""
_MEASURED: Final = 2
"""Updates that a forecast is made of, after one that warms up."""


@dataclass(frozen=True, slots=True)
class Request:
    """Arguments of a run."""

    dataset: Path
    out: Path
    """The run's folder."""
    method: str = "camp"
    config: CampConfig = dataclasses.field(default_factory=CampConfig)
    parts: tuple[str, ...] = PARTS
    """Stages after cloning; none for cloning alone."""
    clones: bool = False
    """Whether the dataset's experts are cloned first."""
    device: str = "auto"


def begin(
    request: Request, callback: Callback | None = None, interrupted: Callable[[], int] = lambda: 0
) -> Trainer:
    """Train a new run to its end; see `Trainer` for the last two arguments.

    Raises
    ------
    UsageError
        There is a run already, or a setting cannot be meant.
    """
    out = request.out
    if has_checkpoint(out) or ((out / LOG).exists() and not (out / CONFIG).exists()):
        raise UsageError(
            f"{out}: a run is there already: go on with it by --resume, or choose another --out"
        )
    if out.exists() and not out.is_dir():
        raise UsageError(f"{out}: --out: expected a folder, this is a file")
    state = TrainState(request.parts, request.clones)
    trainer, stages = _prepared(request, state, None, callback, interrupted)
    if trainer.ranks.first:
        out.mkdir(parents=True, exist_ok=True)
        write_atomically(out / CONFIG, config_toml(request.config, "camp-train").encode())
    trainer.fit(stages)
    return trainer


def resume(
    request: Request,
    asked: Mapping[str, Any],
    callback: Callback | None = None,
    interrupted: Callable[[], int] = lambda: 0,
) -> Trainer:
    """Train a run to its end from its last checkpoint.

    Parameters
    ----------
    request
        Arguments of the run; its config and method are those of the checkpoint.
    asked
        Arguments that must agree with the checkpoint: `method`, `clones`, and `config` (those of
        its settings that `keys` names, else all); `parts` replace those of the run.
    callback, interrupted
        See `Trainer`.

    Raises
    ------
    UsageError
        The checkpoint is of another method, config or dataset.
    CorruptDataError
        The checkpoint is damaged.
    """
    out, checkpoint = request.out, read(request.out)
    if not checkpoint.training:
        raise UsageError(
            f"{out}: an agent alone, without what a run needs to go on; resume the run "
            "that it came from"
        )
    if asked.get("method") not in {None, checkpoint.method}:
        raise UsageError(
            f"{out}: a run of method {checkpoint.method!r}, asked for {asked['method']!r}: "
            "leave --method out, or choose another --out"
        )
    if asked.get("config") is not None:
        _compare(out, checkpoint.config, asked["config"], asked.get("keys"))
    state = TrainState.from_progress(checkpoint.progress)
    if asked.get("clones") and not state.clones:
        raise UsageError(
            f"{out}: this run began without the expert; leave --pretrain out, or choose "
            "another --out"
        )
    if asked.get("parts") is not None:
        state.parts = tuple(asked["parts"])
    request = dataclasses.replace(
        request, method=checkpoint.method, config=checkpoint.config, parts=state.parts,
        clones=state.clones and state.stage in {"", CLONING},
    )  # fmt: skip
    trainer, stages = _prepared(request, state, checkpoint, callback, interrupted)
    known = checkpoint.progress.get("dataset")
    if known != trainer.data.fingerprint:
        raise UsageError(
            f"{request.dataset}: fingerprint {trainer.data.fingerprint}, the run was trained on "
            f"{known}: give the same dataset"
        )
    _check_finished(out, trainer, stages)
    trainer.fit(stages)
    return trainer


def forecast(request: Request) -> list[tuple[str, int, float]]:
    """Return (stage, environment steps, seconds) of a run, from a short measurement.

    Nothing is written. Validation and checkpoints are not counted.
    """
    trainer, stages = _prepared(request, TrainState(request.parts, request.clones))
    ppo, found = request.config.ppo, []
    for stage in stages:
        now = trainer.open(stage)
        trainer.state.critics[stage.critic] = ppo.critic_warmup_rollouts  # to measure whole updates
        try:
            trainer.update(now)
            began = time.perf_counter()
            for _ in range(_MEASURED):
                trainer.update(now)
            each = (time.perf_counter() - began) / _MEASURED
        finally:
            now.source.loop.env.close()
        trainer.state.done = 0
        steps = 0 if stage.clones else stage.updates * ppo.num_envs * ppo.num_steps
        found.append((stage.name, steps, each * stage.updates))
    return found


def _prepared(
    request: Request,
    state: TrainState,
    checkpoint: Checkpoint | None = None,
    callback: Callback | None = None,
    interrupted: Callable[[], int] = lambda: 0,
) -> tuple[Trainer, list[TrainingStage]]:
    """Return the trainer of a run and the stages that it has before it."""
    config = request.config
    torch.set_num_threads(config.run.threads)
    # Nothing here draws from torch's own generator, but a user's agent may.
    seed = generator(config.seed, Purpose.TRAINING, attempt=TrainingStream.TORCH).integers(2**62)
    torch.manual_seed(int(seed))
    data = TrainingData(request.dataset, config.data.filter)
    with torch.device("meta"):
        agent = make_agent(request.method, config)
    if not agent.optimised():
        names = ", ".join(name for name in agent_names() if name != request.method)
        raise UsageError(f"method {request.method!r} has nothing to learn; expected one of {names}")
    if not request.parts and not state.clones:
        raise UsageError("--stages cloning: there is nothing to clone without --pretrain bc")
    if state.clones and config.agent.forbidden:
        raise UsageError(
            "agent.forbidden and --pretrain bc: the expert does what is forbidden; leave one "
            "of them out"
        )
    stages = [cloning_stage(config)] if request.clones else []
    if request.parts:
        hierarchical = isinstance(agent, Hierarchy)
        stages += schedule(config, request.parts, hierarchical=hierarchical)
    for single in {stage.single_room for stage in stages}:
        data.episodes(single_room=single)  # refuses a dataset without any
    ranks = distributed_context(device_of(request.device))
    trainer = Trainer(
        request.out, data, request.method, config, ranks, state,
        checkpoint=checkpoint, callback=callback, interrupted=interrupted,
    )  # fmt: skip
    return trainer, stages


def _check_finished(out: Path, trainer: Trainer, stages: Sequence[TrainingStage]) -> None:
    """Refuse to leave a stage unfinished."""
    state, hierarchical = trainer.state, isinstance(trainer.agent, Hierarchy)
    known = schedule(trainer.config, PARTS, hierarchical=hierarchical)
    unfinished = {stage.name for stage in known if state.done < stage.updates}
    if state.stage in unfinished and state.stage not in {stage.name for stage in stages}:
        part = state.stage.split("-")[0]
        raise UsageError(
            f"{out}: stage {state.stage} is not finished: go on with it first (--stages {part},…)"
        )


def _compare(out: Path, known: CampConfig, asked: CampConfig, keys: Collection[str] | None) -> None:
    """Refuse settings that differ from those of a run; only `keys`, where they are given."""
    for key in known_keys(known) if keys is None else keys:
        ours, theirs = plain(attrgetter(key)(known)), plain(attrgetter(key)(asked))
        if ours != theirs:
            raise UsageError(
                f"{out}: {key} is {ours!r} in this run, asked for {theirs!r}: leave settings out "
                "with --resume, or choose another --out"
            )
