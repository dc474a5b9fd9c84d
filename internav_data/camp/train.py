"""The loop: stages of updates, each a rollout and what is learnt from it."""

from __future__ import annotations

import time
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Final

import torch

from internav_data.camp import ppo
from internav_data.camp.agents import Auxiliary, make_agent
from internav_data.camp.checkpoint import (
    Checkpoint,
    best_score,
    packed,
    save,
    unpack_environments,
    unpack_optimiser,
    unpack_random,
    unpack_starts,
    unpack_state,
)
from internav_data.camp.cloning import CLONING, clone_expert
from internav_data.camp.collect import Collector, orders_of, uniforms_of
from internav_data.camp.logging import EpisodeWindow, MetricsLogger, rates
from internav_data.camp.stages import order_seed
from internav_data.core.interrupts import InterruptedRunError
from internav_data.records.errors import NotFiniteError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from torch.optim import Optimizer

    from internav_data.camp.agents import Agent, State
    from internav_data.camp.checkpoint import TrainState
    from internav_data.camp.collect import Environments
    from internav_data.camp.config import CampConfig
    from internav_data.camp.data import TrainingData
    from internav_data.camp.distributed import DistributedContext
    from internav_data.camp.logging import Row
    from internav_data.camp.stages import TrainingStage

    Tell = Callable[[Row], object]

INTERRUPTED: Final = "saved; go on with --resume"


@dataclass(slots=True)
class Running:
    """A stage under way."""

    stage: TrainingStage
    learner: Agent
    optimiser: Optimizer
    collector: Collector
    env: Environments


class Trainer:
    """An agent, its data, and where it is in its run.

    Parameters
    ----------
    run
        The run's folder.
    data
        Episodes.
    method, config
        Who learns, and how.
    ranks
        Who learns beside this process; their device.
    place
        Where it is.
    since
        The checkpoint that it goes on from.
    tell
        Called with every row of the log.
    interrupted
        Asked after each update whether to save and stop.
    """

    def __init__(
        self,
        run: Path,
        data: TrainingData,
        method: str,
        config: CampConfig,
        ranks: DistributedContext,
        place: TrainState,
        *,
        since: Checkpoint | None = None,
        tell: Tell | None = None,
        interrupted: Callable[[], int] = lambda: 0,
    ) -> None:
        self.run, self.data, self.method, self.config = run, data, method, config
        self.place, self.since, self._tell, self._interrupted = place, since, tell, interrupted
        self.ranks, self._count = ranks, config.ppo.num_envs
        self.own = ranks.share(self._count, "ppo.num_envs")
        if len(self.own) % config.ppo.num_minibatches:
            raise UsageError(
                f"ppo.num_minibatches is {config.ppo.num_minibatches}: it must divide the "
                f"{len(self.own)} environments of each of {ranks.size} processes"
            )
        self.agent = make_agent(method, config)
        said = since.progress if since else {}
        if since:
            self.agent.load_state_dict(dict(since.weights))
        self.agent.to(ranks.device)
        self._window = EpisodeWindow(config.run.window, said.get("window", ()))
        self._began = time.perf_counter()
        self._updates = 0
        self.log: MetricsLogger | None = None

    def fit(self, stages: list[TrainingStage]) -> None:
        """Train to the end of the last stage.

        Raises
        ------
        InterruptedRunError
            It was asked to stop, and has saved all.
        NotFiniteError
            NaN or infinity turned up; the last checkpoint stands.
        """
        said, place, config = (self.since.progress if self.since else {}), self.place, self.config
        position, board = int(said.get("log", 0)), config.run.tensorboard
        with ExitStack() as kept:
            if self.ranks.first:
                book = MetricsLogger(self.run, position, board=board)
                self.log = kept.enter_context(book)
            self._began = time.perf_counter()
            if place.clones and place.stage in {"", CLONING}:
                clone_expert(self)
            names = [stage.name for stage in stages]
            first = names.index(place.stage) if place.stage in names else 0
            left = sum(stage.updates for stage in stages[first:])
            self._updates = place.updates + left - (place.done if place.stage in names else 0)
            for stage in stages[first:]:
                if stage.name != place.stage:
                    place.stage, place.done, self.since = stage.name, 0, None
                    self._window = EpisodeWindow(config.run.window)
                if place.done < stage.updates:
                    self._learn(stage)

    def open(self, stage: TrainingStage) -> Running:
        """Make a stage's environments and optimiser, as they were in the checkpoint if there is
        one."""  # noqa: D205, D209 - one sentence
        own = self.own
        env = self.data.of_stage(stage, self.config, own, self.agent.sensors)
        learner: Agent = self.agent
        if stage.tasks:
            tasks = stage.tasks[own.start : own.stop]
            learner = Auxiliary(self.agent, tasks, stage.tasks)  # type: ignore[arg-type] # `plan`
        optimiser = torch.optim.Adam(learner.optimised(), stage.rate)
        seed = order_seed(self.config.seed, stage.name) + own.start
        collector = Collector(env, learner, seed)
        if self.since is None or not self.place.done:
            if not stage.tasks:
                self.agent.synchronise()
            collector.begin(env.reset(seed=seed)[0])
        else:
            tensors, count = self.since.training, self._count
            unpack_optimiser(tensors, optimiser)
            collector.state = unpack_state(tensors, collector.state, own, count)
            collector.starts = unpack_starts(tensors, collector.starts, own, count)
            collector.begin(env.restore(unpack_environments(self.since.progress, own))[0])
            unpack_random(tensors)
        return Running(stage, learner, optimiser, collector, env)

    def update(self, now: Running) -> Row:
        """Take a rollout and learn from it; return what is to be logged."""
        place, config, stage = self.place, self.config.ppo, now.stage
        began, now.collector.env_s = time.perf_counter(), 0.0
        over = place.done / stage.updates
        over = stage.decay_from + (stage.decay_to - stage.decay_from) * over
        ppo.set_rate(now.optimiser, stage.rate, over)
        uniforms = uniforms_of(self.config.seed, place.updates, self.own, config.num_steps)
        rollout = now.collector.collect(uniforms)
        collected = time.perf_counter() - began
        learnt = place.critics.get(stage.critic, 0)
        new = learnt < config.critic_warmup_rollouts and bool(now.learner.critics())
        orders = orders_of(self.config.seed, place.updates, config.update_epochs, len(self.own))
        said = ppo.update(
            now.learner, now.optimiser, rollout, config, orders,
            critic_only=new, reduce=self.ranks.reduce,
        )  # fmt: skip
        steps = config.num_envs * config.num_steps
        place.done, place.updates = place.done + 1, place.updates + 1
        place.environment_steps += steps
        place.critics[stage.critic] = learnt + 1
        if not stage.tasks and place.done % self.config.agent.sync_every == 0:
            self.agent.synchronise()
        decided = self._window.noted(rollout, self.own, self.ranks)
        spent = self.lap()
        return {
            "step": place.environment_steps, "update": place.updates, "updates": self._updates,
            "stage": stage.name, "stage_update": place.done,
            "learning_rate": stage.rate * (1.0 - over), "critic_only": int(new),
            "episode": self._window.row(), "decision": decided, "ppo": said,
            "time": rates(steps, (now.collector.env_s, collected, spent)),
        }  # fmt: skip

    def validate(self) -> float | None:
        """Play the validation split; return the share of successes, None without episodes.

        The first rank does; the others wait for it at the next sum.
        """
        if not self.ranks.first:
            return None
        found = self.data.validate(self.agent, self.method, self.config)
        if found is None:
            return None
        self.agent.train()
        row = {"step": self.place.environment_steps, "stage": self.place.stage}
        self.write({**row, "validation": found})
        return found["success"]

    def _learn(self, stage: TrainingStage) -> None:
        now, place, every = self.open(stage), self.place, self.config.run
        try:
            if not place.updates:
                self.save(now.optimiser, now.env, now.collector)
            while place.done < stage.updates:
                self.write(self._finite(now))
                last = place.done == stage.updates
                judged = not stage.tasks and (last or place.done % every.validate_every == 0)
                score = self.validate() if judged else None
                stop = self.asked()
                if last or stop or judged or place.done % every.checkpoint_every == 0:
                    self.save(now.optimiser, now.env, now.collector, score)
                self.stop(stop)
        finally:
            now.env.close()

    def _finite(self, now: Running) -> Row:
        try:
            return self.update(now)
        except NotFiniteError as error:
            seed = order_seed(self.config.seed, now.stage.name) + self.own.start
            raise NotFiniteError(
                f"{error} (stage {now.stage.name}, update {self.place.updates}; environment k has "
                f"seed {seed} + k; {self.run} keeps its last checkpoint)"
            ) from error

    def save(
        self,
        optimiser: Optimizer,
        env: Environments,
        of: Collector | State,
        score: float | None = None,
    ) -> None:
        """Write a checkpoint: of a stage under way, or of cloning (`of` are its hidden states).

        `score` says how good a validation has found it.
        """
        ranks = self.ranks
        state, starts = (of.state, of.starts) if isinstance(of, Collector) else (of, None)
        state = {name: ranks.joined(kept) for name, kept in state.items()}
        starts = None if starts is None else ranks.joined(starts)
        progress = {
            **asdict(self.place),
            "environments": ranks.listed([asdict(state) for state in env.state()]),
            "window": self._window.plain(), "log": self.log.position if self.log else 0,
            "dataset": self.data.fingerprint,
        }  # fmt: skip
        if not ranks.first:
            return
        best = best_score(self.run)
        better = score if score is not None and (best is None or score >= best) else None
        tensors, weights = packed(optimiser, state, starts), self.agent.state_dict()
        save(
            self.run, Checkpoint(self.method, self.config, weights, progress, tensors), best=better
        )

    def asked(self) -> int:
        """Return the signal that asked any rank to stop, 0 for none."""
        return self.ranks.most(self._interrupted())

    def stop(self, signum: int) -> None:
        """End the run if it was asked to by a signal, 0 for none; all is saved."""
        if signum:
            raise InterruptedRunError(f"{self.run}: {INTERRUPTED}", signum)

    def write(self, row: Row) -> None:
        """Append to the log, and tell."""
        if self.log is not None:
            self.log.write(row)
        if self._tell is not None and self.ranks.first:
            self._tell(row)

    def lap(self) -> float:
        """Return the seconds since the last time this was asked."""
        now = time.perf_counter()
        spent, self._began = now - self._began, now
        self.place.training_s += spent
        return spent
