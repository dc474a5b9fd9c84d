"""Proximal policy optimisation (Schulman et al. 2017) of recurrent agents.

Shapes: T steps, n environments, m of them in a minibatch. Minibatches are of whole environments.
GRUs run over a rollout's steps in order, or over chunks of them side by side: gradients end at the
first step of a chunk, whose hidden state is that of the collection.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import torch
from torch import Tensor, nn

from internav_data.camp.agents.protocol import Agent, Batch, Evaluated
from internav_data.camp.config import PPOConfig
from internav_data.camp.networks import ValueHead
from internav_data.camp.rollout import Rollout
from internav_data.records.errors import NotFiniteError

Reduce = Callable[[Tensor], Tensor]
"""All-reduce sum of a tensor across ranks."""

_EPSILON = 1e-8


def alone(tensor: Tensor) -> Tensor:
    """Return a tensor of any shape as it is: the sum across a single rank."""
    return tensor


def set_rate(optimiser: torch.optim.Optimizer, rate: float, progress: float) -> float:
    """Decay a learning rate linearly, progress from 0 to 1; return the rate that was set."""
    decayed = rate * max(0.0, 1.0 - progress)
    for group in optimiser.param_groups:
        group["lr"] = decayed
    return decayed


def update(
    agent: Agent[Any],
    optimiser: torch.optim.Optimizer,
    rollout: Rollout,
    config: PPOConfig,
    orders: Sequence[Sequence[int]],
    *,
    critic_only: bool = False,
    reduce: Reduce = alone,
) -> dict[str, float]:
    """Update an agent on a rollout.

    Parameters
    ----------
    agent, optimiser
        Agent to update and its optimiser (must hold `agent.optimised()`).
    rollout
        Rollout that the agent collected with its present parameters.
    config
        PPO hyperparameters.
    orders
        Permutation of the rollout's environments for each epoch, cut into minibatches.
    critic_only
        Train the critic alone: it is new. A linear one is fitted to the returns first.
    reduce
        All-reduce sum across ranks, each of which has part of every minibatch.

    Returns
    -------
    dict
        Means over the minibatches: `policy_loss`, `value_loss`, `entropy`, `kl`, `clip_fraction`,
        `extra_loss`, `grad_norm` (before it is clipped); then `ratio_error` (of the first
        minibatch: the greatest distance of a ratio from 1), `explained_variance`, `updates` (steps
        taken) and `stopped` (1 if the KL divergence stopped them).

    Raises
    ------
    NotFiniteError
        A loss or gradient is NaN or infinite: the environment is named, the step is not taken.
    """
    advantages = rollout.advantages(config)
    returns = advantages + rollout.values
    explained = explained_variance(rollout.values, returns, reduce)
    scale = value_scale(agent) if config.scale_values else 1.0
    if config.normalise_advantages:
        mean, variance = moments(advantages, reduce)
        advantages = (advantages - mean) / (variance.sqrt() + _EPSILON)
    parameters = agent.optimised()
    if critic_only:
        parameters = [each for critic in agent.critics() for each in critic.parameters()]
        fit_critic(agent, rollout.batch, returns, reduce)
    limit = math.inf if critic_only or config.target_kl is None else config.target_kl
    rows: list[dict[str, float]] = []
    stopped, device = False, rollout.rewards.device
    permuted = [torch.tensor(order, device=device) for order in orders]
    ranks = reduce(torch.ones((), device=device))
    for environments in (part for each in permuted for part in each.chunk(config.num_minibatches)):
        targets = advantages[:, environments], returns[:, environments]
        losses, row = _losses(agent, rollout, environments, targets, config, reduce, ranks)
        rows.append(row)
        # Stop before the step that would leave the rollout's policy too far behind.
        stopped = row["kl"] > limit
        if stopped:
            break
        loss = config.vf_coef * losses["value_loss"] / scale**2
        if not critic_only:
            loss = loss + _policy_objective(losses, config)
        row["grad_norm"] = step(optimiser, loss, parameters, config.max_grad_norm, reduce)
    if config.scale_values:
        rescale_critics(agent, returns, reduce)
    # Gradients: none where not a single step was taken.
    norms = [row.pop("grad_norm") for row in rows if "grad_norm" in row]
    means = {name: sum(row[name] for row in rows) / len(rows) for name in rows[0]}
    return {
        **means,
        "grad_norm": sum(norms) / max(len(norms), 1),
        "ratio_error": rows[0]["ratio_error"],
        "explained_variance": explained,
        "updates": float(len(norms)),
        "stopped": float(stopped),
    }


def value_scale(agent: Agent[Any]) -> float:
    """Return the deviation of returns that an agent's critics measure values in; 1 for none."""
    scales = [float(c.scale) for c in agent.critics() if isinstance(c, ValueHead)]
    return scales[0] if scales else 1.0


def rescale_critics(agent: Agent[Any], returns: Tensor, reduce: Reduce = alone) -> None:
    """Adapt the scale of an agent's critics to the deviation of returns (T, n)."""
    _, variance = moments(returns, reduce)
    for critic in agent.critics():
        if isinstance(critic, ValueHead):
            critic.note_returns(variance)


@torch.no_grad()
def fit_critic(
    agent: Agent[Any], batch: Batch[Any], returns: Tensor, reduce: Reduce = alone
) -> None:
    """Fit an agent's critic to the returns (T, n) of a batch, where it is a single linear one.

    Gradient steps on a last layer alone hardly move it.
    """
    match agent.critics():
        case [ValueHead() as critic]:
            found = agent.evaluate(batch)
            check_finite(torch.arange(returns.shape[1]), found.value)
            if found.critic_inputs is not None:
                critic.fit(found.critic_inputs, returns, reduce)


def moments(values: Tensor, reduce: Reduce = alone) -> tuple[Tensor, Tensor]:
    """Return mean and variance of values (T, n) across ranks, float32."""
    count, total = reduce(torch.stack([values.new_tensor(float(values.numel())), values.sum()]))
    mean = total / count
    return mean, reduce((values - mean).square().sum()) / count


def explained_variance(values: Tensor, returns: Tensor, reduce: Reduce = alone) -> float:
    """Return the share of the variance of returns (T, n) that values (T, n) explain; 1 is all."""
    _, residual = moments(returns - values, reduce)
    _, total = moments(returns, reduce)
    return float(1.0 - residual / (total + _EPSILON))


def step(
    optimiser: torch.optim.Optimizer,
    loss: Tensor,
    parameters: Sequence[nn.Parameter],
    max_grad_norm: float,
    reduce: Reduce = alone,
) -> float:
    """Take one step of an optimiser on a scalar loss; return the gradient's norm before clipping.

    Raises
    ------
    NotFiniteError
        The gradient is NaN or infinite; the step is not taken.
    """
    gradients = torch.autograd.grad(loss, parameters, allow_unused=True)
    optimiser.zero_grad()
    for parameter, gradient in zip(parameters, gradients, strict=True):
        # Contiguous, as parameters are, whatever kernels return: so sums over it have one order.
        parameter.grad = torch.zeros_like(parameter) if gradient is None else gradient.contiguous()
    if reduce is not alone:
        flat = reduce(torch.cat([p.grad.flatten() for p in parameters if p.grad is not None]))
        ends = itertools.accumulate(p.numel() for p in parameters)
        for parameter, end in zip(parameters, ends, strict=True):
            parameter.grad = flat[end - parameter.numel() : end].view_as(parameter)
    norm = float(torch.nn.utils.clip_grad_norm_(parameters, max_grad_norm))
    if not math.isfinite(norm):
        optimiser.zero_grad()
        raise NotFiniteError(
            "the gradient is not finite: lower the learning rate, or resume from the last "
            "checkpoint with another seed"
        )
    optimiser.step()
    return norm


def replayed(agent: Agent[Any], rollout: Rollout, environments: Tensor) -> Evaluated:
    """Run an agent over the steps of environments (m,), chunk by chunk; outputs are (T, m)."""
    found = agent.evaluate(rollout.batch.chunked(environments, rollout.states))

    def in_order(values: Tensor) -> Tensor:
        chunks = values.reshape(len(values), -1, len(environments))  # (T / C, C, m)
        return chunks.transpose(0, 1).flatten(0, 1)

    return replace(
        found,
        log_prob=in_order(found.log_prob),
        value=in_order(found.value),
        entropy=in_order(found.entropy),
        loss=None if found.loss is None else in_order(found.loss),
    )


def _losses(
    agent: Agent[Any],
    rollout: Rollout,
    environments: Tensor,
    estimates: tuple[Tensor, Tensor],
    config: PPOConfig,
    reduce: Reduce,
    ranks: Tensor,
) -> tuple[dict[str, Tensor], dict[str, float]]:
    """Return the means of a minibatch, with gradients, and as they are logged, across ranks.

    `environments` (m,) holds their numbers, `estimates` their advantages and returns, (T, m) each.
    """
    advantages, returns = estimates
    now = replayed(agent, rollout, environments)
    check_finite(environments, now.log_prob, now.value)
    log_ratio = now.log_prob - rollout.log_probs[:, environments]
    ratio = log_ratio.exp()
    clipped = ratio.clamp(1.0 - config.clip_coef, 1.0 + config.clip_coef)
    gain = torch.minimum(ratio * advantages, clipped * advantages)
    errors = (now.value - returns).square()
    if config.clip_vloss:
        before = rollout.values[:, environments]
        near = before + (now.value - before).clamp(-config.clip_coef, config.clip_coef)
        errors = torch.maximum(errors, (near - returns).square())
    extra = torch.zeros_like(gain) if now.loss is None else now.loss
    count = gain.numel() * ranks
    losses = {
        "policy_loss": -gain.sum() / count,
        "value_loss": 0.5 * errors.sum() / count,
        "entropy": now.entropy.sum() / count,
        "extra_loss": extra.sum() / count,
        # An estimate that is never negative: http://joschu.net/blog/kl-approx.html
        "kl": (ratio - 1.0 - log_ratio).sum() / count,
        "clip_fraction": (ratio != clipped).float().sum() / count,
    }
    means = reduce(torch.stack([loss.detach() for loss in losses.values()])).tolist()
    error = float((ratio.detach() - 1.0).abs().max())
    return losses, {**dict(zip(losses, means, strict=True)), "ratio_error": error}


def _policy_objective(losses: Mapping[str, Tensor], config: PPOConfig) -> Tensor:
    """Return what is minimised beside the value loss, a scalar, of the means of `_losses`."""
    bonus = config.ent_coef * losses["entropy"]
    return losses["policy_loss"] - bonus + losses["extra_loss"]


def check_finite(environments: Tensor, *outputs: Tensor) -> None:
    """Check outputs of networks (T, m) for environments with numbers `environments` (m,).

    Raises
    ------
    NotFiniteError
        An output is NaN or infinite: the first environment is named.
    """
    for output in outputs:
        fine = output.detach().isfinite().all(0)
        if not bool(fine.all()):
            k = int(environments[~fine][0])
            raise NotFiniteError(
                f"environment {k}: the networks' outputs are not finite; lower the learning rate, "
                "or resume from the last checkpoint with another seed"
            )
