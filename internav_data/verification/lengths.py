"""Whether a stated any-angle length is the true one, for things as they lie."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from internav_data.verification.checked_lattice import KEEP_M
from internav_data.verification.ways import FINE, FINEST, Sight, ellipse, grown, joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from shapely import Geometry

    from internav_data.verification.checked_layout import CheckedLayout

AGREE = 0.0005
"""Any-angle distances agree with the visibility graph within this share …"""
AGREE_M = 0.001
"""… and this length. The format promises 1 %; the generator's own graph is exact."""
LOOK = 1.05
"""Ways longer than this share of what is stated need not be known closer."""
BAND_M = 5e-5
"""Where a radius this much larger or smaller changes the answer, either answer stands."""
NEAR_M = 0.5
"""What lies farther than this outside an ellipse of ways keeps no disc off them."""


def slack(length: float) -> float:
    """Return how far from the truth a length may be, metres."""
    return AGREE * length + AGREE_M


@dataclass(frozen=True, slots=True)
class Between:
    """Two points of a house, and what is between them beyond the house: footprints `taken`."""

    site: CheckedLayout
    here: tuple[float, float]
    there: tuple[float, float]
    taken: Sequence[Geometry] = ()

    def length(self, most: float = math.inf) -> float:
        """Length of the shortest way, arcs cut coarsely, metres; inf where longer than `most`."""
        base = self.site.sight
        sight = Sight(base.base, grown(self.taken), base) if self.taken else base
        return sight.length(self.here, self.there, most)

    def agrees(self, stated: float) -> bool:
        """Whether a stated length is that of the shortest way."""
        found = self.length(stated + slack(stated))
        return abs(found - stated) <= slack(stated) or self.agrees_exactly(stated)

    def agrees_exactly(self, stated: float) -> bool:
        """Whether finely cut arcs, or ties within the band, agree with what is stated."""
        most = stated * LOOK + AGREE_M
        near = ellipse(self.here, self.there, most + NEAR_M)
        blockers = [b for b in (*self.site.blockers, *self.taken) if shapely.intersects(near, b)]

        def agree(chords: int, wider_m: float) -> bool:
            sight = Sight(grown(blockers, chords, wider_m), portals=self.site.portals)
            return abs(sight.length(self.here, self.there, most) - stated) <= slack(stated)

        # A gap as wide as the disc is open for the smaller disc and shut for the larger one.
        return agree(FINE, 0.0) or agree(FINEST, -BAND_M) or agree(FINEST, BAND_M)

    def connected(self, *, stated: bool) -> bool:
        """Whether the disc gets from here to there; ties within the band say what is stated."""
        array = np.array(self.taken, dtype=object)
        near = shapely.union_all(shapely.buffer(array, KEEP_M, quad_segs=FINE))
        way = joined(self.here, self.there, self.site.free, near)
        if way == stated:
            return way
        blockers = np.array([*self.site.blockers, *self.taken], dtype=object)
        for wider_m in (0.0, -BAND_M, BAND_M):
            solid = shapely.union_all(shapely.buffer(blockers, KEEP_M + wider_m, quad_segs=FINEST))
            if joined(self.here, self.there, self.site.outline, solid) == stated:
                return stated
        return way
