"""Encoders, recurrent policies and what is drawn from them. Shapes: T steps, n environments.

Section 4.1 of the paper: a policy is a GRU with two linear layers, for actions and for values;
what it sees is encoded by convolutions and joined by an embedding of the goal.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor, nn
from torch.nn import functional

from internav_data.world.actions import HORIZONS_DEG

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.camp.config import NetworkConfig

    Observations = Mapping[str, Tensor]

_LAYERS: Final = {
    "paper": ((32, 8, 4, 0), (64, 4, 2, 0), (32, 3, 1, 0)),
    "small": ((32, 4, 4, 0), (32, 3, 2, 1), (32, 3, 1, 1)),
}
"""Channels, kernel, stride, padding. `paper` is the released code's; `small` is made for 64x64 or
32x32 on a processor."""
_ACTOR_GAIN: Final = 0.01
_RGB, _DEPTH = 3, 1


class Encoder(nn.Module):
    """What is seen, where the goal is, whether something is held and where the camera looks.

    Parameters
    ----------
    config
        Sizes.
    """

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__()
        self._depth_limit_m, self._goal_scale_m = config.depth_limit_m, config.goal_scale_m
        self._bf16 = config.bf16
        separate = config.encoder == "paper"
        self._channels = (_RGB, _DEPTH) if separate else (_RGB + _DEPTH,)
        self.eyes = nn.ModuleList(_convolutions(count, config) for count in self._channels)
        self.fuse = _linear(2 * config.hidden, config.hidden) if separate else nn.Identity()
        self.goal = _linear(3, config.goal_embedding)
        self.size = self.size_of(config)

    @staticmethod
    def size_of(config: NetworkConfig) -> int:
        """Return the number of features."""
        return config.hidden + config.goal_embedding + 1 + len(HORIZONS_DEG)

    def forward(self, seen: Observations) -> Tensor:
        """Return features (T, n, size) of observations: `rgb` (T, n, S, S, 3) uint8, `depth`
        (T, n, S, S, 1) metres, `goal` (T, n, 2), `held` and `horizon` (T, n).
        """  # noqa: D205 - one sentence
        rgb, depth = seen["rgb"].flatten(0, 1), seen["depth"].flatten(0, 1)
        # Channels stay last in memory, as environments have them: the first convolution learns in
        # a third of the time so.
        pictures = [depth.new_empty(*depth.shape[:-1], channels) for channels in self._channels]
        torch.div(rgb, 255.0, out=pictures[0][..., :_RGB])
        limit = self._depth_limit_m
        torch.div(depth.clamp(max=limit), limit, out=pictures[-1][..., -_DEPTH:])
        views = [picture.permute(0, 3, 1, 2) for picture in pictures]
        with torch.autocast("cuda", torch.bfloat16, enabled=self._bf16 and depth.is_cuda):
            views = [eye(view) for eye, view in zip(self.eyes, views, strict=True)]
            fused = views[0] if len(views) == 1 else self.fuse(torch.cat(views, 1)).relu()
        features = fused.float()
        far, bearing = seen["goal"][..., 0] / self._goal_scale_m, seen["goal"][..., 1]
        goal = self.goal(torch.stack([far, bearing.cos(), bearing.sin()], -1))
        held = seen["held"].unsqueeze(-1).to(goal.dtype)
        horizon = functional.one_hot(seen["horizon"].long(), len(HORIZONS_DEG)).to(goal.dtype)
        return torch.cat([features.view(*held.shape[:2], -1), goal, held, horizon], -1)


class RecurrentActorCritic(nn.Module):
    """A GRU, a linear actor and a linear critic.

    Parameters
    ----------
    inputs, hidden
        Sizes.
    chances
        Of the choices at the start: the actor's biases.
    """

    def __init__(self, inputs: int, hidden: int, chances: Sequence[float]) -> None:
        super().__init__()
        self.gru = nn.GRU(inputs, hidden)
        for name, parameter in self.gru.named_parameters():
            if name.startswith("weight"):
                for gate in parameter.data.chunk(3):  # reset, update and new, each for itself
                    nn.init.orthogonal_(gate)
            else:
                nn.init.zeros_(parameter)
        self.actor = _linear(hidden, len(chances), _ACTOR_GAIN)
        self.actor.bias.data.copy_(torch.tensor(chances).log())
        self.critic = _linear(hidden, 1, 1.0)

    def value(self, out: Tensor) -> Tensor:
        """Return what the critic expects, (T, n)."""
        value: Tensor = self.critic(out)
        return value.squeeze(-1)


@dataclass(frozen=True)
class EpisodeSegments:
    """Where episodes begin in a run of steps, and how GRUs go over it."""

    starts: Tensor
    """(T, n) bool: an episode begins at this step."""

    @cached_property
    def bounds(self) -> list[int]:
        """First steps of the chunks between starts, and T."""
        begun: list[int] = self.starts.any(1).nonzero().flatten().tolist()
        return sorted({0, *begun, len(self.starts)})

    def of(self, columns: Tensor) -> EpisodeSegments:
        """Return the course of some of the environments."""
        return EpisodeSegments(self.starts[:, columns])

    def run(self, gru: nn.GRU, inputs: Tensor, hidden: Tensor) -> tuple[Tensor, Tensor]:
        """Run a GRU in one call a chunk; zero it only where an episode begins.

        Parameters
        ----------
        gru
            One layer.
        inputs : (T, n, inputs)
        hidden : (n, hidden)
            Before the first step.

        Returns
        -------
        out : (T, n, hidden)
        hidden : (n, hidden)
            After the last step.
        """
        h, outs = hidden.unsqueeze(0), []
        for begin, end in itertools.pairwise(self.bounds):
            h = h.masked_fill(self.starts[begin].unsqueeze(-1), 0.0)
            out, h = gru(inputs[begin:end], h)
            outs.append(out)
        return (outs[0] if len(outs) == 1 else torch.cat(outs)), h.squeeze(0)

    def again(self, gru: nn.GRU, inputs: Tensor, hidden: Tensor, out: Tensor) -> Tensor:
        """Run every step once more on other inputs, from the hidden state it had before.

        `hidden` and `out` are those of the first run; returns (T, n, hidden).
        """
        before = torch.cat([hidden.unsqueeze(0), out[:-1]])
        before = before.masked_fill(self.starts.unsqueeze(-1), 0.0)
        once, _ = gru(inputs.flatten(0, 1).unsqueeze(0), before.flatten(0, 1).unsqueeze(0))
        again: Tensor = once.view_as(out)
        return again


def drawn(log_probs: Tensor, uniforms: Tensor | None) -> Tensor:
    """Draw from distributions by inversion, so that one number decides whatever the batch.

    Parameters
    ----------
    log_probs : (n, choices)
    uniforms : (n,)
        In [0, 1); None for the most probable choice.

    Returns
    -------
    (n,) int64; never a choice of probability 0
    """
    if uniforms is None:
        return log_probs.argmax(-1)
    # A number in float32 has 24 bits: in float64 its product with the sum stays below the sum.
    sums = log_probs.double().exp().cumsum(-1)
    return (sums <= uniforms.double().unsqueeze(-1) * sums[:, -1:]).sum(-1)


def entropy_of(log_probs: Tensor) -> Tensor:
    """Return the entropy of distributions (…, choices); impossible choices count nothing."""
    return -(log_probs.exp() * log_probs.clamp(min=-1e9)).sum(-1)


def _convolutions(channels: int, config: NetworkConfig) -> nn.Sequential:
    layers: list[nn.Module] = []
    size = config.image_size
    for out, kernel, stride, padding in _LAYERS[config.encoder]:
        layer = nn.Conv2d(channels, out, kernel, stride, padding)
        nn.init.orthogonal_(layer.weight, nn.init.calculate_gain("relu"))
        if layer.bias is not None:
            nn.init.zeros_(layer.bias)
        layers += [layer, nn.ReLU()]
        channels, size = out, (size + 2 * padding - kernel) // stride + 1
    full = _linear(channels * size * size, config.hidden, nn.init.calculate_gain("relu"))
    return nn.Sequential(*layers, nn.Flatten(), full, nn.ReLU())


def _linear(inputs: int, outputs: int, gain: float = 2**0.5) -> nn.Linear:
    layer = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(layer.weight, gain)
    nn.init.zeros_(layer.bias)
    return layer
