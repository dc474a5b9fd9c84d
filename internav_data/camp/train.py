"""Trainer: the stages of a run, update by update, with logs, validations and checkpoints."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final

import torch

from internav_data.camp import cloning, ppo
from internav_data.camp.agents import AuxiliaryAgent, Hierarchy, make_agent
from internav_data.camp.checkpoint import (
    Checkpoint,
    best_score,
    pack,
    save,
    snapshots_of,
    unpack,
)
from internav_data.camp.cloning import Demonstrations, experts_of
from internav_data.camp.logging import EpisodeWindow, MetricsLogger, rates
from internav_data.camp.rollout import Collector, orders_of, uniforms_of
from internav_data.camp.stages import order_seed
from internav_data.core.interrupts import InterruptedRunError
from internav_data.records.errors import NotFiniteError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from torch.optim import Optimizer

    from internav_data.camp.agents import Agent
    from internav_data.camp.checkpoint import TrainState
    from internav_data.camp.config import CampConfig
    from internav_data.camp.data import TrainingData
    from internav_data.camp.distributed import DistributedContext
    from internav_data.camp.logging import Row
    from internav_data.camp.rollout import Rollout
    from internav_data.camp.stages import TrainingStage

    Callback = Callable[[Row], object]
    """Function that is called with every row of the log."""

INTERRUPTED: Final = "saved; go on with --resume"
_CLONING_SAVES: Final = 4
"""Factor between checkpoints of cloning and of PPO, as its updates are smaller."""


@dataclass(frozen=True, slots=True)
class StageRun:
    """A stage under way."""

    stage: TrainingStage
    learner: Agent[Any]
    """Agent that the stage trains."""
    optimiser: Optimizer
    source: Collector | Demonstrations
    """Environments in which it acts, or in which experts act for it."""
    own: range
    """Numbers of this rank's environments."""
    seed: int
    """Seed of the first of them."""


class Trainer:
    """An agent, its data, and the counters of its run.

    Parameters
    ----------
    run
        The run's folder.
    data
        Training and validation episodes.
    method, config
        Method name and training config.
    ranks
        Distributed context (rank, world size, device).
    state
        Counters to resume from.
    checkpoint
        Checkpoint to resume from, if any.
    callback
        Function that is called with every row of the log.
    interrupted
        Function that returns the signal that asked the run to stop; 0 for none.
    """

    def __init__(
        self,
        run: Path,
        data: TrainingData,
        method: str,
        config: CampConfig,
        ranks: DistributedContext,
        state: TrainState,
        *,
        checkpoint: Checkpoint | None = None,
        callback: Callback | None = None,
        interrupted: Callable[[], int] = lambda: 0,
    ) -> None:
        self.run, self.data, self.method, self.config = run, data, method, config
        self.ranks, self.state, self._checkpoint = ranks, state, checkpoint
        self._callback, self._interrupted = callback, interrupted
        own = ranks.share(config.ppo.num_envs, "ppo.num_envs")
        if len(own) % config.ppo.num_minibatches:
            raise UsageError(
                f"ppo.num_minibatches is {config.ppo.num_minibatches}: it must divide the "
                f"{len(own)} environments of each of {ranks.size} processes"
            )
        self.agent = make_agent(method, config)
        progress = checkpoint.progress if checkpoint else {}
        if checkpoint:
            self.agent.load_state_dict(dict(checkpoint.weights))
        self.agent.to(ranks.device)
        self._window = EpisodeWindow(config.run.window, progress.get("window", ()))
        self._log_position = int(progress.get("log", 0))
        self._log: MetricsLogger | None = None
        self._total_updates = 0
        self._lap = time.perf_counter()

    def fit(self, stages: Sequence[TrainingStage]) -> None:
        """Train to the end of the last stage.

        Raises
        ------
        InterruptedRunError
            The run was asked to stop; a checkpoint is saved.
        NotFiniteError
            NaN or infinity turned up; the last checkpoint stands.
        """
        state, board = self.state, self.config.run.tensorboard
        names = [stage.name for stage in stages]
        first = names.index(state.stage) if state.stage in names else 0
        left = sum(stage.updates for stage in stages[first:] if not stage.clones)
        done = state.done if state.stage in names and not stages[first].clones else 0
        self._total_updates = state.updates + left - done
        with ExitStack() as stack:
            if self.ranks.first:
                log = MetricsLogger(self.run, self._log_position, board=board)
                self._log = stack.enter_context(log)
            self._lap = time.perf_counter()
            for stage in stages[first:]:
                if stage.name != state.stage:
                    state.stage, state.done, self._checkpoint = stage.name, 0, None
                    self._window = EpisodeWindow(self.config.run.window)
                if state.done < stage.updates:
                    self._train(stage)

    def _train(self, stage: TrainingStage) -> None:
        """Run a stage to its end."""
        now, state, every = self.open(stage), self.state, self.config.run
        save_every = every.checkpoint_every * (_CLONING_SAVES if stage.clones else 1)
        validates = not stage.clones and not stage.tasks
        try:
            if not state.updates and not state.done:
                self.save(now)
            while state.done < stage.updates:
                self.write(self.update(now))
                last = state.done == stage.updates
                validated = validates and (last or state.done % every.validate_every == 0)
                score = self.validate() if validated else None
                signum = max(self.ranks.all_gather_items([self._interrupted()]))
                if last or signum or validated or state.done % save_every == 0:
                    self.save(now, score)
                if signum:
                    raise InterruptedRunError(f"{self.run}: {INTERRUPTED}", signum)
        finally:
            now.source.loop.env.close()

    def open(self, stage: TrainingStage) -> StageRun:
        """Open a stage's environments, new or as they were in the checkpoint."""
        sizes = self.config.cloning if stage.clones else self.config.ppo
        own = self.ranks.share(
            sizes.num_envs, "cloning.num_envs" if stage.clones else "ppo.num_envs"
        )
        env = self.data.of_stage(stage, self.config, own, self.agent.sensors)
        seed = order_seed(self.config.seed, stage.name) + own.start
        learner: Agent[Any] = self.agent
        if stage.tasks and isinstance(self.agent, Hierarchy):
            tasks = stage.tasks[own.start : own.stop]
            learner = AuxiliaryAgent(self.agent, tasks, stage.tasks)
        optimiser = torch.optim.Adam(learner.optimised(), stage.rate)
        source: Collector | Demonstrations = Collector(env, learner, seed)
        if stage.clones:
            source = Demonstrations(env, learner, experts_of(self.data.episodes()))
        if self._checkpoint is not None and self.state.done:
            tensors, progress = self._checkpoint.training, self._checkpoint.progress
            source.state, starts = unpack(tensors, optimiser, source.state, own, sizes.num_envs)
            source.restore(snapshots_of(progress, own), starts.numpy())
        else:
            if not stage.tasks:
                self.agent.synchronise()
            source.loop.reset(seed=seed)
        return StageRun(stage, learner, optimiser, source, own, seed)

    def update(self, now: StageRun) -> Row:
        """Take one update of a stage; return the row to be logged.

        Raises
        ------
        NotFiniteError
            NaN or infinity turned up: stage, update and environment are named.
        """
        try:
            if isinstance(now.source, Demonstrations):
                return self._clone(now, now.source)
            return self._learn(now, now.source)
        except NotFiniteError as error:
            raise NotFiniteError(
                f"{error} (stage {now.stage.name}, update {self.state.done}; environment k has "
                f"seed {now.seed} + k; {self.run} keeps its last checkpoint)"
            ) from error

    def _clone(self, now: StageRun, demonstrations: Demonstrations) -> Row:
        """Take one update on the experts' next steps."""
        state, stage, config = self.state, now.stage, self.config.cloning
        if state.done and state.done % (stage.updates // config.epochs) == 0:
            demonstrations.loop.reset(seed=now.seed)  # each epoch has the same frames
        rate = ppo.set_rate(now.optimiser, stage.rate, state.done / stage.updates)
        found = cloning.update(
            now.learner, now.optimiser, demonstrations, config.num_steps, self.ranks.reduce
        )
        frames = config.num_envs * config.num_steps
        state.done, state.cloned_frames = state.done + 1, state.cloned_frames + frames
        if state.done % config.sync_every == 0:
            self.agent.synchronise()
        row = {**found, "learning_rate": rate, "update": state.done, "updates": stage.updates}
        row["frames_per_s"] = rates(frames, [self.lap()] * 3)["steps_per_s"]
        return {"step": state.cloned_frames, "cloning": row}

    def _learn(self, now: StageRun, collector: Collector) -> Row:
        """Collect a rollout, and take PPO's update on it."""
        state, stage, config = self.state, now.stage, self.config.ppo
        began, collector.loop.env_s = time.perf_counter(), 0.0
        over = state.done / stage.updates
        over = stage.decay_from + (stage.decay_to - stage.decay_from) * over
        rate = ppo.set_rate(now.optimiser, stage.rate, over)
        uniforms = uniforms_of(self.config.seed, state.updates, now.own, config.num_steps)
        rollout = collector.collect(uniforms)
        collected_s = time.perf_counter() - began
        learnt = state.critics.get(stage.critic, 0)
        critic_only = learnt < config.critic_warmup_rollouts and bool(now.learner.critics())
        orders = orders_of(self.config.seed, state.updates, config.update_epochs, len(now.own))
        losses = ppo.update(
            now.learner, now.optimiser, rollout, config, orders,
            critic_only=critic_only, reduce=self.ranks.reduce,
        )  # fmt: skip
        steps = config.num_envs * config.num_steps
        state.done, state.updates = state.done + 1, state.updates + 1
        state.environment_steps += steps
        state.critics[stage.critic] = learnt + 1
        if not stage.tasks and state.done % self.config.agent.sync_every == 0:
            self.agent.synchronise()
        episodes, decisions = self._statistics(rollout, now.own)
        return {
            "step": state.environment_steps, "update": state.updates,
            "updates": self._total_updates, "stage": stage.name, "stage_update": state.done,
            "learning_rate": rate, "critic_only": int(critic_only),
            "episode": episodes, "decision": decisions, "ppo": losses,
            "time": rates(steps, (collector.loop.env_s, collected_s, self.lap())),
        }  # fmt: skip

    def _statistics(self, rollout: Rollout, own: range) -> tuple[Row, Row]:
        """Return the statistics of a rollout's episodes and decisions, across ranks."""
        ended = [(each.step, own[each.environment], each.metrics) for each in rollout.finished]
        ended = sorted(self.ranks.all_gather_items(ended), key=lambda each: each[:2])
        episodes = self._window.add([metrics for _, _, metrics in ended])
        record = rollout.batch.record.map(lambda values: self.ranks.all_gather(values, 1))
        reward = float(self.ranks.all_gather(rollout.rewards, 1).mean())
        return episodes, {"reward": reward, **record.statistics()}

    def validate(self) -> float | None:
        """Play the validation split; return the success rate, None without episodes.

        The first rank does; the others wait for it at the next sum.
        """
        if not self.ranks.first:
            return None
        means = self.data.validate(self.agent, self.method, self.config)
        if means is None:
            return None
        self.agent.train()
        row = {"step": self.state.environment_steps, "stage": self.state.stage}
        self.write({**row, "validation": means})
        return means["success"]

    def save(self, now: StageRun, score: float | None = None) -> None:
        """Write a checkpoint of a stage under way, with its validation score if it has one."""
        ranks, loop = self.ranks, now.source.loop
        memory = {name: ranks.all_gather(values) for name, values in now.source.state.items()}
        starts = ranks.all_gather(torch.from_numpy(loop.starts))
        progress = {
            **asdict(self.state),
            "environments": ranks.all_gather_items([asdict(each) for each in loop.env.state()]),
            "window": list(self._window.episodes),
            "log": self._log.position if self._log else 0,
            "dataset": self.data.fingerprint,
        }
        if not ranks.first:
            return
        best = best_score(self.run)
        better = score if score is not None and (best is None or score >= best) else None
        tensors, weights = pack(now.optimiser, memory, starts), self.agent.state_dict()
        checkpoint = Checkpoint(self.method, self.config, weights, progress, tensors)
        save(self.run, checkpoint, best=better)

    def write(self, row: Row) -> None:
        """Log a row, and pass it to the callback."""
        if self._log is not None:
            self._log.write(row)
        if self._callback is not None and self.ranks.first:
            self._callback(row)

    def lap(self) -> float:
        """Return the seconds since the last call."""
        now = time.perf_counter()
        spent, self._lap = now - self._lap, now
        self.state.training_s += spent
        return spent
