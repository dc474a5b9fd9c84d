"""The loop: stages of updates, each a rollout and what is learnt from it."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Final

import torch

from internav_data.camp import ppo
from internav_data.camp.agents import Auxiliary, make_agent
from internav_data.camp.checkpoint import Checkpoint, best_score, save
from internav_data.camp.collect import Collector, orders_of, uniforms_of
from internav_data.camp.imitation import Demonstrations, clone, experts_of
from internav_data.camp.logbook import Logbook, Window, decisions, rates
from internav_data.camp.packing import (
    packed,
    unpack_optimiser,
    unpack_random,
    unpack_starts,
    unpack_state,
)
from internav_data.camp.stages import order_seed
from internav_data.camp.tasks import Timed
from internav_data.generation.interrupts import InterruptedRunError
from internav_data.records.errors import NotFiniteError

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from torch.optim import Optimizer

    from internav_data.camp.agents import Agent, State
    from internav_data.camp.config import CampConfig
    from internav_data.camp.data import TrainingData
    from internav_data.camp.logbook import Row
    from internav_data.camp.packing import Place
    from internav_data.camp.stages import Stage
    from internav_data.camp.tasks import Task

    Tell = Callable[[Row], object]

CLONING: Final = "cloning"
INTERRUPTED: Final = "saved; go on with --resume"


@dataclass(slots=True)
class Running:
    """A stage under way."""

    stage: Stage
    learner: Agent
    optimiser: Optimizer
    collector: Collector
    task: Timed


class Trainer:
    """An agent, its data, and where it is in its run.

    Parameters
    ----------
    run
        The run's folder.
    data
        Episodes.
    method, config, device
        Who learns, how, where.
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
        device: torch.device,
        place: Place,
        *,
        since: Checkpoint | None = None,
        tell: Tell | None = None,
        interrupted: Callable[[], int] = lambda: 0,
    ) -> None:
        self.run, self.data, self.method, self.config = run, data, method, config
        self.place, self._since, self._tell, self._interrupted = place, since, tell, interrupted
        self.agent = make_agent(method, config)
        said = since.progress if since else {}
        if since:
            self.agent.load_state_dict(dict(since.weights))
        self.agent.to(device)
        self._window = Window(config.run.window, said.get("window", ()))
        self._began = time.perf_counter()
        self.log: Logbook | None = None

    def fit(self, stages: list[Stage]) -> None:
        """Train to the end of the last stage.

        Raises
        ------
        InterruptedRunError
            It was asked to stop, and has saved all.
        NotFiniteError
            NaN or infinity turned up; the last checkpoint stands.
        """
        said, place, config = (self._since.progress if self._since else {}), self.place, self.config
        position, board = int(said.get("log", 0)), config.run.tensorboard
        with Logbook(self.run, position, place.environment_steps, board=board) as self.log:
            self._began = time.perf_counter()
            if place.clones and place.stage in {"", CLONING}:
                self._clone()
            names = [stage.name for stage in stages]
            first = names.index(place.stage) if place.stage in names else 0
            for stage in stages[first:]:
                if stage.name != place.stage:
                    place.stage, place.done, self._since = stage.name, 0, None
                    self._window = Window(config.run.window)
                if place.done < stage.updates:
                    self._learn(stage)

    def open(self, stage: Stage) -> Running:
        """Make a stage's environments and optimiser, as they were in the checkpoint if there is
        one."""  # noqa: D205, D209 - one sentence
        task = Timed(self.data.task(stage, self.config, ids=self.agent.wants_ids))
        learner: Agent = self.agent
        if stage.tasks:
            learner = Auxiliary(self.agent, stage.tasks)  # type: ignore[arg-type] # a Hierarchy
        optimiser = torch.optim.Adam(learner.optimised(), stage.rate)
        seed = order_seed(self.config.seed, stage.name)
        collector = Collector(task, learner, seed)
        if self._since is None or not self.place.done:
            if not stage.tasks:
                self.agent.synchronise()
            collector.begin(task.task.begin(seed))
        else:
            tensors = self._since.training
            unpack_optimiser(tensors, optimiser)
            collector.state = unpack_state(tensors, collector.state)
            collector.starts = unpack_starts(tensors, collector.starts)
            collector.begin(task.task.restore(self._since.progress.get("environments", ())))
            unpack_random(tensors)
        return Running(stage, learner, optimiser, collector, task)

    def update(self, now: Running) -> Row:
        """Take a rollout and learn from it; return what is to be logged."""
        place, config, stage = self.place, self.config.ppo, now.stage
        began, now.task.spent_s = time.perf_counter(), 0.0
        over = place.done / stage.updates
        over = stage.decay_from + (stage.decay_to - stage.decay_from) * over
        ppo.set_rate(now.optimiser, stage.rate, over)
        numbers = range(config.environments)
        uniforms = uniforms_of(self.config.seed, place.updates, numbers, config.steps)
        rollout = now.collector.collect(uniforms)
        collected = time.perf_counter() - began
        learnt = place.critics.get(stage.critic, 0)
        new = learnt < config.critic_rollouts and bool(now.learner.critics())
        orders = orders_of(self.config.seed, place.updates, config.epochs, config.environments)
        said = ppo.update(now.learner, now.optimiser, rollout, config, orders, critic_only=new)
        steps = config.environments * config.steps
        place.done, place.updates = place.done + 1, place.updates + 1
        place.environment_steps += steps
        place.critics[stage.critic] = learnt + 1
        if not stage.tasks and place.done % self.config.agent.sync_every == 0:
            self.agent.synchronise()
        self._window.add(rollout)
        spent = self._lap()
        return {
            "step": place.environment_steps, "update": place.updates, "stage": stage.name,
            "stage_update": place.done, "learning_rate": stage.rate * (1.0 - over),
            "critic_only": int(new), "episode": self._window.row(), "decision": decisions(rollout),
            "ppo": said, "time": rates(steps, (now.task.spent_s, collected, spent)),
        }  # fmt: skip

    def validate(self) -> float | None:
        """Play the validation split; return the share of successes, None without episodes."""
        found = self.data.validate(self.agent, self.method, self.config)
        if found is None:
            return None
        self.agent.train()
        row = {"step": self.place.environment_steps, "stage": self.place.stage}
        self._write({**row, "validation": found})
        return found["success"]

    def _learn(self, stage: Stage) -> None:
        now, place, every = self.open(stage), self.place, self.config.run
        try:
            if not place.updates:
                self._save(now.optimiser, now.task, now.collector)
            while place.done < stage.updates:
                self._write(self._finite(now))
                last = place.done == stage.updates
                score = None
                if not stage.tasks and (last or place.done % every.validate_every == 0):
                    score = self.validate()
                stop = self._interrupted()
                due = last or stop or place.done % every.checkpoint_every == 0
                if due or score is not None:
                    self._save(now.optimiser, now.task, now.collector, score)
                self._stop(stop)
        finally:
            now.task.task.close()

    def _finite(self, now: Running) -> Row:
        try:
            return self.update(now)
        except NotFiniteError as error:
            seed = order_seed(self.config.seed, now.stage.name)
            raise NotFiniteError(
                f"{error} (stage {now.stage.name}, update {self.place.updates}; environment k has "
                f"seed {seed} + k; {self.run} keeps its last checkpoint)"
            ) from error

    def _clone(self) -> None:
        place, given = self.place, self.config.cloning
        task = self.data.main(self.config, given.environments, ids=self.agent.wants_ids)
        optimiser = torch.optim.Adam(self.agent.optimised(), given.learning_rate)
        seen = Demonstrations(task, self.agent, experts_of(self.data.episodes()))
        kept: State = self.agent.initial_state(given.environments)
        if place.stage == CLONING and self._since is not None:
            unpack_optimiser(self._since.training, optimiser)
            kept = unpack_state(self._since.training, kept)
            states = self._since.progress.get("environments", ())
            ids = [str(state["episode_id"]) for state in states]
            seen.resume(task.restore(states), ids, [len(state["actions"]) for state in states])
        place.stage = CLONING
        held = [kept]
        try:
            for said in clone(
                self.agent, optimiser, seen, given, order_seed(self.config.seed, CLONING),
                first=place.cloned_updates, state=kept, keep=lambda state: held.insert(0, state),
            ):  # fmt: skip
                del held[1:]
                place.cloned_updates += 1
                place.cloned_frames += given.environments * given.steps
                rate = rates(given.environments * given.steps, [self._lap()] * 3)["steps_per_s"]
                self._write(
                    {"step": place.cloned_frames, "cloning": {**said, "frames_per_s": rate}}
                )
                stop = self._interrupted()
                last = said["update"] == said["updates"]
                if stop or last or place.cloned_updates % self.config.run.checkpoint_every == 0:
                    self._save(optimiser, task, held[0])
                self._stop(stop)
        finally:
            task.close()

    def _save(
        self,
        optimiser: Optimizer,
        task: Timed | Task,
        of: Collector | State,
        score: float | None = None,
    ) -> None:
        task = task.task if isinstance(task, Timed) else task
        more = (of.state, of.starts) if isinstance(of, Collector) else (of, None)
        progress = {
            **asdict(self.place), "environments": task.state(), "window": self._window.plain(),
            "log": self.log.position if self.log else 0, "dataset": self.data.fingerprint,
        }  # fmt: skip
        best = best_score(self.run)
        better = score if score is not None and (best is None or score >= best) else None
        weights = self.agent.state_dict()
        said = Checkpoint(self.method, self.config, weights, progress, packed(optimiser, *more))
        save(self.run, said, best=better)

    def _stop(self, signum: int) -> None:
        if signum:
            raise InterruptedRunError(f"{self.run}: {INTERRUPTED}", signum)

    def _write(self, row: Row) -> None:
        if self.log is not None:
            self.log.write(row)
        if self._tell is not None:
            self._tell(row)

    def _lap(self) -> float:
        """Return the seconds since the last time this was asked."""
        now = time.perf_counter()
        spent, self._began = now - self._began, now
        self.place.training_s += spent
        return spent
