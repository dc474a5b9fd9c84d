"""The first stage of a run with `--pretrain bc`: what the dataset's expert does is cloned.

Cloning the dataset's expert: its episodes are played again and its actions made likely.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import torch

from internav_data.camp.agents import Batch
from internav_data.camp.checkpoint import (
    unpack_environments,
    unpack_optimiser,
    unpack_random,
    unpack_state,
)
from internav_data.camp.logging import rates
from internav_data.camp.ppo import alone, check_finite, step
from internav_data.camp.rollout import Columns
from internav_data.camp.stages import order_seed
from internav_data.records.errors import CorruptDataError, NotFiniteError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray
    from torch.optim import Optimizer

    from internav_data.camp.agents import Agent, State
    from internav_data.camp.collect import Environments
    from internav_data.camp.config import CloningConfig
    from internav_data.camp.ppo import Reduce
    from internav_data.camp.train import Trainer
    from internav_data.dataset import Dataset
    from internav_data.envs.types import Observations
    from internav_data.records import Episode

    Experts = Callable[[str], Sequence[int]]
    """Actions of the expert of an episode, by its id."""


LONGEST_GRADIENT = 0.5


def experts_of(dataset: Dataset[Episode]) -> Experts:
    """Return the experts of a dataset; who asks for one that is missing gets a UsageError."""
    from internav_data.envs.source import open_source  # noqa: PLC0415 - the camera's kernels

    source = open_source(dataset)

    def actions(episode_id: str) -> Sequence[int]:
        expert = source.episode(source.number_of(episode_id)).expert
        if expert is None:
            raise UsageError(
                f"episode {episode_id} has no expert to clone: generate the dataset with "
                "experts, or train without --pretrain bc"
            )
        return expert.actions

    return actions


class Demonstrations:
    """Experts play in a batch of environments, as an agent would label what they do.

    Parameters
    ----------
    env
        The environments.
    agent
        Whose labels: of options too, with hand-backs, where it has them.
    experts
        What is played, by episode.
    """

    def __init__(self, env: Environments, agent: Agent, experts: Experts) -> None:
        self.env, self._agent, self._experts = env, agent, experts
        self._labels: list[dict[str, list[int]]] = [{} for _ in range(env.num_envs)]
        self._places = [0] * env.num_envs

    def begin(self, seed: int) -> None:
        """Begin an order of episodes anew."""
        self._seen, infos = self.env.reset(seed=seed)
        self._starts = np.ones(self.env.num_envs, np.bool_)
        self._learn(infos)

    def resume(self, seen: Observations, ids: Sequence[str], places: Sequence[int]) -> None:
        """Go on in the middle: episodes `ids` are under way, `places` steps of each are taken."""
        self._seen, self._starts = seen, np.ones(self.env.num_envs, np.bool_)
        self._learn({"episode_id": np.array(ids, dtype=object)})
        for own, place in zip(self._labels, places, strict=True):
            if not place < len(own["action"]):
                raise CorruptDataError(
                    f"checkpoint: environments: {place} actions were taken, the expert has "
                    f"{len(own['action'])}"
                )
        self._places, self._starts = list(places), np.array(places) == 0

    def collect(self, steps: int, state: State) -> Batch:
        """Play so many steps, to be lived through after `state`."""
        device = self._agent.device
        seen, record, starts = (Columns(steps, device) for _ in range(3))
        for t in range(steps):
            seen.write(t, {name: torch.from_numpy(what) for name, what in self._seen.items()})
            starts.write(t, {"starts": torch.from_numpy(self._starts)})
            row = {
                name: np.array(
                    [own[name][k] for own, k in zip(self._labels, self._places, strict=True)]
                )
                for name in self._labels[0]
            }
            record.write(t, {name: torch.from_numpy(column) for name, column in row.items()})
            self._places = [place + 1 for place in self._places]
            self._seen, _, ended, cut, _ = self.env.step(row["action"])
            self._starts = ended | cut
            for k, (own, place) in enumerate(zip(self._labels, self._places, strict=True)):
                self._starts[k] |= place == len(own["action"])
            if self._starts.any():
                self._seen, infos = self.env.reset(options={"reset_mask": self._starts})
                self._learn(infos)
        return Batch(seen.columns, starts.columns["starts"], state, record.columns)

    def _learn(self, infos: dict[str, Any]) -> None:
        ids: NDArray[np.object_] = infos["episode_id"]
        for k in np.flatnonzero(self._starts).tolist():
            self._labels[k] = self._agent.labels(self._experts(str(ids[k])))
            self._places[k] = 0


def clone(
    agent: Agent,
    optimiser: Optimizer,
    demonstrations: Demonstrations,
    config: CloningConfig,
    seed: int,
    reduce: Reduce = alone,
    *,
    first: int = 0,
    state: State | None = None,
    keep: Callable[[State], object] | None = None,
) -> Iterator[dict[str, float]]:
    """Make what experts do likely; yields after each update.

    The loss is -log pi_Omega(omega*) where the agent decides, -log pi_omega(a*) everywhere. Each
    epoch plays the same frames. Hidden states go on from one update to the next, without gradient.

    Parameters
    ----------
    agent, optimiser
        Who learns; the optimiser holds `agent.optimised()`.
    demonstrations
        What from.
    config
        How.
    seed
        Of the order of episodes.
    reduce
        Adds a tensor over all ranks.
    first, state
        Updates that were done before, and the hidden states after them; `demonstrations` stand
        where they stood.
    keep
        Told the hidden states after each update.

    Yields
    ------
    dict
        `loss`, `grad_norm`, `learning_rate`, `update`, `updates` (how many there will be).
    """
    count = demonstrations.env.num_envs
    an_epoch = max(1, round(config.frames / (config.num_envs * config.num_steps)))
    updates = an_epoch * config.epochs
    state = agent.initial_state(count) if state is None else state
    for update in range(first, updates):
        if update % an_epoch == 0:
            demonstrations.begin(seed)
        rate = config.learning_rate * (1.0 - update / updates)
        for group in optimiser.param_groups:
            group["lr"] = rate
        batch = demonstrations.collect(config.num_steps, state)
        now = agent.evaluate(batch)
        frames = reduce(now.log_prob.new_tensor(float(now.log_prob.numel())))
        wrong = -now.log_prob if now.loss is None else now.loss - now.log_prob
        check_finite(torch.arange(count), wrong)
        loss = wrong.sum() / frames
        norm = step(optimiser, loss, agent.optimised(), LONGEST_GRADIENT, reduce)
        state = {name: kept.detach() for name, kept in now.state.items()}
        if (update + 1) % config.sync_every == 0:
            agent.synchronise()
        said = float(reduce(loss.detach().clone()))
        if keep is not None:
            keep(state)
        yield {
            "loss": said, "grad_norm": norm, "learning_rate": rate,
            "update": float(update + 1), "updates": float(updates),
        }  # fmt: skip


CLONING: Final = "cloning"
_RARELY: Final = 4
"""Updates are as much smaller than those of PPO, so checkpoints come after more of them."""


def clone_expert(trainer: Trainer) -> None:
    """Clone from where a run is to the end of cloning."""
    place, config, agent = trainer.place, trainer.config, trainer.agent
    given, reduce = config.cloning, trainer.ranks.reduce
    count = given.num_envs
    own, env, seen = _demonstrations(trainer)
    optimiser = torch.optim.Adam(agent.optimised(), given.learning_rate)
    state: State = agent.initial_state(len(own))
    if place.stage == CLONING and trainer.since is not None:
        unpack_optimiser(trainer.since.training, optimiser)
        state = unpack_state(trainer.since.training, state, own, count)
        states = unpack_environments(trainer.since.progress, own)
        frames, _ = env.restore(states)
        ids = [state.episode_id for state in states]
        seen.resume(frames, ids, [len(state.actions) for state in states])
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
            place.cloned_frames += count * given.num_steps
            rate = rates(count * given.num_steps, [trainer.lap()] * 3)["steps_per_s"]
            trainer.write({"step": place.cloned_frames, "cloning": {**said, "frames_per_s": rate}})
            stop = trainer.asked()
            last = said["update"] == said["updates"]
            due = place.cloned_updates % (_RARELY * config.run.checkpoint_every) == 0
            if stop or last or due or place.cloned_updates == 1:
                trainer.save(optimiser, env, held[0])
            trainer.stop(stop)
    except NotFiniteError as error:
        raise NotFiniteError(
            f"{error} (cloning, update {place.cloned_updates}; environment k has seed "
            f"{order_seed(config.seed, CLONING) + own.start} + k; {trainer.run} keeps its last "
            "checkpoint)"
        ) from error
    finally:
        env.close()


def forecast_cloning(trainer: Trainer, measured: int) -> tuple[int, float]:
    """Return how many updates there will be, and the seconds that one takes, from a few of them."""
    given, agent = trainer.config.cloning, trainer.agent
    _, env, seen = _demonstrations(trainer)
    optimiser = torch.optim.Adam(agent.optimised(), given.learning_rate)
    updates = clone(agent, optimiser, seen, given, order_seed(trainer.config.seed, CLONING))
    try:
        whole = int(next(updates)["updates"])  # warms up
        began, done = time.perf_counter(), 0
        for _ in zip(range(min(measured, whole - 1)), updates, strict=False):
            done += 1
        return whole, (time.perf_counter() - began) / max(done, 1)
    finally:
        env.close()


def _demonstrations(trainer: Trainer) -> tuple[range, Environments, Demonstrations]:
    """Return this rank's environments, by number and opened, and experts in them."""
    config, agent = trainer.config, trainer.agent
    own = trainer.ranks.share(config.cloning.num_envs, "cloning.num_envs")
    tasks = ("interactive",) * len(own)
    env = trainer.data.environments(config, tasks, agent.sensors)
    return own, env, Demonstrations(env, agent, experts_of(trainer.data.episodes()))
