"""The first stage of a run with `--init-from expert`: what the dataset's expert does is cloned."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import torch

from internav_data.camp.imitation import Demonstrations, clone, experts_of
from internav_data.camp.logbook import rates
from internav_data.camp.packing import unpack_environments, unpack_optimiser, unpack_state
from internav_data.camp.stages import order_seed

if TYPE_CHECKING:
    from internav_data.camp.agents import State
    from internav_data.camp.train import Trainer

CLONING: Final = "cloning"


def clone_expert(trainer: Trainer) -> None:
    """Clone from where a run is to the end of cloning."""
    place, config, agent = trainer.place, trainer.config, trainer.agent
    given, reduce = config.cloning, trainer.ranks.reduce
    count = given.environments
    own = trainer.ranks.share(count, "cloning.environments")
    task = trainer.data.main(config, len(own), ids=agent.wants_ids)
    optimiser = torch.optim.Adam(agent.optimised(), given.learning_rate)
    seen = Demonstrations(task, agent, experts_of(trainer.data.episodes()))
    state: State = agent.initial_state(len(own))
    if place.stage == CLONING and trainer.since is not None:
        unpack_optimiser(trainer.since.training, optimiser)
        state = unpack_state(trainer.since.training, state, own, count)
        states = unpack_environments(trainer.since.progress, own)
        ids = [str(said["episode_id"]) for said in states]
        seen.resume(task.restore(states), ids, [len(said["actions"]) for said in states])
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
            if stop or last or place.cloned_updates % config.run.checkpoint_every == 0:
                trainer.save(optimiser, task, held[0])
            trainer.stop(stop)
    finally:
        task.close()
