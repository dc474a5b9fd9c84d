"""The first stage of a run with `--init-from expert`: what the dataset's expert does is cloned."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Final

import torch

from internav_data.camp.imitation import Demonstrations, clone, experts_of
from internav_data.camp.logbook import rates
from internav_data.camp.packing import (
    unpack_environments,
    unpack_optimiser,
    unpack_random,
    unpack_state,
)
from internav_data.camp.stages import order_seed
from internav_data.records.errors import NotFiniteError

if TYPE_CHECKING:
    from internav_data.camp.agents import State
    from internav_data.camp.tasks import Task
    from internav_data.camp.train import Trainer

CLONING: Final = "cloning"
_RARELY: Final = 4
"""Updates are as much smaller than those of PPO, so checkpoints come after more of them."""


def clone_expert(trainer: Trainer) -> None:
    """Clone from where a run is to the end of cloning."""
    place, config, agent = trainer.place, trainer.config, trainer.agent
    given, reduce = config.cloning, trainer.ranks.reduce
    count = given.environments
    own, task, seen = _demonstrations(trainer)
    optimiser = torch.optim.Adam(agent.optimised(), given.learning_rate)
    state: State = agent.initial_state(len(own))
    if place.stage == CLONING and trainer.since is not None:
        unpack_optimiser(trainer.since.training, optimiser)
        state = unpack_state(trainer.since.training, state, own, count)
        states = unpack_environments(trainer.since.progress, own)
        frames = task.restore(states)
        ids = [str(said["episode_id"]) for said in states]
        seen.resume(frames, ids, [len(said["actions"]) for said in states])
        unpack_random(trainer.since.training)
    place.stage = CLONING
    held = [state]
    try:
        for said in clone(
            agent, optimiser, seen, given, order_seed(config.seed, CLONING) + own.start, reduce,
            first=place.cloned_updates, state=state, keep=lambda after: held.insert(0, after),
        ):  # fmt: skip
            del held[1:]
            place.cloned_updates += 1
            place.cloned_frames += count * given.steps
            rate = rates(count * given.steps, [trainer.lap()] * 3)["steps_per_s"]
            trainer.write({"step": place.cloned_frames, "cloning": {**said, "frames_per_s": rate}})
            stop = trainer.asked()
            last = said["update"] == said["updates"]
            due = place.cloned_updates % (_RARELY * config.run.checkpoint_every) == 0
            if stop or last or due or place.cloned_updates == 1:
                trainer.save(optimiser, task, held[0])
            trainer.stop(stop)
    except NotFiniteError as error:
        raise NotFiniteError(
            f"{error} (cloning, update {place.cloned_updates}; environment k has seed "
            f"{order_seed(config.seed, CLONING) + own.start} + k; {trainer.run} keeps its last "
            "checkpoint)"
        ) from error
    finally:
        task.close()


def forecast_cloning(trainer: Trainer, measured: int) -> tuple[int, float]:
    """Return how many updates there will be, and the seconds that one takes, from a few of them."""
    given, agent = trainer.config.cloning, trainer.agent
    _, task, seen = _demonstrations(trainer)
    optimiser = torch.optim.Adam(agent.optimised(), given.learning_rate)
    updates = clone(agent, optimiser, seen, given, order_seed(trainer.config.seed, CLONING))
    try:
        whole = int(next(updates)["updates"])  # warms up
        began, done = time.perf_counter(), 0
        for _ in zip(range(min(measured, whole - 1)), updates, strict=False):
            done += 1
        return whole, (time.perf_counter() - began) / max(done, 1)
    finally:
        task.close()


def _demonstrations(trainer: Trainer) -> tuple[range, Task, Demonstrations]:
    """Return this rank's environments, by number and opened, and experts in them."""
    config, agent = trainer.config, trainer.agent
    own = trainer.ranks.share(config.cloning.environments, "cloning.environments")
    task = trainer.data.main(config, len(own), ids=agent.wants_ids)
    return own, task, Demonstrations(task, agent, experts_of(trainer.data.episodes()))
