"""Assets as Wavefront OBJ text, the one format from which Bullet builds large compounds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.geometry import asset_corners

if TYPE_CHECKING:
    from internav_data.records import Asset


def obj_text(asset: Asset) -> str:
    """Return Wavefront OBJ text of one object a part; Bullet makes the hull of each one shape.

    The triangles only name the corners: Bullet builds hulls from the points.
    """
    corners, starts = asset_corners(asset)
    lines: list[str] = []
    for part in range(len(starts) - 1):
        first, last = int(starts[part]), int(starts[part + 1])
        lines.append(f"o part{part}")
        lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners[first:last].tolist()]
        lines += [f"f {first + 1} {k + 1} {k + 2}" for k in range(first + 1, last - 1)]
    return "\n".join(lines) + "\n"
