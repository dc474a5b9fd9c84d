"""Proximal policy optimisation (Schulman et al. 2017) of recurrent agents."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from internav_data.records.errors import NotFiniteError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from torch.nn import Parameter
    from torch.optim import Optimizer

    from internav_data.camp.agents import Agent
    from internav_data.camp.config import PPOConfig
    from internav_data.camp.rollout import Rollout

    Reduce = Callable[[Tensor], Tensor]
    """Adds a tensor over all ranks."""

_EPSILON = 1e-8


def alone(tensor: Tensor) -> Tensor:
    """Add over a single rank."""
    return tensor


def set_rate(optimiser: Optimizer, rate: float, progress: float) -> None:
    """Let a learning rate fall in a straight line; progress goes from 0 to 1."""
    for group in optimiser.param_groups:
        group["lr"] = rate * max(0.0, 1.0 - progress)


def update(
    agent: Agent,
    optimiser: Optimizer,
    rollout: Rollout,
    config: PPOConfig,
    orders: Sequence[Sequence[int]],
    *,
    critic_only: bool = False,
    reduce: Reduce = alone,
) -> dict[str, float]:
    """Learn from a rollout.

    Parameters
    ----------
    agent, optimiser
        Who learns; the optimiser holds `agent.optimised()`.
    rollout
        What it did with its present parameters.
    config
        How.
    orders
        For each epoch a permutation of the rollout's environments, cut into minibatches.
    critic_only
        Train the critic alone: it is new.
    reduce
        Adds a tensor over all ranks; each holds part of every minibatch.

    Returns
    -------
    dict
        Means over the minibatches: `policy_loss`, `value_loss`, `entropy`, `kl`, `clip_fraction`,
        `extra_loss`, `grad_norm` (before it is cut); then `ratio_error` (of the first
        minibatch: how far a ratio is from 1), `explained_variance`, `updates` (steps taken) and
        `stopped` (1 if the KL stopped them).

    Raises
    ------
    NotFiniteError
        A loss or gradient is no number: the environment is named, the step is not taken.
    """
    advantages = rollout.advantages(config)
    returns = advantages + rollout.values
    explained = explained_variance(rollout.values, returns, reduce)
    if config.normalise_advantages:
        mean, variance = moments(advantages, reduce)
        advantages = (advantages - mean) / (variance.sqrt() + _EPSILON)
    parameters = agent.critics() if critic_only else agent.optimised()
    told: list[dict[str, float]] = []
    stopped = False
    for columns in minibatches(orders, config.num_minibatches, rollout.rewards.device):
        goals = advantages[:, columns], returns[:, columns]
        losses, said = _losses(agent, rollout, columns, goals, config, reduce)
        told.append(said)
        # Stop before the step that would be taken on too distant a policy.
        limit = math.inf if critic_only or config.target_kl is None else config.target_kl
        stopped = said["kl"] > limit
        if stopped:
            break
        loss = losses["value"] if critic_only else sum(losses.values(), losses["value"] * 0.0)
        said["grad_norm"] = step(optimiser, loss, parameters, config.max_grad_norm, reduce)
    means = {name: _mean([said[name] for said in told if name in said]) for name in told[0]}
    return {
        "grad_norm": 0.0,  # where not a single step was taken
        **means,
        "ratio_error": told[0]["ratio_error"],
        "explained_variance": explained,
        "updates": float(len(told) - stopped),
        "stopped": float(stopped),
    }


def minibatches(
    orders: Sequence[Sequence[int]], count: int, device: torch.device
) -> Iterator[Tensor]:
    """Yield the environments of each minibatch of each epoch, (m,) each."""
    for order in orders:
        yield from torch.tensor(order, device=device).chunk(count)


def moments(values: Tensor, reduce: Reduce = alone) -> tuple[Tensor, Tensor]:
    """Return mean and variance over all ranks, in float32."""
    count = reduce(values.new_tensor(float(values.numel())))
    mean = reduce(values.sum()) / count
    return mean, reduce((values - mean).square().sum()) / count


def explained_variance(values: Tensor, returns: Tensor, reduce: Reduce = alone) -> float:
    """Return how much of the returns' variance the critic explains: 1 is all, 0 is none."""
    _, left = moments(returns - values, reduce)
    _, whole = moments(returns, reduce)
    return float(1.0 - left / (whole + _EPSILON))


def step(
    optimiser: Optimizer,
    loss: Tensor,
    parameters: Sequence[Parameter],
    longest: float,
    reduce: Reduce = alone,
) -> float:
    """Take one step of an optimiser; return how long the gradient was before it was cut.

    Raises
    ------
    NotFiniteError
        It is no number; the step is not taken.
    """
    gradients = torch.autograd.grad(loss, parameters, allow_unused=True)
    optimiser.zero_grad()
    for parameter, gradient in zip(parameters, gradients, strict=True):
        # Contiguous as parameters are, whatever kernels return: sums over it have one order so.
        parameter.grad = torch.zeros_like(parameter) if gradient is None else gradient.contiguous()
    if reduce is not alone:
        flat = reduce(torch.cat([p.grad.flatten() for p in parameters if p.grad is not None]))
        ends = itertools.accumulate(p.numel() for p in parameters)
        for parameter, end in zip(parameters, ends, strict=True):
            parameter.grad = flat[end - parameter.numel() : end].view_as(parameter)
    norm = float(torch.nn.utils.clip_grad_norm_(parameters, longest))
    if not math.isfinite(norm):
        optimiser.zero_grad()
        raise NotFiniteError(
            "the gradient is not finite: lower the learning rate, or resume from the last "
            "checkpoint with another seed"
        )
    optimiser.step()
    return norm


def _losses(
    agent: Agent,
    rollout: Rollout,
    columns: Tensor,
    goals: tuple[Tensor, Tensor],
    config: PPOConfig,
    reduce: Reduce,
) -> tuple[dict[str, Tensor], dict[str, float]]:
    """Return the parts of a minibatch's loss, weighted, and what is said of it."""
    advantages, returns = goals
    now = agent.evaluate(rollout.batch.of(columns))
    check_finite(columns, now.log_prob, now.value)
    log_ratio = now.log_prob - rollout.log_probs[:, columns]
    ratio = log_ratio.exp()
    clipped = ratio.clamp(1.0 - config.clip_coef, 1.0 + config.clip_coef)
    gain = torch.minimum(ratio * advantages, clipped * advantages)
    errors = (now.value - returns).square()
    if config.clip_vloss:
        before = rollout.values[:, columns]
        near = before + (now.value - before).clamp(-config.clip_coef, config.clip_coef)
        errors = torch.maximum(errors, (near - returns).square())
    extra = torch.zeros_like(gain) if now.loss is None else now.loss
    count = reduce(gain.new_tensor(float(gain.numel())))
    sums = {
        "policy": -gain.sum() / count,
        "value": config.vf_coef * 0.5 * errors.sum() / count,
        "entropy": -config.ent_coef * now.entropy.sum() / count,
        "extra": extra.sum() / count,
    }
    with torch.no_grad():
        said = {
            "policy_loss": sums["policy"],
            "value_loss": 0.5 * errors.sum() / count,
            "entropy": now.entropy.sum() / count,
            "extra_loss": sums["extra"],
            # An estimate that is never negative: http://joschu.net/blog/kl-approx.html
            "kl": (ratio - 1.0 - log_ratio).sum() / count,
            "clip_fraction": (ratio != clipped).float().sum() / count,
        }
        whole = reduce(torch.stack(list(said.values()))).tolist()
    far = float((ratio.detach() - 1.0).abs().max())
    return sums, {**dict(zip(said, whole, strict=True)), "ratio_error": far}


def check_finite(columns: Tensor, *numbers: Tensor) -> None:
    """Refuse what networks say, (T, m), of environments with these numbers, (m,).

    Raises
    ------
    NotFiniteError
        Some of it is no number: the first environment is named.
    """
    for number in numbers:
        fine = number.detach().isfinite().all(0)
        if not bool(fine.all()):
            k = int(columns[~fine][0])
            raise NotFiniteError(
                f"environment {k}: the networks' outputs are not finite; lower the learning rate, "
                "or resume from the last checkpoint with another seed"
            )


def _mean(numbers: Sequence[float]) -> float:
    return sum(numbers) / len(numbers) if numbers else 0.0
