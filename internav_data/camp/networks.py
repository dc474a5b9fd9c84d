"""Networks: encoders, recurrent policies, the intent policy. Shapes: T steps, n environments.

A policy is a GRU with two linear layers, one for actions and one for values (section 4.1 of the
paper); its inputs are convolutional features joined by an embedding of the goal.
"""

from __future__ import annotations

import copy
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Final, TypeVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from internav_data.camp.config import NetworkConfig
from internav_data.camp.stacked_gru import run_stacked
from internav_data.catalog.asset_types import ASSET_TYPES
from internav_data.envs.house_map import MAP_SIZE, NOTHING_HERE, PICK, PICK_FAILED, PUSH, UNSEEN
from internav_data.envs.sensors import DEFAULT_SENSORS, Sensor, observed, sensor_names
from internav_data.world.actions import HORIZONS_DEG

_LAYERS: Final = {
    "paper": ((32, 8, 4, 0), (64, 4, 2, 0), (32, 3, 1, 0)),
    "small": ((32, 4, 4, 0), (32, 3, 2, 1), (32, 3, 1, 1)),
    "map": ((16, 4, 4, 0), (32, 3, 2, 1)),
}
"""Channels, kernel, stride and padding of each convolution. `paper` is the released code's; `small`
is made for 64x64 or 32x32 pixels on a CPU, `map` for 52x52 cells."""
_ACTOR_GAIN: Final = 0.01
_SCALE_RATE: Final = 0.2
"""Weight of a rollout's variance in the running one of returns."""
_MIN_SCALE: Final = 0.1
"""Least deviation of returns that values are measured in."""
_RIDGE: Final = 0.01
"""Penalty on a fitted critic's change, in units of its inputs' mean square."""
EMBEDDED: Final = 12
"""Length of an embedded intent (section 5.2)."""
_RGB, _DEPTH = 3, 1
_LOG_MASS: Final = 5.0
"""Divisor of log(1 + mass in kg)."""
_TALL: Final = 125.0
"""Divisor of a map's heights: 2.5 m."""
_NEAR_CELLS: Final = slice(MAP_SIZE // 2 - 12, MAP_SIZE // 2 + 12)
"""Rows and columns of a map within 1.5 m of the agent: its reach and a thing's own size."""
_NEAR_M: Final = 0.25
"""Distance over which the goal's nearness falls to 1/e, metres: a step of the agent."""
_NEAR_WEIGHT: Final = 3.0
"""Nearness at the goal itself."""
L = TypeVar("L", nn.Linear, nn.Conv2d)
_TINY: Final = 1e-12


class SensorEncoder(nn.Module):
    """Features (T, n, size) float32 of the observations (T, n, …) of some sensors."""

    sensors: ClassVar[tuple[str, ...]]
    """Names of the sensors, in the order of `forward`'s arguments."""
    size: int
    """Number of features."""

    def __init__(self, config: NetworkConfig) -> None:  # noqa: ARG002 - sizes, for those that have any
        super().__init__()


class CameraEncoder(SensorEncoder):
    """Convolutional features of colours and depth: one network each, or one for both."""

    sensors = ("rgb", "depth")

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__(config)
        self.size = config.hidden
        self._depth_limit_m, self._bf16 = config.depth_limit_m, config.bf16
        separate = config.encoder == "paper"
        self._channels = (_RGB, _DEPTH) if separate else (_RGB + _DEPTH,)
        self.eyes = nn.ModuleList(
            _convolutions(config.encoder, count, config.image_size, config.hidden)
            for count in self._channels
        )
        self.fuse = _linear(2 * config.hidden, config.hidden) if separate else nn.Identity()

    def forward(self, rgb: Tensor, depth: Tensor) -> Tensor:
        """Return features of `rgb` (T, n, S, S, 3) uint8 and `depth` (T, n, S, S, 1) metres."""
        steps = depth.shape[:2]
        rgb, depth = rgb.flatten(0, 1), depth.flatten(0, 1)
        # Channels stay last in memory, as environments have them: so the first convolution learns
        # in a third of the time.
        pictures = [depth.new_empty(*depth.shape[:-1], channels) for channels in self._channels]
        torch.div(rgb, 255.0, out=pictures[0][..., :_RGB])
        limit = self._depth_limit_m
        torch.div(depth.clamp(max=limit), limit, out=pictures[-1][..., -_DEPTH:])
        views = [picture.permute(0, 3, 1, 2) for picture in pictures]  # (T n, channels, S, S)
        with torch.autocast("cuda", torch.bfloat16, enabled=self._bf16 and depth.is_cuda):
            views = [eye(view) for eye, view in zip(self.eyes, views, strict=True)]
            fused = views[0] if len(views) == 1 else self.fuse(torch.cat(views, 1)).relu()
        return fused.float().view(*steps, -1)


class MapEncoder(SensorEncoder):
    """Convolutional features of a map, and what failed with things round the agent.

    Planes are the height of what stands there, the usual mass of its type, whether it is of a type
    to push, or to pick up, the goal, and whether anything failed there; with occlusion what has not
    been seen yet, and an oracle's privileged channels.
    """

    sensors = ("map",)
    masses: Tensor
    bits: Tensor

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__(config)
        self._occlusion, self._bf16 = config.map_occlusion, config.bf16
        self._planes = 6 + config.map_occlusion + len(config.privileged)
        self.eye = _convolutions("map", self._planes, MAP_SIZE, config.hidden)
        masses = torch.zeros(256)
        for known in ASSET_TYPES.values():
            masses[known.number + 1] = math.log1p(known.mass_kg) / _LOG_MASS
        self.register_buffer("masses", masses, persistent=False)
        bits = torch.tensor([1, 2, 4, 8, PICK_FAILED, NOTHING_HERE], dtype=torch.uint8)
        self.register_buffer("bits", bits, persistent=False)
        self.size = config.hidden + len(bits)

    def forward(self, shown: Tensor) -> Tensor:
        """Return features of `map` (T, n, channels, 52, 52) uint8, as `map_sensor` writes it."""
        steps, shown = shown.shape[:2], shown.flatten(0, 1)
        height, kind, types, goal, tried, *told = shown.unbind(1)
        hidden = [kind == UNSEEN] if self._occlusion else []
        scaled = [torch.log1p(each.float()) / _LOG_MASS for each in told]
        known = [kind == PUSH, kind == PICK, goal, tried > 0, *hidden, *scaled]
        planes = self.masses.new_empty(*height.shape, self._planes)  # channels last, as of pictures
        torch.div(height, _TALL, out=planes[..., 0])
        planes[..., 1] = self.masses[types.int()]
        for number, plane in enumerate(known, 2):
            planes[..., number] = plane
        with torch.autocast("cuda", torch.bfloat16, enabled=self._bf16 and planes.is_cuda):
            features = self.eye(planes.permute(0, 3, 1, 2)).float()
        near = tried[:, _NEAR_CELLS, _NEAR_CELLS].flatten(1).unsqueeze(1)  # (T n, 1, cells)
        failed = (near & self.bits.unsqueeze(1)).amax(-1) > 0
        return torch.cat([features, failed.float()], -1).view(*steps, -1)


class GoalEncoder(SensorEncoder):
    """Linear embedding of the point goal: distance, cosine and sine of the bearing, and nearness.

    Nearness is 3 exp(-distance / 0.25 m), metres ahead and metres to the left: without these three
    inputs a linear layer cannot tell the goal from a place 0.25 m beside it.
    """

    sensors = ("goal",)

    def __init__(self, config: NetworkConfig) -> None:
        super().__init__(config)
        self._scale_m, self.size = config.goal_scale_m, config.goal_embedding
        self.linear = _linear(6, config.goal_embedding)

    def forward(self, goal: Tensor) -> Tensor:
        """Return the embedding of `goal` (T, n, 2) metres and radians."""
        distance, cos, sin = goal[..., 0], goal[..., 1].cos(), goal[..., 1].sin()
        scaled = distance / self._scale_m
        near = _NEAR_WEIGHT * (-distance / _NEAR_M).exp()
        out: Tensor = self.linear(
            torch.stack([scaled, cos, sin, near, scaled * cos, scaled * sin], -1)
        )
        return out


class HeldEncoder(SensorEncoder):
    """0 or 1: an object is held."""

    sensors, size = ("held",), 1

    def forward(self, held: Tensor) -> Tensor:
        """Return `held` (T, n) as float32."""
        return held.unsqueeze(-1).float()


class HorizonEncoder(SensorEncoder):
    """One-hot code of the camera's horizon."""

    sensors, size = ("horizon",), len(HORIZONS_DEG)

    def forward(self, horizon: Tensor) -> Tensor:
        """Return the one-hot code of `horizon` (T, n), an index of `HORIZONS_DEG`."""
        return functional.one_hot(horizon.long(), self.size).float()


ENCODERS: Final[dict[str, type[SensorEncoder]]] = {
    "camera": CameraEncoder,
    "map": MapEncoder,
    "goal": GoalEncoder,
    "held": HeldEncoder,
    "horizon": HorizonEncoder,
}
"""Encoders of sensors by name."""


def observation_sensors(
    config: NetworkConfig, sensors: Sequence[str | Sensor] = DEFAULT_SENSORS
) -> tuple[str | Sensor, ...]:
    """Return an agent's sensors as a config observes the house: a map may replace the pictures."""
    if config.observation == "camera":
        return tuple(sensors)
    seen = observed("map", map_occlusion=config.map_occlusion, privileged=config.privileged)
    return (*seen, *(sensor for sensor in sensors if sensor not in DEFAULT_SENSORS))


class Encoder(nn.Module):
    """Features of an agent's sensors: those of each encoder whose sensors it has, joined.

    Parameters
    ----------
    config
        Sizes of the networks.
    sensors
        The agent's sensors, or their names. Those of no encoder are left to the agent.
    encoders
        Encoders by name, one's own among them.
    """

    def __init__(
        self,
        config: NetworkConfig,
        sensors: Sequence[str | Sensor] = DEFAULT_SENSORS,
        encoders: Mapping[str, type[SensorEncoder]] = ENCODERS,
    ) -> None:
        super().__init__()
        names = sensor_names(sensors)
        parts = {n: kind(config) for n, kind in encoders.items() if {*kind.sensors} <= names}
        self.parts, self.size = nn.ModuleDict(parts), sum(part.size for part in parts.values())
        self._taken = {name: part.sensors for name, part in parts.items()}

    def forward(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return features (T, n, size) float32 of observations by the names of their sensors."""
        features = [
            self.parts[name](*(observations[sensor] for sensor in sensors))
            for name, sensors in self._taken.items()
        ]
        return torch.cat(features, -1)


class ValueHead(nn.Linear):
    """Linear critic whose output is in units of the returns' deviation.

    So that the gradient of its loss has the size of a policy's: at returns near 10 the two are
    clipped together to a tenth, and what a success teaches is lost. Pop-Art without the mean (van
    Hasselt et al. 2016): a new scale changes the weights and leaves the values as they are.

    Parameters
    ----------
    hidden
        Number of inputs.
    """

    scale: Tensor

    def __init__(self, hidden: int) -> None:
        super().__init__(hidden, 1)
        _initialised(self, 1.0)
        self.register_buffer("scale", torch.ones(()))

    def forward(self, out: Tensor) -> Tensor:
        """Return values (T, n), in units of the reward, for the GRU's outputs (T, n, hidden)."""
        return super().forward(out).squeeze(-1) * self.scale

    @torch.no_grad()
    def note_returns(self, variance: Tensor) -> None:
        """Adapt the scale to a rollout's variance of returns, a scalar in squared rewards."""
        scale = self.scale.square().lerp(variance, _SCALE_RATE).sqrt().clamp(min=_MIN_SCALE)
        for parameter in self.parameters():
            parameter.mul_(self.scale / scale)
        self.scale.copy_(scale)

    @torch.no_grad()
    def fit(self, out: Tensor, returns: Tensor, reduce: Callable[[Tensor], Tensor]) -> None:
        """Fit the values of `out` (T, n, hidden) to `returns` (T, n) by ridge regression.

        The penalty is on the distance from the present parameters; `reduce` sums across ranks.
        """
        inputs = functional.pad(out.flatten(0, 1), (0, 1), value=1.0).double()  # (T n, hidden + 1)
        missing = ((returns - self(out)) / self.scale).flatten().double()
        gram, moment = reduce(inputs.T @ inputs), reduce(inputs.T @ missing)
        penalty = _RIDGE * gram.diagonal().mean() * torch.eye(len(gram), device=gram.device)
        step = torch.linalg.solve(gram + penalty, moment).to(out.dtype)
        self.weight.add_(step[:-1])
        self.bias.add_(step[-1])


class RecurrentActorCritic(nn.Module):
    """GRU with a linear actor and a linear critic.

    Parameters
    ----------
    inputs, hidden
        Sizes of the GRU.
    probabilities
        Initial probabilities of the choices, set by the actor's biases.
    """

    def __init__(self, inputs: int, hidden: int, probabilities: Sequence[float]) -> None:
        super().__init__()
        self.gru = nn.GRU(inputs, hidden)
        for name, parameter in self.gru.named_parameters():
            if name.startswith("weight"):
                for gate in parameter.data.chunk(3):  # each gate for itself: reset, update, new
                    nn.init.orthogonal_(gate)
            else:
                nn.init.zeros_(parameter)
        self.actor = _linear(hidden, len(probabilities), _ACTOR_GAIN)
        self.actor.bias.data.copy_(torch.tensor(probabilities).log())
        self.critic = ValueHead(hidden)


class IntentConditionedPolicy(RecurrentActorCritic):
    """Policy that also takes an intent, embedded by the linear layer E (equation 5).

    Parameters
    ----------
    inputs, hidden, probabilities
        See `RecurrentActorCritic`; the intent is no part of `inputs`.
    intents
        Length of an intent.
    """

    def __init__(
        self, inputs: int, hidden: int, probabilities: Sequence[float], intents: int
    ) -> None:
        super().__init__(inputs + EMBEDDED, hidden, probabilities)
        self.embed = nn.Linear(intents, EMBEDDED)

    def condition(self, features: Tensor, intent: Tensor) -> Tensor:
        """Return the GRU's inputs (T, n, inputs + 12)."""
        return torch.cat([features, self.embed(intent)], -1)


class IntentPolicy(nn.Module):
    """Intent policy pi' (equation 6): a copy of a policy's E, GRU and actor.

    It takes the uniform intent, has a hidden state of its own, and is never optimised.

    Parameters
    ----------
    policy
        Policy to copy, now and at every `synchronise`.
    recursive
        Run twice in a step from the same hidden state, the second time on the first intent; the
        hidden state after the first run goes on.
    """

    def __init__(self, policy: IntentConditionedPolicy, *, recursive: bool) -> None:
        super().__init__()
        self.embed = copy.deepcopy(policy.embed)
        self.gru = copy.deepcopy(policy.gru)
        self.actor = copy.deepcopy(policy.actor)
        self._recursive = recursive
        self.requires_grad_(requires_grad=False)

    @torch.no_grad()
    def synchronise(self, policy: IntentConditionedPolicy) -> None:
        """Copy the parameters of the policy; hidden states stay."""
        for name, part in self.named_children():
            part.load_state_dict(policy.get_submodule(name).state_dict())

    @torch.no_grad()
    def forward(
        self,
        features: Tensor,
        hidden: Tensor,
        segments: EpisodeSegments,
        mix: Callable[[Tensor], Tensor],
        mask: Tensor,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return P(omega') and P(i), without gradient.

        Parameters
        ----------
        features : (T, n, inputs)
            Inputs of the copied policy, without the intent.
        hidden : (n, hidden)
            Hidden state before the first step.
        segments
            Episode starts.
        mix
            Function of P(omega') that gives P(i), equation 7.
        mask : (choices,)
            0, or minus infinity for a forbidden choice.

        Returns
        -------
        intended : (T, n, choices)
            P(omega'), equation 6.
        intent : (T, n, intents)
            P(i), equation 7.
        hidden : (n, hidden)
            Hidden state after the last step.
        """
        intent = uniform_intent(features, self.embed.in_features)
        out, after = segments.run(self.gru, torch.cat([features, self.embed(intent)], -1), hidden)
        intended = torch.softmax(self.actor(out) + mask, -1)
        if self._recursive:
            inputs = torch.cat([features, self.embed(mix(intended))], -1)
            out = segments.run_again(self.gru, inputs, hidden, out)
            intended = torch.softmax(self.actor(out) + mask, -1)
        return intended, mix(intended), after


def uniform_intent(features: Tensor, count: int) -> Tensor:
    """Return the uniform intent (T, n, count) for features (T, n, …)."""
    return features.new_full((*features.shape[:2], count), 1.0 / count)


@dataclass(frozen=True)
class EpisodeSegments:
    """Episodes within T steps of n environments, and how GRUs run over them."""

    episode_starts: Tensor
    """(T, n) bool: an episode begins at this step."""

    @cached_property
    def bounds(self) -> list[int]:
        """First steps of the segments between episode starts, and T."""
        begun: list[int] = self.episode_starts.any(1).nonzero().flatten().tolist()
        return sorted({0, *begun, len(self.episode_starts)})

    def run(self, gru: nn.GRU, inputs: Tensor, hidden: Tensor) -> tuple[Tensor, Tensor]:
        """Run a GRU, one call a segment; zero its hidden state only where an episode begins.

        Parameters
        ----------
        gru
            GRU of one layer.
        inputs : (T, n, inputs)
            Inputs of every step.
        hidden : (n, hidden)
            Hidden state before the first step.

        Returns
        -------
        out : (T, n, hidden)
            Outputs of every step.
        hidden : (n, hidden)
            Hidden state after the last step.
        """
        h, outs = hidden.unsqueeze(0), []
        for begin, end in itertools.pairwise(self.bounds):
            h = h.masked_fill(self.episode_starts[begin].unsqueeze(-1), 0.0)
            out, h = gru(inputs[begin:end], h)
            outs.append(out)
        return (outs[0] if len(outs) == 1 else torch.cat(outs)), h.squeeze(0)

    def run_together(
        self, grus: Sequence[nn.GRU], inputs: Sequence[Tensor], hidden: Sequence[Tensor]
    ) -> tuple[list[Tensor], list[Tensor]]:
        """Run k GRUs of equal numbers of units, as `run` does each.

        On a CPU they share one loop over the steps; on a GPU cuDNN runs each for itself, faster.

        Parameters
        ----------
        grus
            GRUs of one layer.
        inputs
            Inputs of each, (T, n, inputs).
        hidden
            Hidden state of each before the first step, (n, hidden).

        Returns
        -------
        outs
            Outputs of each, (T, n, hidden).
        hidden
            Hidden state of each after the last step, (n, hidden).
        """
        if hidden[0].is_cuda:
            ran = [self.run(*each) for each in zip(grus, inputs, hidden, strict=True)]
            return [out for out, _ in ran], [after for _, after in ran]
        outs = run_stacked(grus, inputs, torch.stack(list(hidden)), self.episode_starts)
        return list(outs.unbind(1)), list(outs[-1].unbind(0))

    def run_again(self, gru: nn.GRU, inputs: Tensor, hidden: Tensor, out: Tensor) -> Tensor:
        """Run every step once more on other inputs, from the hidden state that it had before.

        `hidden` (n, hidden) and `out` (T, n, hidden) are those of the first run; returns
        (T, n, hidden).
        """
        before = torch.cat([hidden.unsqueeze(0), out[:-1]])
        before = before.masked_fill(self.episode_starts.unsqueeze(-1), 0.0)
        # All T n steps at once, as a batch of sequences of length 1.
        once, _ = gru(inputs.flatten(0, 1).unsqueeze(0), before.flatten(0, 1).unsqueeze(0))
        again: Tensor = once.view_as(out)
        return again


def drawn(log_probs: Tensor, uniforms: Tensor | None) -> Tensor:
    """Draw from distributions by inversion: one number decides, whatever the batch.

    Parameters
    ----------
    log_probs : (…, n, choices)
        Log-probabilities.
    uniforms : (n,)
        Random numbers in [0, 1); None for the most probable choice.

    Returns
    -------
    (…, n) int64; never a choice of probability 0
    """
    if uniforms is None:
        return log_probs.argmax(-1)
    # A number in float32 has 24 bits: in float64 its product with the sum stays below the sum.
    sums = log_probs.double().exp().cumsum(-1)
    return (sums <= uniforms.double().unsqueeze(-1) * sums[..., -1:]).sum(-1)


def log_prob_of(log_probs: Tensor, choice: Tensor) -> Tensor:
    """Return the log-probabilities (…) of choices (…) in distributions (…, choices)."""
    return log_probs.gather(-1, choice.unsqueeze(-1)).squeeze(-1)


def entropy_of(log_probs: Tensor) -> Tensor:
    """Return the entropy of distributions (…, choices); impossible choices add nothing."""
    return -(log_probs.exp() * log_probs.clamp(min=-1e9)).sum(-1)


def divergence(first: Tensor, second: Tensor) -> float:
    """Return the mean KL divergence of distributions (…, k) from one another, in nats."""
    ratio = first.clamp_min(_TINY).log() - second.clamp_min(_TINY).log()
    return float((first * ratio).sum(-1).mean())


def _convolutions(kind: str, channels: int, size: int, features: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for out, kernel, stride, padding in _LAYERS[kind]:
        layer = nn.Conv2d(channels, out, kernel, stride, padding)
        layers += [_initialised(layer, nn.init.calculate_gain("relu")), nn.ReLU()]
        channels, size = out, (size + 2 * padding - kernel) // stride + 1
    full = _linear(channels * size * size, features, nn.init.calculate_gain("relu"))
    return nn.Sequential(*layers, nn.Flatten(), full, nn.ReLU())


def _linear(inputs: int, outputs: int, gain: float = 2**0.5) -> nn.Linear:
    return _initialised(nn.Linear(inputs, outputs), gain)


def _initialised(layer: L, gain: float) -> L:
    nn.init.orthogonal_(layer.weight, gain)
    if layer.bias is not None:
        nn.init.zeros_(layer.bias)
    return layer
