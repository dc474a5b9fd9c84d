"""Check of a stated Euclidean path length against the visibility graph."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from internav_data.verification.checked_lattice import KEEP_M
from internav_data.verification.visibility_graph import (
    FINE,
    FINEST,
    VisibilityGraph,
    connected,
    inflate,
    path_ellipse,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.verification.checked_layout import CheckedLayout

AGREE = 0.0005
"""Euclidean path lengths agree with the visibility graph within this share …"""
AGREE_M = 0.001
"""… and this length. The format promises 1 %; the generator's own graph is exact."""
MAX_EXCESS = 1.05
"""Paths longer than this multiple of the stated length are not searched further."""
BAND_M = 5e-5
"""Tie: if a radius this much larger or smaller changes the answer, both answers are accepted."""
ELLIPSE_MARGIN_M = 0.5
"""Polygons farther than this outside a path ellipse cannot obstruct the disc within it."""


def tolerance_m(length: float) -> float:
    """Return the tolerance of a path length, metres."""
    return AGREE * length + AGREE_M


@dataclass(frozen=True, slots=True)
class CheckedPath:
    """Shortest path between two points of a house with further footprints `obstacles`."""

    layout: CheckedLayout
    start: tuple[float, float]
    goal: tuple[float, float]
    obstacles: Sequence[Geometry] = ()

    def length(self, max_length: float = math.inf) -> float:
        """Return the length of the shortest path, metres, or inf if longer than `max_length`.

        Arcs are approximated by few chords.
        """
        base = self.layout.visibility_graph
        graph = (
            VisibilityGraph(base.base, inflate(self.obstacles), base) if self.obstacles else base
        )
        return graph.length(self.start, self.goal, max_length)

    def agrees(self, stated: float) -> bool:
        """Return whether a stated length is that of the shortest path."""
        found = self.length(stated + tolerance_m(stated))
        return abs(found - stated) <= tolerance_m(stated) or self.agrees_exactly(stated)

    def agrees_exactly(self, stated: float) -> bool:
        """Return whether finely cut arcs, or ties within the band, agree with a stated length."""
        max_length = stated * MAX_EXCESS + AGREE_M
        near = path_ellipse(self.start, self.goal, max_length + ELLIPSE_MARGIN_M)
        blockers = [
            b for b in (*self.layout.blockers, *self.obstacles) if shapely.intersects(near, b)
        ]

        def agree(chords: int, wider_m: float) -> bool:
            graph = VisibilityGraph(inflate(blockers, chords, wider_m), portals=self.layout.portals)
            return abs(graph.length(self.start, self.goal, max_length) - stated) <= tolerance_m(
                stated
            )

        # A gap as wide as the disc is open for the smaller disc and shut for the larger one.
        return agree(FINE, 0.0) or agree(FINEST, -BAND_M) or agree(FINEST, BAND_M)

    def connected(self, *, stated: bool) -> bool:
        """Return whether the disc gets from start to goal; a tie within the band is as stated."""
        array = np.array(self.obstacles, dtype=object)
        near = shapely.union_all(shapely.buffer(array, KEEP_M, quad_segs=FINE))
        open_path = connected(self.start, self.goal, self.layout.free_area, near)
        if open_path == stated:
            return open_path
        blockers = np.array([*self.layout.blockers, *self.obstacles], dtype=object)
        for wider_m in (0.0, -BAND_M, BAND_M):
            solid = shapely.union_all(shapely.buffer(blockers, KEEP_M + wider_m, quad_segs=FINEST))
            if connected(self.start, self.goal, self.layout.outline, solid) == stated:
                return stated
        return open_path
