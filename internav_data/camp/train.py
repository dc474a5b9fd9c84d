"""Trainer: the stages of a run, update by update, with logs, validations and checkpoints."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

import torch

from internav_data.camp import cloning, ppo
from internav_data.camp.agents import agent_names, check_settings, make_agent
from internav_data.camp.agents.hierarchy import AuxiliaryAgent, Hierarchy
from internav_data.camp.agents.protocol import Agent
from internav_data.camp.checkpoint import Checkpoint, TrainState, pack, save, snapshots_of, unpack
from internav_data.camp.cloning import Demonstrations, experts_of
from internav_data.camp.config import CampConfig
from internav_data.camp.data import TrainingData
from internav_data.camp.distributed import device_of, distributed_context
from internav_data.camp.logging import EpisodeWindow, MetricsLogger, Row, rates
from internav_data.camp.rollout import Collector, Rollout, orders_of, uniforms_of
from internav_data.camp.stages import PARTS, TrainingStage, order_seed, schedule, torch_seed
from internav_data.core.interrupts import InterruptedRunError
from internav_data.envs.tasks import TASKS, InteractiveNavigation, Task
from internav_data.records.errors import NotFiniteError, UsageError

INTERRUPTED: Final = "saved; go on with --resume"
_CLONING_EPS: Final = 1e-8
"""Adam's epsilon in cloning."""
_MAX_RATIO_ERROR: Final = {"cpu": 1e-3, "cuda": 0.1}
"""Greatest distance from 1 of a replayed ratio, by kind of device. On a CPU 1e-5 is usual. Of
a trained agent, encoders in bfloat16 were off by 0.014 at most, replays from wrong memory by 0.7
and more (docs/decisions.md): the limit is their geometric mean."""
_CLONING_SAVES: Final = 4
"""Factor between checkpoints of cloning and of PPO, as its updates are smaller."""


@dataclass(frozen=True, slots=True)
class Request:
    """Arguments of a run."""

    dataset: Path
    out: Path
    """The run's folder."""
    method: str = "camp"
    config: CampConfig = field(default_factory=CampConfig)
    parts: tuple[str, ...] = PARTS
    """Stages after cloning; none for cloning alone."""
    clones: bool = False
    """Whether the dataset's experts are cloned first."""
    device: str = "auto"
    task: type[Task] = InteractiveNavigation
    """Main task: reward, end and metrics of training episodes; validation keeps the paper's."""
    callback: Callable[[Row], object] = lambda _: None
    """Function that the first rank calls with every row of the log."""
    interrupted: Callable[[], int] = lambda: 0
    """Function that returns the signal that asked the run to stop; 0 for none."""


@dataclass(frozen=True, slots=True)
class StageRun:
    """A stage under way."""

    stage: TrainingStage
    learner: Agent[Any]
    """Agent that the stage trains."""
    optimiser: torch.optim.Optimizer
    source: Collector | Demonstrations
    """Environments in which it acts, or in which experts act for it."""
    local: range
    """Numbers of this rank's environments."""
    seed: int
    """Seed of the first of them."""


class Trainer:
    """An agent, its data, and the counters of its run.

    Parameters
    ----------
    request
        Arguments of the run.
    state
        Counters to resume from.
    checkpoint
        Checkpoint to resume from, if any.

    Raises
    ------
    UsageError
        A setting is out of its bounds, settings contradict each other, or the dataset has no such
        episodes.
    """

    def __init__(
        self, request: Request, state: TrainState, checkpoint: Checkpoint | None = None
    ) -> None:
        self.run, self.method, self.config = request.out, request.method, request.config
        self._request, self.state, self._checkpoint = request, state, checkpoint
        config = request.config
        config.check()  # it may be made by hand, and no checkpoint of it could be read
        torch.set_num_threads(config.run.threads)
        self.data = TrainingData(
            request.dataset, config.data.filter, config.cloning.expert, request.task
        )
        if checkpoint is None:
            check_settings(self.method, config)
        if TASKS.get(request.task.name, request.task) is not request.task:
            raise UsageError(
                f"task {request.task.__name__}: its name {request.task.name!r} is another task's; "
                "give it a `name` of its own"
            )
        self.agent = make_agent(self.method, config)
        self.stages = self._schedule()
        for stage in self.stages:
            self.data.episodes_of(stage)  # refuses a dataset without any
        self.ranks = distributed_context(device_of(request.device))
        local = self.ranks.share(config.ppo.num_envs, "ppo.num_envs")
        if len(local) % config.ppo.num_minibatches:
            raise UsageError(
                f"ppo.num_minibatches is {config.ppo.num_minibatches}: it must divide the "
                f"{len(local)} environments of each of {self.ranks.size} processes"
            )
        if checkpoint:
            self.agent.load_state_dict(dict(checkpoint.weights))
        self.agent.to(self.ranks.device)
        self._window = EpisodeWindow(config.run.window, state.window)
        self._log: MetricsLogger | None = None
        self._total_updates = 0
        self._lap = time.perf_counter()

    def _schedule(self) -> list[TrainingStage]:
        """Return the stages that the run has before it, the present one first.

        Raises
        ------
        UsageError
            There is nothing to learn, or the stages cannot be run in this order.
        """
        state, config = self.state, self.config
        if not self.agent.optimised():
            others = ", ".join(name for name in agent_names() if name != self.method)
            raise UsageError(
                f"method {self.method!r} has nothing to learn; expected one of {others}"
            )
        if not state.parts and not state.clones:
            raise UsageError("--stages cloning: there is nothing to clone without --pretrain bc")
        if state.clones and config.agent.forbidden:
            raise UsageError(
                "agent.forbidden and --pretrain bc: the expert does what is forbidden; leave one "
                "of them out"
            )
        hierarchical = isinstance(self.agent, Hierarchy)
        stages = schedule(config, state.parts, hierarchical=hierarchical, clones=state.clones)
        names = [stage.name for stage in stages]
        if state.stage in names:
            return stages[names.index(state.stage) :]
        known = schedule(config, PARTS, hierarchical=hierarchical)
        if any(stage.name == state.stage and state.done < stage.updates for stage in known):
            part = state.stage.split("-")[0]
            raise UsageError(
                f"{self.run}: stage {state.stage} is not finished: go on with it first "
                f"(--stages {part},…)"
            )
        return [stage for stage in stages if not stage.clones or not state.stage]

    def fit(self) -> None:
        """Train to the end of the last stage.

        Raises
        ------
        InterruptedRunError
            The run was asked to stop; a checkpoint is saved.
        NotFiniteError
            NaN or infinity turned up; the last checkpoint stands.
        """
        state, every = self.state, self.config.run
        self._total_updates = state.updates + sum(
            stage.updates - (state.done if stage.name == state.stage else 0)
            for stage in self.stages
            if not stage.clones
        )
        log: AbstractContextManager[MetricsLogger | None] = nullcontext()
        if self.ranks.first:
            log = MetricsLogger(self.run, state.log, board=every.tensorboard)
        with log as self._log:
            self._lap = time.perf_counter()
            for stage in self.stages:
                if stage.name != state.stage:
                    state.stage, state.done, self._checkpoint = stage.name, 0, None
                    self._window = EpisodeWindow(every.window)
                if state.done < stage.updates:
                    self._train(stage)

    def _train(self, stage: TrainingStage) -> None:
        """Run a stage to its end."""
        now, state, every = self.open(stage), self.state, self.config.run
        save_every = every.checkpoint_every * (_CLONING_SAVES if stage.clones else 1)
        validates = not stage.clones and not stage.tasks
        with closing(now.source.loop.env):
            if not state.updates and not state.done:
                self.save(now)
            while state.done < stage.updates:
                self.write(self.update(now))
                last = state.done == stage.updates
                due = every.validate_every and state.done % every.validate_every == 0
                validated = bool(validates and (last or due))
                score = self.validate() if validated else None
                signum = max(self.ranks.all_gather_items([self._request.interrupted()]))
                if last or signum or validated or state.done % save_every == 0:
                    self.save(now, score)
                if signum:
                    raise InterruptedRunError(f"{self.run}: {INTERRUPTED}", signum)

    def open(self, stage: TrainingStage) -> StageRun:
        """Open a stage's environments, new or as they were in the checkpoint."""
        section = "cloning" if stage.clones else "ppo"
        count: int = getattr(self.config, section).num_envs
        local = self.ranks.share(count, f"{section}.num_envs")
        env = self.data.environments(stage, self.config, local, self.agent.sensors)
        seed = order_seed(self.config.seed, stage.name) + local.start
        learner: Agent[Any] = self.agent
        if stage.tasks and isinstance(self.agent, Hierarchy):
            tasks = stage.tasks[local.start : local.stop]
            learner = AuxiliaryAgent(self.agent, tasks, stage.tasks)
        eps = _CLONING_EPS if stage.clones else self.config.ppo.adam_eps
        optimiser = torch.optim.Adam(learner.optimised(), stage.rate, eps=eps, fused=True)
        source: Collector | Demonstrations = Collector(env, learner, seed, overwrites=True)
        if stage.clones:
            source = Demonstrations(
                env, learner, experts_of(self.data.demonstrated, self.config.cloning.expert)
            )
        if self._checkpoint is not None and self.state.done:
            saved = self._checkpoint
            source.state, begun = unpack(saved.training, optimiser, source.state, local, count)
            source.restore(snapshots_of(saved.progress, local), begun.numpy())
        else:
            if not stage.tasks:
                self.agent.synchronise()
            source.loop.reset(seed=seed)
        return StageRun(stage, learner, optimiser, source, local, seed)

    def update(self, now: StageRun) -> Row:
        """Take one update of a stage; return the row to be logged.

        Raises
        ------
        NotFiniteError
            NaN or infinity turned up: stage, update and environment are named.
        """
        # Nothing here draws from torch's own generator, but a user's agent may.
        torch.manual_seed(torch_seed(self.config.seed, now.stage.name, self.state.done))
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
        epoch = 1 + state.done * config.epochs // stage.updates
        state.done, state.cloned_frames = state.done + 1, state.cloned_frames + frames
        if state.done % config.sync_every == 0:
            self.agent.synchronise()
        row = {**found, "learning_rate": rate, "update": state.done, "updates": stage.updates}
        row |= {"epoch": epoch, "epochs": config.epochs}
        row["without_expert"] = self.data.without_expert
        row["frames_per_s"] = rates(frames, [self.lap()] * 3)["steps_per_s"]
        return {"step": state.cloned_frames, "cloning": row}

    def _learn(self, now: StageRun, collector: Collector) -> Row:
        """Collect a rollout, and take PPO's update on it."""
        state, stage, config = self.state, now.stage, self.config.ppo
        began, collector.loop.env_s = time.perf_counter(), 0.0
        decay = stage.decay_from + (stage.decay_to - stage.decay_from) * (
            state.done / stage.updates
        )
        rate = ppo.set_rate(now.optimiser, stage.rate, decay)
        uniforms = uniforms_of(self.config.seed, state.updates, now.local, config.num_steps)
        pushes = collector.loop.env.solver_counts()
        rollout = collector.collect(uniforms, config.chunk_steps)
        new_pushes = collector.loop.env.solver_counts().new_share(since=pushes)
        collected_s = time.perf_counter() - began
        learnt = state.critics.get(stage.critic, 0)
        critic_only = learnt < config.critic_warmup_rollouts and bool(now.learner.critics())
        orders = orders_of(self.config.seed, state.updates, config.update_epochs, len(now.local))
        losses = ppo.update(
            now.learner, now.optimiser, rollout, config, orders,
            critic_only=critic_only, reduce=self.ranks.reduce,
        )  # fmt: skip
        self._check_replay(losses["ratio_error"])
        steps = config.num_envs * config.num_steps
        state.done, state.updates = state.done + 1, state.updates + 1
        state.environment_steps += steps
        state.critics = {**state.critics, stage.critic: learnt + 1}
        if not stage.tasks and state.done % self.config.agent.sync_every == 0:
            self.agent.synchronise()
        episodes, decisions = self._statistics(rollout, now.local)
        return {
            "step": state.environment_steps, "update": state.updates,
            "updates": self._total_updates, "stage": stage.name, "stage_update": state.done,
            "learning_rate": rate, "critic_only": int(critic_only),
            "episode": episodes, "decision": decisions, "ppo": losses,
            "time": {
                **rates(steps, (collector.loop.env_s, collected_s, self.lap())),
                "new_push_share": round(new_pushes, 4),
            },
        }  # fmt: skip

    def _check_replay(self, ratio_error: float) -> None:
        """Check that an agent's `evaluate` finds the probabilities of what its `act` did.

        Only in an update's first minibatch, before which no parameter has changed.

        Raises
        ------
        UsageError
            A ratio of the first minibatch is not 1.
        """
        limit = _MAX_RATIO_ERROR[self.ranks.device.type]
        if not ratio_error <= limit:
            raise UsageError(
                f"method {self.method!r}: replayed before any step is taken, an action's "
                f"probability ratio differs from 1 by {ratio_error:.2g}, expected {limit} at most: "
                "let its evaluate() compute what act() drew from, with the same memory"
            )

    def _statistics(self, rollout: Rollout, local: range) -> tuple[Row, Row]:
        """Return the statistics of a rollout's episodes and decisions, across ranks."""
        ended = [(each.step, local[each.environment], each.metrics) for each in rollout.finished]
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
        episode_starts = ranks.all_gather(torch.from_numpy(loop.episode_starts))
        self.state.window = tuple(self._window.episodes)
        self.state.log = self._log.position if self._log else 0
        progress = {
            **asdict(self.state),
            "environments": ranks.all_gather_items([asdict(each) for each in loop.env.state()]),
            "dataset": self.data.fingerprint,
            "task": self._request.task.name,
        }
        if not ranks.first:
            return
        tensors, weights = pack(now.optimiser, memory, episode_starts), self.agent.state_dict()
        checkpoint = Checkpoint(self.method, self.config, weights, progress, tensors)
        save(self.run, checkpoint, score=score)

    def write(self, row: Row) -> None:
        """Log a row, and pass it to the callback."""
        if self._log is not None:
            self._log.write(row)
            self._request.callback(row)

    def lap(self) -> float:
        """Return the seconds since the last call."""
        now = time.perf_counter()
        spent, self._lap = now - self._lap, now
        self.state.training_s += spent
        return spent
