"""Models of one scene that the replays of all its episodes share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Point

from internav_data.physics import DEFAULT_ENGINE, ENGINES
from internav_data.verification.overlaps import overlapping_slabs
from internav_data.world import HouseModel, World
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.records import Asset, Episode, Pose
    from internav_data.verification.checked_config import CheckedConfig
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.world import MovableObject


@dataclass(frozen=True, slots=True)
class Arrangement:
    """A layout of the furniture that has not moved, with the footprints of all other objects."""

    layout: CheckedLayout
    obstacles: tuple[Geometry, ...]


class CheckedScene:
    """A house's shared model beside the validator's own layout of it."""

    def __init__(self, layout: CheckedLayout, config: CheckedConfig) -> None:
        self.layout = layout
        self.config = config
        self.assets: dict[str, Asset] = dict(layout.shapes.assets)
        self.model = HouseModel.of(replace(layout.house, assets=self.assets))
        self._footprints: dict[tuple[str, Pose], tuple[Geometry, ...]] = {}
        self._spans: dict[tuple[str, Pose], tuple[float, float]] = {}

    def world(self, episode: Episode) -> World:
        """Return the world of an episode at its start."""
        config = WorldConfig(self.config.push_model, self.config.force_n, self.config.hands)
        return World.of_episode(self.model, episode, self.assets, config, self.engine(episode))

    def engine(self, episode: Episode) -> str:
        """Return the name of the physics engine that checks an episode: its own, if known here."""
        made_by = episode.physics.engine
        return made_by if made_by in ENGINES else DEFAULT_ENGINE

    def rearranged(
        self, items: Sequence[MovableObject], changes: dict[int, Pose | None]
    ) -> Arrangement:
        """Return the footprints of a world in which some items have other poses.

        Parameters
        ----------
        items
            Items of a world: movable furniture, then obstacles.
        changes
            New poses of some of them, by index; None for the held object.

        """
        at = {k: item.pose for k, item in enumerate(items)} | changes
        home = self.model.items
        moved = [k for k, item in enumerate(home) if at[k] != item.pose]
        obstacles: list[Geometry] = []
        for k in (*moved, *range(len(home), len(items))):
            pose = at[k]
            if pose is not None:
                obstacles += self.footprint(items[k].asset.asset_id, pose)
        gone = frozenset(self.model.object_ids[k] for k in moved)
        return Arrangement(self.layout.without(gone), tuple(obstacles))

    def footprint(self, asset_id: str, pose: Pose) -> tuple[Geometry, ...]:
        """Return the footprint of an asset, computed once for each pose."""
        key = (asset_id, pose)
        if key not in self._footprints:
            self._footprints[key] = tuple(self.layout.shapes.footprint(asset_id, pose))
        return self._footprints[key]

    def span(self, asset_id: str, pose: Pose) -> tuple[float, float]:
        """Return the lowest and highest point of an asset, metres, computed once a pose."""
        key = (asset_id, pose)
        if key not in self._spans:
            slabs = self.layout.shapes.slabs(asset_id, pose)
            self._spans[key] = (min(s.low for s in slabs), max(s.high for s in slabs))
        return self._spans[key]

    def overlaps_walls(self, asset_id: str, pose: Pose, depth_m: float) -> bool:
        """Return whether an asset reaches deeper than `depth_m` into a wall.

        In space, not in plan: an object that leans over a window's sill is above the wall there.
        """
        own = self.layout.shapes.slabs(asset_id, pose)
        plan = shapely.union_all([slab.plan for slab in own])
        near = [slab for slab in self.layout.wall_slabs if shapely.intersects(slab.plan, plan)]
        owners = [0] * len(near) + [1] * len(own)
        return bool(overlapping_slabs([*near, *own], owners, lambda *_: False, depth_m))

    def gap(self, asset_id: str, pose: Pose, point: tuple[float, float]) -> float:
        """Return the distance in the plane from a point to an asset's parts, metres."""
        slabs = self.layout.shapes.slabs(asset_id, pose)
        plans = np.array([slab.plan for slab in slabs], dtype=object)
        return float(shapely.distance(plans, Point(point)).min())
