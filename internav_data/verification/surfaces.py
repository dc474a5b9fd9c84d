"""Predicates of the surfaces in a house, which hold from version 2 of the catalogue on.

Rugs are floor: thin, and nothing is held by one. What stands on furniture does not overhang.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import shapely

from internav_data.verification.shapes import solid_of

if TYPE_CHECKING:
    from internav_data.records import Asset, House
    from internav_data.verification.findings import FindingCollector
    from internav_data.verification.shapes import Shapes

SINCE = 2
"""Version of the catalogue from which on these predicates hold."""
RUG_M = 0.004
"""Largest height of an asset that blocks nothing."""
LEVEL_M = 0.001
"""Largest difference of height of a top and of what it carries."""
EDGE_M = 0.002
"""Distance by which a thing may stick out over the top that carries it."""
SLIVER_M2 = 1e-4
"""Area beyond that distance that does not count."""


def check_flat(asset: Asset, report: FindingCollector) -> None:
    """Check that an asset that blocks nothing is too thin for anything to look sunk into it."""
    if asset.blocks:
        return
    top = max((float(solid_of(part).corners[:, 2].max()) for part in asset.parts), default=0.0)
    report.expect(
        top <= RUG_M + 1e-6,
        "schema.assets.rug",
        f"{asset.asset_id}: at most {RUG_M} m high, as it blocks nothing",
        f"{top:.4f} m",
    )


def check_surfaces(house: House, shapes: Shapes, report: FindingCollector) -> None:
    """Check that no object is held by a rug, and that none overhangs what carries it."""
    placed = {item.object_id: item for item in house.objects}
    for item in house.objects:
        below = placed.get(item.support)
        if below is None:
            continue
        report.expect(
            shapes.assets[below.asset_id].blocks,
            "object.support",
            f"object {item.object_id} on the floor or on furniture",
            f"on object {below.object_id}, a rug",
        )
        tops = [
            slab.plan
            for slab in shapes.slabs(below.asset_id, below.pose)
            if abs(slab.high - item.z) < LEVEL_M
        ]
        carried = shapely.buffer(shapely.union_all(tops), EDGE_M, join_style="mitre")
        plans = [slab.plan for slab in shapes.slabs(item.asset_id, item.pose)]
        beyond = float(shapely.area(shapely.difference(shapely.union_all(plans), carried)))
        report.expect(
            beyond < SLIVER_M2,
            "object.overhang",
            f"object {item.object_id} within the top of object {below.object_id}",
            f"{beyond:.4f} m² beyond it",
        )
