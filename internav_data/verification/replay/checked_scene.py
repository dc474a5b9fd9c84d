"""What the episodes of one scene share when they are played again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Point

from internav_data.verification.overlaps import overlapping_slabs
from internav_data.verification.things import wall_slabs
from internav_data.world import HouseModel, World

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.records import Asset, Episode, Pose
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.verification.settings import Settings
    from internav_data.world import MovableObject

SITES_KEPT = 8
"""Houses without some of their furniture, kept a scene: graphs are large."""


@dataclass(frozen=True, slots=True)
class Scenery:
    """Things as they lie: a house with the furniture in its place, footprints of all the rest."""

    site: CheckedLayout
    taken: tuple[Geometry, ...]


class CheckedScene:
    """A house on the shared stage, and the validator's own view of it."""

    def __init__(self, site: CheckedLayout, settings: Settings) -> None:
        self.site = site
        self.settings = settings
        self.assets: dict[str, Asset] = dict(site.shapes.assets)
        self.stage = HouseModel.of(replace(site.house, assets=self.assets))
        self._walls = wall_slabs(site.house)
        self._sites: dict[frozenset[int], CheckedLayout] = {}
        self._prints: dict[tuple[str, Pose], tuple[Geometry, ...]] = {}
        self._spans: dict[tuple[str, Pose], tuple[float, float]] = {}

    def world(self, episode: Episode) -> World:
        """Set up an episode at its start."""
        return World.of_episode(self.stage, episode, self.assets, self.settings.push_model)

    def scenery(self, items: Sequence[MovableObject], changes: dict[int, Pose | None]) -> Scenery:
        """Return what stands in the agent's way when some of a world's items lie elsewhere.

        Parameters
        ----------
        items
            Of a world: furniture that can move, then obstacles.
        changes
            New poses of some of them, by index; None for what is held.

        """
        at = {k: item.pose for k, item in enumerate(items)} | changes
        home = self.stage.items
        moved = [k for k, item in enumerate(home) if at[k] != item.pose]
        taken: list[Geometry] = []
        for k in (*moved, *range(len(home), len(items))):
            pose = at[k]
            if pose is not None:
                taken += self.footprint(items[k].asset.asset_id, pose)
        return Scenery(self._without(frozenset(moved)), tuple(taken))

    def footprint(self, asset_id: str, pose: Pose) -> tuple[Geometry, ...]:
        """Return what a thing covers, worked out once for each place it lies at."""
        key = (asset_id, pose)
        if key not in self._prints:
            self._prints[key] = tuple(self.site.shapes.footprint(asset_id, pose))
        return self._prints[key]

    def span(self, asset_id: str, pose: Pose) -> tuple[float, float]:
        """Lowest and highest point of a thing, metres, worked out once for each pose."""
        key = (asset_id, pose)
        if key not in self._spans:
            slabs = self.site.shapes.slabs(asset_id, pose)
            self._spans[key] = (min(s.low for s in slabs), max(s.high for s in slabs))
        return self._spans[key]

    def in_walls(self, asset_id: str, pose: Pose, depth_m: float) -> bool:
        """Whether a thing reaches deeper than `depth_m` into a wall.

        In space: what leans over a window's sill is above the wall there.
        """
        own = self.site.shapes.slabs(asset_id, pose)
        plan = shapely.union_all([slab.plan for slab in own])
        near = [slab for slab in self._walls if shapely.intersects(slab.plan, plan)]
        owners = [0] * len(near) + [1] * len(own)
        return bool(overlapping_slabs([*near, *own], owners, lambda *_: False, depth_m))

    def gap(self, asset_id: str, pose: Pose, point: tuple[float, float]) -> float:
        """Distance in the plane from a point to a thing, parts of any height, metres."""
        slabs = self.site.shapes.slabs(asset_id, pose)
        plans = np.array([slab.plan for slab in slabs], dtype=object)
        return float(shapely.distance(plans, Point(point)).min())

    def _without(self, moved: frozenset[int]) -> CheckedLayout:
        """Return the house without some of its movable furniture (indices of items)."""
        if not moved:
            return self.site
        if moved not in self._sites:
            if len(self._sites) >= SITES_KEPT:
                del self._sites[next(iter(self._sites))]
            gone = frozenset(self.stage.object_ids[k] for k in moved)
            self._sites[moved] = self.site.without(gone)
        return self._sites[moved]
