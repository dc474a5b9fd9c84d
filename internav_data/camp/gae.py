"""Generalised advantages (Schulman et al. 2016), all environments at once."""

from __future__ import annotations

import torch
from torch import Tensor


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
