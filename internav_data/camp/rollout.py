"""What was seen, done and paid: T steps of n environments.

Generalised advantages (Schulman et al. 2016), all environments at once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.camp.agents import Batch
    from internav_data.camp.config import PPOConfig


def advantages_of(
    rewards: Tensor,
    values: Tensor,
    last_value: Tensor,
    terminated: Tensor,
    truncated: Tensor,
    final_values: Tensor,
    *,
    gamma: float,
    lam: float,
) -> Tensor:
    """Return advantages, (T, n) float32; added to values they are the returns.

    Parameters
    ----------
    rewards, values : (T, n)
        values[t] is what was expected before action t.
    last_value : (n,)
        Expected after the last row; counts nothing where an episode ended there.
    terminated, truncated : (T, n) bool
        The episode ended, or was cut off, by action t. Where both are set it ended.
    final_values : (T, n)
        Expected of what was seen after a cut, before the reset.
    gamma, lam
        Discount and decay.
    """
    over = truncated | terminated
    following = torch.cat([values[1:], last_value.unsqueeze(0)])
    following = torch.where(truncated, final_values, following).masked_fill(terminated, 0.0)
    surprises = rewards + gamma * following - values
    carries = (gamma * lam) * (~over).to(values.dtype)
    advantages, ahead = torch.empty_like(values), torch.zeros_like(last_value)
    for t in range(len(values) - 1, -1, -1):
        ahead = surprises[t] + carries[t] * ahead
        advantages[t] = ahead
    return advantages


class Columns:
    """Rows of tensors by name, in memory that is taken once.

    Parameters
    ----------
    rows
        How many there will be.
    device
        Where.
    """

    def __init__(self, rows: int, device: torch.device) -> None:
        self._rows, self._device = rows, device
        self.columns: dict[str, Tensor] = {}

    def write(self, row: int, values: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """Write (n, …) by name; return the row as it lies here."""
        for name, value in values.items():
            if name not in self.columns:
                shape = (self._rows, *value.shape)
                self.columns[name] = torch.zeros(shape, dtype=value.dtype, device=self._device)
            self.columns[name][row].copy_(value)
        return {name: self.columns[name][row] for name in values}


@dataclass(frozen=True, slots=True)
class Finished:
    """An episode that ended during a rollout."""

    environment: int
    step: int
    """Row of the rollout."""
    metrics: dict[str, Any]
    """What the environment said of it."""


@dataclass(frozen=True, slots=True)
class Rollout:
    """Steps as they were taken, and all that PPO asks of them. Tensors are (T, n)."""

    batch: Batch
    rewards: Tensor
    terminated: Tensor
    truncated: Tensor
    values: Tensor
    """Before each step."""
    log_probs: Tensor
    final_values: Tensor
    """Of what was seen after a cut, before the reset; 0 elsewhere."""
    last_value: Tensor
    """(n,): after the last step."""
    finished: list[Finished] = field(default_factory=list)
    """Episodes that ended, in the order of their ends."""

    def advantages(self, config: PPOConfig) -> Tensor:
        """Return the generalised advantages, (T, n)."""
        return advantages_of(
            self.rewards, self.values, self.last_value, self.terminated, self.truncated,
            self.final_values, gamma=config.gamma, lam=config.gae_lambda,
        )  # fmt: skip
