"""Models of one scene that the replays of all its episodes share."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Point

from internav_data.physics import DEFAULT_ENGINE, ENGINES
from internav_data.verification.overlaps import WALL_ID, Solids, intrusions
from internav_data.world import HouseModel, World
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.records import Asset, Episode, Pose
    from internav_data.verification.checked_config import CheckedConfig
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.verification.shapes import Slab
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
        self._slabs: dict[tuple[str, Pose], list[Slab]] = {}

    def world(self, episode: Episode, engine: str | None = None) -> World:
        """Return the world of an episode at its start, by its own engine or the one named."""
        config = WorldConfig(self.config.push_model, self.config.force_n, self.config.hands)
        return World.of_episode(
            self.model, episode, self.assets, config, engine or self.engine(episode)
        )

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

    def slabs(self, asset_id: str, pose: Pose) -> list[Slab]:
        """Return the slabs of an asset, computed once for each pose."""
        key = (asset_id, pose)
        if key not in self._slabs:
            self._slabs[key] = self.layout.shapes.slabs(asset_id, pose)
        return self._slabs[key]

    def span(self, asset_id: str, pose: Pose) -> tuple[float, float]:
        """Return the lowest and highest point of an asset, metres."""
        slabs = self.slabs(asset_id, pose)
        return min(s.low for s in slabs), max(s.high for s in slabs)

    def intrusions(
        self, items: Sequence[MovableObject], changes: dict[int, Pose], depth_m: float
    ) -> list[tuple[int, str]]:
        """Return items that end over `depth_m` inside something: their indices, and what it is.

        In space, not in plan: an object that leans over a window's sill is above the wall there.

        Parameters
        ----------
        items
            Items of a world: movable furniture, then obstacles.
        changes
            New poses of some of them, by index: these are looked at.
        depth_m
            Depth, metres: the diameter of a ball that two bodies share.

        """
        moved = Solids.of((k, self.slabs(items[k].asset.asset_id, p)) for k, p in changes.items())
        # The layout holds the furniture in its place, that which has moved among it.
        ids = self.model.object_ids
        gone = {ids[k] for k in changes if k < len(ids)}
        still = Solids.of(
            (k, self.slabs(item.asset.asset_id, item.pose))
            for k, item in enumerate(items)
            if k >= len(ids) and k not in changes and item.pose is not None
        )
        found = [
            (k, "a wall" if owner == WALL_ID else f"object {owner}")
            for k, owner in intrusions(moved, self.layout.solids, depth_m)
            if owner not in gone
        ]
        for others in (still, moved):
            pairs = intrusions(moved, others, depth_m)
            found += [(k, items[other].asset.asset_id) for k, other in pairs]
        return found

    def gap(self, asset_id: str, pose: Pose, point: tuple[float, float]) -> float:
        """Return the distance in the plane from a point to an asset's parts, metres."""
        slabs = self.layout.shapes.slabs(asset_id, pose)
        plans = np.array([slab.plan for slab in slabs], dtype=object)
        return float(shapely.distance(plans, Point(point)).min())
