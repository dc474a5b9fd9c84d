"""Runs: begin one, resume it, or forecast its time."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from typing import Any, Final

from internav_data.camp.checkpoint import TrainState, has_checkpoint, read
from internav_data.camp.config import CampConfig, StagesConfig, from_mapping
from internav_data.camp.distributed import is_first_rank
from internav_data.camp.logging import LOG
from internav_data.camp.stages import PARTS
from internav_data.camp.train import Request, Trainer
from internav_data.core.config import config_toml, known_keys, nested, plain
from internav_data.core.storage import disk_errors, lock_folder, write_atomically
from internav_data.dataset import has_manifest
from internav_data.records.errors import UsageError

CONFIG: Final = "config.toml"
"""File of a run's resolved settings, for people and for `--config`."""
CHANGEABLE: Final = (
    "stages.total_timesteps", "stages.extra_timesteps", "run.threads", "run.workers",
    "run.checkpoint_every", "run.validate_every", "run.tensorboard", "data.house_cache_size",
)  # fmt: skip
"""Settings that a resumed run may change. More steps go to its last stage."""
_TOTAL, _EXTRA = "stages.total_timesteps", "stages.extra_timesteps"
BUSY: Final = "another camp-train trains this run; wait for it to end, or choose another --out"
"""Reason for which a second process is refused."""
AGAIN: Final = "go on by --resume: the last checkpoint is whole; where there is none, begin again"
"""Advice after an error of the disk."""
_MEASURED: Final = 2
"""Updates that a forecast is made of, after one that warms up."""


@contextlib.contextmanager
def _writing(out: Path) -> Iterator[None]:
    """Hold a run's lock, in the first rank alone, and turn errors of its disk into one line."""
    if out.exists() and not out.is_dir():
        raise UsageError(f"{out}: --out: expected a folder, this is a file")
    lock = lock_folder(out, BUSY) if is_first_rank() else contextlib.nullcontext()
    with disk_errors(out, AGAIN), lock:
        yield


def begin(request: Request) -> Trainer:
    """Train a new run to its end.

    Raises
    ------
    UsageError
        There is a run already, or a dataset; or a setting is out of its bounds.
    LockedError
        Another process trains this run.
    InternavError
        The disk is full; the last checkpoint is whole.
    """
    out = request.out
    if has_manifest(out):
        raise UsageError(f"{out}: --out: a dataset is there; choose another folder for the run")
    with _writing(out):
        if has_checkpoint(out) or ((out / LOG).exists() and not (out / CONFIG).exists()):
            raise UsageError(
                f"{out}: a run is there already: go on with it by --resume, or choose another --out"
            )
        trainer = Trainer(request, TrainState(request.parts, request.clones))
        _write_config(trainer)
        trainer.fit()
    return trainer


def resume(request: Request, asked: Mapping[str, Any]) -> Trainer:
    """Train a run to its end from its last checkpoint.

    Parameters
    ----------
    request
        Arguments of the run; its config and method are those of the checkpoint.
    asked
        Arguments that must agree with the checkpoint: `method`, `clones`, and `config` (those of
        its settings that `keys` names, else all; those of `CHANGEABLE` replace the run's); `parts`
        replace those of the run.

    Raises
    ------
    UsageError
        The checkpoint is of another method, config or dataset, or has more steps than are asked
        for.
    CorruptDataError
        The checkpoint is damaged.
    LockedError
        Another process trains this run.
    InternavError
        The disk is full; the last checkpoint is whole.
    """
    with _writing(request.out):
        out, checkpoint = request.out, read(request.out)
        if not checkpoint.training:
            raise UsageError(
                f"{out}: an agent alone, without what a run needs to go on; resume the run "
                "that it came from"
            )
        method, task = asked.get("method") or checkpoint.method, checkpoint.progress.get("task")
        _check_same(out, "method", checkpoint.method, method, "leave --method out")
        _check_same(out, "task", task, request.task.name, "give the same task (`Request(task=…)`)")
        config = checkpoint.config
        if asked.get("config") is not None:
            config = _continued(out, config, asked["config"], asked.get("keys"))
        state = TrainState.from_progress(checkpoint.progress)
        if asked.get("clones") and not state.clones:
            raise UsageError(
                f"{out}: this run began without the expert; leave --pretrain out, or choose "
                "another --out"
            )
        if asked.get("parts") is not None:
            state.parts = tuple(asked["parts"])
        if config.stages != checkpoint.config.stages and PARTS[-1] not in state.parts:
            raise UsageError(
                f"{out}: more steps go to the stage {PARTS[-1]!r}, which this run leaves out: add "
                "it by --stages"
            )
        request = replace(request, method=checkpoint.method, config=config)
        trainer = Trainer(request, state, checkpoint)
        known, dataset = checkpoint.progress.get("dataset"), trainer.data.fingerprint
        _check_same(out, "dataset", known, dataset, "give the same dataset")
        if config != checkpoint.config:
            _write_config(trainer)
        trainer.fit()
        return trainer


def _check_same(out: Path, what: str, known: object, asked: object, advice: str) -> None:
    if known != asked:
        raise UsageError(
            f"{out}: a run of {what} {known!r}, asked for {asked!r}: {advice}, or choose another "
            "--out"
        )


def forecast(request: Request) -> list[tuple[str, int, float]]:
    """Return (stage, environment steps, seconds) of a run, from a short measurement.

    Nothing is written. Validation and checkpoints are not counted.
    """
    trainer = Trainer(request, TrainState(request.parts, request.clones))
    ppo, found = request.config.ppo, []
    for stage in trainer.stages:
        now = trainer.open(stage)
        trainer.state.critics = {stage.critic: ppo.critic_warmup_rollouts}  # whole updates
        with contextlib.closing(now.source.loop.env):
            trainer.update(now)
            began = time.perf_counter()
            for _ in range(_MEASURED):
                trainer.update(now)
            each = (time.perf_counter() - began) / _MEASURED
        trainer.state.done = 0
        steps = 0 if stage.clones else stage.updates * ppo.num_envs * ppo.num_steps
        found.append((stage.name, steps, each * stage.updates))
    return found


def _write_config(trainer: Trainer) -> None:
    if trainer.ranks.first:
        trainer.run.mkdir(parents=True, exist_ok=True)
        write_atomically(trainer.run / CONFIG, config_toml(trainer.config, "camp-train").encode())


def _continued(
    out: Path, known: CampConfig, asked: CampConfig, keys: Collection[str] | None
) -> CampConfig:
    """Return a run's config with what is `CHANGEABLE` as asked; refuse other settings that differ.

    Only `keys` are looked at, where they are given.
    """
    config = known
    for key in known_keys(known) if keys is None else keys:
        ours, theirs = plain(attrgetter(key)(known)), plain(attrgetter(key)(asked))
        if ours == theirs:
            continue
        if key not in CHANGEABLE:
            raise UsageError(
                f"{out}: {key} is {ours!r} in this run, asked for {theirs!r}: leave settings out "
                f"with --resume, or choose another --out (only {', '.join(CHANGEABLE)} may change)"
            )
        if key in {_TOTAL, _EXTRA}:
            total = theirs if key == _TOTAL else known.stages.total_timesteps + theirs
            key, theirs = _EXTRA, _more_steps(out, config.stages, total)  # noqa: PLW2901
        config = from_mapping(config, nested(key, theirs), "--resume")
    return config


def _more_steps(out: Path, stages: StagesConfig, total: int) -> int:
    """Return a run's steps beyond those that it began with, where it is to have a total of them."""
    first, before = stages.total_timesteps, stages.total_timesteps + stages.extra_timesteps
    if total < before and total != first:
        raise UsageError(
            f"{out}: {_TOTAL} is {before} in this run, asked for {total}: a run can be given more "
            "steps, not fewer"
        )
    return max(total, before) - first
