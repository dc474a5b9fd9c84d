"""`nie`: PPO that predicts the effect of each action on the objects in sight.

The neural interaction engine of Zeng et al. 2021, "Pushing it out of the way", as the released code
has it: eight keypoints an object; for each action a 3x4 affine map, at first the identity, predicts
where they go; an L1 loss on the action that was taken; a summary by attention joins the GRU's
input. Objects are known by instance masks: **privileged input** that no other method gets. Ours:
keypoints are the corners of the box round an object's visible points, level with the floor, in
metres from the eye; the object's type is no input.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import torch
from torch import Tensor, nn
from torch.nn import functional

from internav_data.camp.agents.flat import FlatRecord, PPOAgent
from internav_data.camp.agents.protocol import Batch, ForwardOutput, ObservationTensors
from internav_data.camp.config import CampConfig
from internav_data.envs.sensors import DEFAULT_SENSORS
from internav_data.records.errors import UsageError
from internav_data.world.actions import ACTION_COUNT, HORIZONS_DEG

SUMMARY: Final = 64
_CORNERS: Final = 8
_NOWHERE: Final = 1e6


class NIEAgent(PPOAgent):
    """`ppo` with a neural interaction engine; it observes instance ids, privileged input."""

    sensors = (*DEFAULT_SENSORS, "ids")

    def __init__(self, config: CampConfig) -> None:
        if config.network.observation != "camera":
            raise UsageError(
                f"network.observation is {config.network.observation!r}: nie sees objects in "
                "pictures; choose 'camera', or another method"
            )
        super().__init__(config, extra=SUMMARY)
        self._objects, self._weight = config.agent.nie_objects, config.agent.nie_weight
        self.object = nn.Sequential(nn.Linear(3 * _CORNERS, SUMMARY), nn.ReLU())
        self.affine = nn.Linear(SUMMARY, ACTION_COUNT * 12)
        nn.init.zeros_(self.affine.weight)
        self.affine.bias.data.copy_(torch.eye(3, 4).flatten().repeat(ACTION_COUNT))
        self.query = nn.Linear(self.encoder.size, SUMMARY)
        self.content = nn.Linear(SUMMARY + 3 * _CORNERS * ACTION_COUNT, SUMMARY)

    def run(self, batch: Batch[Any]) -> ForwardOutput:
        """See `PPOAgent`: features, and a summary of the predicted motion of objects in sight."""
        objects, corners = self.sight(batch)
        features = self.summarised(self.encoder(batch.observations), objects, corners)
        ran = self.decide(features, batch, objects=objects, corners=corners)
        if batch.record is None:
            return ran
        return replace(ran, loss=self.loss(batch, objects, corners))

    def sight(self, batch: Batch[Any]) -> tuple[Tensor, Tensor]:
        """Return objects (T, n, K) and corners (T, n, K, 8, 3), recorded or found anew."""
        record = batch.record
        if record is None or record.objects is None or record.corners is None:
            return self.sighted(batch.observations)
        return record.objects, record.corners

    def summarised(self, features: Tensor, objects: Tensor, corners: Tensor) -> Tensor:
        """Return features (T, n, size) joined by an attention summary of objects, (T, n, 64)."""
        there = objects >= 0  # (T, n, K)
        each = self.object(corners.flatten(-2))  # (T, n, K, 64)
        moves = (self.predicted(each, corners) - corners.unsqueeze(-3)).flatten(-3)
        likeness = (each * self.query(features).unsqueeze(-2)).sum(-1) / SUMMARY**0.5
        weights = torch.softmax(likeness.masked_fill(~there, -_NOWHERE), -1) * there
        content = self.content(torch.cat([each, moves], -1))
        return torch.cat([features, (weights.unsqueeze(-1) * content).sum(-2)], -1)

    def predicted(self, each: Tensor, corners: Tensor) -> Tensor:
        """Return the keypoints (…, K, 8, 3) after each action, (…, K, A, 8, 3)."""
        affine: Tensor = self.affine(each).view(*each.shape[:-1], ACTION_COUNT, 3, 4)
        padded = functional.pad(corners, (0, 1), value=1.0).unsqueeze(-3)
        ahead: Tensor = padded @ affine.transpose(-1, -2)
        return ahead

    def loss(self, batch: Batch[FlatRecord], objects: Tensor, corners: Tensor) -> Tensor:
        """Return the L1 error (T, n) of the predicted keypoints, weighted."""
        index = batch.record.choice[..., None, None, None, None]
        ahead = self.predicted(self.object(corners.flatten(-2)), corners)
        ahead = ahead.take_along_dim(index, -3).squeeze(-3)  # after the action that was taken
        same = objects[:-1, :, :, None] == objects[1:, :, None, :]
        same &= (objects[:-1, :, :, None] >= 0) & ~batch.episode_starts[1:, :, None, None]
        apart = (ahead[:-1, :, :, None] - corners[1:, :, None]).abs().mean((-1, -2))
        loss = (apart * same).sum((-1, -2)) / same.sum((-1, -2)).clamp(min=1)
        return self._weight * functional.pad(loss, (0, 0, 0, 1))

    @torch.no_grad()
    def sighted(self, observations: ObservationTensors) -> tuple[Tensor, Tensor]:
        """Return the nearest objects in sight: ids (T, n, K), -1 for none; corners (T, n, K, 8, 3).

        Corners are those of the box round an object's visible points, in metres from the eye.

        Raises
        ------
        UsageError
            The observations have no instance ids.
        """
        if "ids" not in observations:
            raise UsageError(
                f"nie needs instance masks: make the environments with sensors={list(self.sensors)}"
            )
        depth, instances = observations["depth"], observations["ids"]
        steps, count, size, _ = instances.shape
        ids = instances.reshape(steps * count, -1).long().clamp(min=0)  # 1 and up are objects
        points = _points(depth.reshape(steps * count, size, size), observations["horizon"])
        index = ids.unsqueeze(-1).expand_as(points)
        columns = 1 + max(int(ids.max()) + 1, self._objects)  # the first is of no object
        nothing = points.new_full((len(ids), columns, 3), _NOWHERE)
        low = nothing.scatter_reduce(1, index, points, "amin")
        high = (-nothing).scatter_reduce(1, index, points, "amax")
        low, high = low[:, 1:], high[:, 1:]
        far = low.clamp(min=0.0)[..., 0] + low[..., 0].eq(_NOWHERE) * _NOWHERE
        near, places = far.topk(self._objects, dim=1, largest=False)
        there = near < _NOWHERE
        ends = [side.take_along_dim(places.unsqueeze(-1), 1) for side in (low, high)]
        box = torch.stack(ends, -2) * there[..., None, None]
        grid = torch.cartesian_prod(*[torch.arange(2, device=box.device)] * 3)
        corners = torch.stack([box[:, :, grid[:, axis], axis] for axis in range(3)], -1)
        objects = places.masked_fill(~there, -1)
        return objects.view(steps, count, -1), corners.view(steps, count, -1, _CORNERS, 3)


def _points(depth: Tensor, horizon: Tensor) -> Tensor:
    """Return the points of pixels, (N, pixels, 3): metres ahead, left and up from a level eye.

    The field of view is 90 degrees, so a pixel's slope is its place between -1 and 1.
    """
    size = depth.shape[-1]
    slopes = (torch.arange(size, device=depth.device) + 0.5) * (2.0 / size) - 1.0
    left, up = -slopes[None, None, :] * depth, -slopes[None, :, None] * depth
    degrees = torch.tensor(HORIZONS_DEG, dtype=depth.dtype, device=depth.device)
    down = torch.deg2rad(degrees)[horizon.flatten().long()][:, None, None]
    ahead = depth * down.cos() + up * down.sin()
    level = up * down.cos() - depth * down.sin()
    return torch.stack([ahead, left, level], -1).flatten(1, 2)
