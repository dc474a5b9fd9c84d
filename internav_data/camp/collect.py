"""An agent lives in a batch of environments, and its steps become rollouts."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import torch
from torch import Tensor

from internav_data.camp.agents import Batch
from internav_data.camp.rollout import Columns, Finished, Rollout
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import NotFiniteError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from internav_data.camp.agents import Agent
    from internav_data.envs.slot import EpisodeSnapshot
    from internav_data.envs.types import Observations, Stepped


class Environments(Protocol):
    """A vector environment that is made with `autoreset=False`; it may overwrite observations."""

    num_envs: int

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begin everywhere, or where `options["reset_mask"]` says."""

    def step(self, actions: NDArray[np.int64]) -> Stepped:
        """Act everywhere; -1 waits."""

    def state(self) -> Sequence[EpisodeSnapshot]:
        """Return a snapshot of each environment."""

    def restore(self, states: Sequence[EpisodeSnapshot]) -> tuple[Observations, dict[str, Any]]:
        """Become the environments of snapshots."""

    def close(self) -> None:
        """End the environments' processes."""


def uniforms_of(seed: int, rollout: int, environments: Sequence[int], steps: int) -> Tensor:
    """Return the random numbers of a rollout, (T, n, 2) in [0, 1).

    Environment by environment, so that several ranks draw what one would.
    """
    drawn = [
        generator(seed, Purpose.TRAINING, k, TrainingStream.ACTIONS, draw=rollout).random(
            (steps, 2), np.float32
        )
        for k in environments
    ]
    return torch.from_numpy(np.stack(drawn, 1))


def orders_of(seed: int, rollout: int, epochs: int, count: int) -> list[list[int]]:
    """Return a permutation of the environments for each epoch of an update."""
    rng = generator(seed, Purpose.TRAINING, attempt=TrainingStream.MINIBATCHES, draw=rollout)
    return [rng.permutation(count).tolist() for _ in range(epochs)]


class Collector:
    """An agent and its environments between two rollouts.

    Parameters
    ----------
    env
        The environments; `begin` resets them.
    agent
        Who acts.
    seed
        Of environment 0, for messages.

    Attributes
    ----------
    state
        What the agent remembers.
    starts : (n,) bool
        Where an episode begins at the next step.
    env_s
        Seconds that the environments took.
    """

    def __init__(self, env: Environments, agent: Agent, seed: int = 0) -> None:
        self.env, self.agent, self._seed = env, agent, seed
        self.env_s = 0.0
        count = env.num_envs
        self.state = agent.initial_state(count)
        self.starts = torch.ones(count, dtype=torch.bool, device=agent.device)
        self._seen: Observations = {}

    def begin(self, seen: Observations) -> None:
        """Take what `env.reset` (or `restore`) returned."""
        self._seen = seen

    @torch.no_grad()
    def collect(self, uniforms: Tensor) -> Rollout:
        """Take T steps everywhere.

        Parameters
        ----------
        uniforms : (T, n, 2)
            See `uniforms_of`.

        Raises
        ------
        NotFiniteError
            An environment showed or paid what is no number.
        """
        agent, steps, device = self.agent, len(uniforms), self.agent.device
        uniforms = uniforms.to(device)
        before, finished = self.state, []
        seen_rows, record, own = (Columns(steps, device) for _ in range(3))
        for t in range(steps):
            self._check(self._seen)
            seen = seen_rows.write(t, {k: torch.from_numpy(v) for k, v in self._seen.items()})
            step = agent.act(seen, self.state, self.starts, uniforms[t])
            record.write(t, step.record)
            row = {"starts": self.starts, "values": step.value, "log_probs": step.log_prob}
            self.state = step.state
            acts, began = step.action.cpu().numpy(), time.perf_counter()
            self._seen, rewards, ended, cut, infos = self.env.step(acts)
            self.env_s += time.perf_counter() - began
            self._check({"reward": rewards})
            paid = torch.from_numpy(rewards.astype(np.float32))
            row |= {"rewards": paid, "final_values": torch.zeros_like(step.value)}
            row |= {"terminated": torch.from_numpy(ended), "truncated": torch.from_numpy(cut)}
            over = ended | cut
            if over.any():
                if (cut & ~ended).any():
                    self._check(self._seen)
                    row["final_values"] = self._expected() * torch.from_numpy(cut).to(device)
                finished += _finished(t, over, infos)
                began = time.perf_counter()
                self._seen, _ = self.env.reset(options={"reset_mask": over})
                self.env_s += time.perf_counter() - began
            self.starts = torch.from_numpy(over).to(device)
            own.write(t, row)
        columns = own.columns
        batch = Batch(seen_rows.columns, columns.pop("starts"), before, record.columns)
        return Rollout(batch, last_value=self._expected(), finished=finished, **columns)

    def _expected(self) -> Tensor:
        """Return the values of what is seen now, after what was done, (n,)."""
        seen = {name: torch.from_numpy(v).to(self.agent.device) for name, v in self._seen.items()}
        return self.agent.value(seen, self.state)

    def _check(self, arrays: Observations) -> None:
        for name, array in arrays.items():
            if array.dtype.kind != "f":
                continue
            sums = array.reshape(len(array), -1).sum(1)  # NaN and infinity outlive it
            if not np.isfinite(sums).all():
                k = int(np.flatnonzero(~np.isfinite(sums))[0])
                raise NotFiniteError(
                    f"environment {k} (seed {self._seed + k}): {name} is not finite"
                )


def _finished(t: int, over: NDArray[np.bool_], infos: dict[str, Any]) -> list[Finished]:
    said = infos.get("metrics", {})
    names = [name for name in said if not name.startswith("_")]
    everywhere = np.ones(len(over), np.bool_)
    return [
        Finished(
            k, t,
            {name: said[name][k].item() for name in names if said.get(f"_{name}", everywhere)[k]},
        )
        for k in np.flatnonzero(over).tolist()
    ]  # fmt: skip
