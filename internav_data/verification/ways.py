"""Any-angle distances, derived again: a visibility graph of buffered shapely polygons.

The disc's centre keeps off every polygon grown by the disc's radius. Arcs of the grown polygons
are cut into chords, so a length found here is a lower bound that misses by at most the chords'
share (0.29 % of the arcs alone at 6 chords a quarter, 0.04 % at 16). Only what lies inside the
ellipse of a claimed length is looked at: that is what makes the check cheap.
"""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING, cast

import numpy as np
import shapely
from shapely import Polygon

from internav_data.verification.ground import KEEP_M

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from shapely import Geometry, Point

    from internav_data.verification.portals import Portals

    Floats = NDArray[np.float64]
    Ints = NDArray[np.int64]

COARSE = 6
"""Chords a quarter circle at first."""
FINE = 16
"""Chords a quarter circle where the coarse graph and the data disagree."""
SKIN_M = 1e-5
"""Sight lines may touch: they are tested against polygons grown by this much less."""
NOTHING = 1e-12
"""Rounding errors of products of lengths stay below, m²."""
_UNKNOWN, _SEEN, _HIDDEN = 0, 1, 2


class Grown:
    """Polygons grown by the disc's radius: their convex corners, and what blocks sight lines.

    Shapes: corners (n, 2), before (n, 2), after (n, 2): each corner and its neighbours on the
    outline, metres.
    """

    def __init__(
        self,
        polygons: Sequence[Geometry],
        radius_m: float,
        chords: int,
        ground: tuple[Polygon, Point] | None = None,
    ) -> None:
        array = np.array(polygons, dtype=object)
        outer: Geometry = shapely.union_all(shapely.buffer(array, radius_m, quad_segs=chords))
        self.core = shapely.union_all(shapely.buffer(array, radius_m - SKIN_M, quad_segs=chords))
        shapely.prepare(self.core)
        if ground is not None:
            outer = _walled(outer, *ground)
        corners: list[Floats] = []
        before: list[Floats] = []
        after: list[Floats] = []
        for part in shapely.get_parts(outer):
            # Exteriors counter-clockwise, holes clockwise: what is blocked lies on the left.
            for ring in shapely.get_rings(shapely.orient_polygons(part)):
                points = shapely.get_coordinates(ring)[:-1]
                previous, following = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
                bend = _cross(points - previous, following - points)
                convex = bend > 0.0
                corners.append(points[convex])
                before.append(previous[convex])
                after.append(following[convex])
        self.corners = np.vstack([np.empty((0, 2)), *corners])
        self.before = np.vstack([np.empty((0, 2)), *before])
        self.after = np.vstack([np.empty((0, 2)), *after])

    def hides(self, origin: Floats, targets: Floats) -> NDArray[np.bool_]:
        """Whether the sight line from a point (2,) to each target (n, 2) is blocked."""
        ends = np.stack([np.broadcast_to(origin, targets.shape), targets], axis=1)
        return np.asarray(shapely.intersects(self.core, shapely.linestrings(ends)))


def _walled(taken: Geometry, outline: Polygon, inside: Point) -> Geometry:
    """Return all that is not in one piece with a point: corners beyond cannot be on its ways."""
    for piece in shapely.get_parts(shapely.difference(outline, taken)):
        if shapely.intersects(piece, inside):
            return cast("Geometry", shapely.difference(outline.buffer(1.0), piece))
    return taken


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _tangent(rays: Floats, corners: Floats, before: Floats, after: Floats) -> NDArray[np.bool_]:
    """Whether lines along `rays` touch their corners without cutting in: neighbours on one side."""
    return np.asarray(_cross(rays, before - corners) * _cross(rays, after - corners) >= -NOTHING)


class Sight:
    """Shortest ways round one set of grown polygons, with rows of the graph worked out lazily."""

    def __init__(
        self,
        base: Grown,
        extra: Grown | None = None,
        parent: Sight | None = None,
        portals: Portals | None = None,
    ) -> None:
        self.base = base
        self.extra = extra
        self._split = len(base.corners)
        self.corners, self._before, self._after = base.corners, base.before, base.after
        if extra is not None:
            self.corners = np.vstack([base.corners, extra.corners])
            self._before = np.vstack([base.before, extra.before])
            self._after = np.vstack([base.after, extra.after])
        self._alive = self._above_ground()
        self.portals: Portals | None = portals if parent is None else parent.portals
        if parent is None:
            # What the walls and furniture alone hide is shared by all episodes of a scene.
            self.rows: dict[int, NDArray[np.int8]] = {}
            self.spots = [] if portals is None else [portals.spots(base.corners)]
        else:
            self.rows, self.spots = parent.rows, parent.spots[:1]
        if extra is not None and self.portals is not None:
            self.spots = [*self.spots, self.portals.spots(extra.corners)]

    def _least(self, target: Floats) -> Floats:
        """Lower bound of the way from every corner to a point, metres, shape (n,)."""
        if self.portals is None:
            return np.asarray(np.hypot(*(self.corners - target).T))
        return np.concatenate([self.portals.least(spots, target) for spots in self.spots])

    def _above_ground(self) -> NDArray[np.bool_]:
        """Corners that the other set does not bury."""
        alive = np.ones(len(self.corners), dtype=np.bool_)
        if self.extra is not None:
            base, own = self.base, self.extra
            alive[: self._split] = ~shapely.intersects_xy(own.core, *base.corners.T)
            alive[self._split :] = ~shapely.intersects_xy(base.core, *own.corners.T)
        return alive

    def _visible(self, origin: Floats, number: int, wanted: Ints) -> Ints:
        """Return which of the wanted corners can be seen from a point (number: its own or -1)."""
        rays = self.corners[wanted] - origin
        touch = _tangent(rays, self.corners[wanted], self._before[wanted], self._after[wanted])
        if number >= 0:
            touch &= _tangent(rays, self.corners[number], self._before[number], self._after[number])
        wanted = wanted[touch]
        if 0 <= number < self._split:
            wanted = self._cached(origin, number, wanted)
        elif len(wanted):
            wanted = wanted[~self.base.hides(origin, self.corners[wanted])]
        if self.extra is not None and len(wanted):
            wanted = wanted[~self.extra.hides(origin, self.corners[wanted])]
        return wanted

    def _cached(self, origin: Floats, number: int, wanted: Ints) -> Ints:
        """Like `hides` of the base alone, remembering what was asked about its own corners."""
        row = self.rows.get(number)
        if row is None:
            row = self.rows[number] = np.zeros(self._split, dtype=np.int8)
        own, others = wanted[wanted < self._split], wanted[wanted >= self._split]
        ask = own[row[own] == _UNKNOWN]
        if len(ask):
            hidden = self.base.hides(origin, self.corners[ask])
            row[ask] = np.where(hidden, _HIDDEN, _SEEN)
        seen = own[row[own] == _SEEN]
        if len(others):
            others = others[~self.base.hides(origin, self.corners[others])]
        return np.concatenate([seen, others])

    def _sees(self, a: Floats, b: Floats) -> bool:
        blocked = self.base.hides(a, b[None, :])[0]
        if not blocked and self.extra is not None:
            blocked = self.extra.hides(a, b[None, :])[0]
        return not blocked

    def length(self, start: tuple[float, float], goal: tuple[float, float], most: float) -> float:
        """Length of the shortest way, metres, inf where it is longer than `most` (A*)."""
        origin, target = np.array(start), np.array(goal)
        if self._sees(origin, target):
            return float(math.dist(start, goal))
        left = self._least(target)
        pool = np.flatnonzero(self._alive & (self._least(origin) + left <= most))
        # The goal is seen from few corners: ask once, from the goal.
        last = set(self._visible(target, -1, pool).tolist())
        best = np.full(len(self.corners), np.inf)
        heap: list[tuple[float, int]] = [(math.dist(start, goal), -1)]
        closed: set[int] = set()
        while heap:
            estimate, number = heapq.heappop(heap)
            if number == len(self.corners):
                return estimate
            if number in closed:
                continue
            closed.add(number)
            here = origin if number < 0 else self.corners[number]
            gone = 0.0 if number < 0 else float(best[number])
            if number in last:
                whole = gone + math.dist(here, goal)
                if whole <= most:
                    heapq.heappush(heap, (whole, len(self.corners)))
            ahead = gone + np.hypot(*(self.corners[pool] - here).T)
            useful = (ahead < best[pool] - NOTHING) & (ahead + left[pool] <= most)
            wanted = pool[useful & (pool != number)]
            if len(wanted) == 0:
                continue
            wanted = self._visible(here, number, wanted)
            reached = gone + np.hypot(*(self.corners[wanted] - here).T)
            best[wanted] = np.minimum(best[wanted], reached)
            for k, distance in zip(wanted.tolist(), reached.tolist(), strict=True):
                heapq.heappush(heap, (distance + float(left[k]), k))
        return math.inf


def grown(
    polygons: Sequence[Geometry],
    chords: int = COARSE,
    slack_m: float = 0.0,
    ground: tuple[Polygon, Point] | None = None,
) -> Grown:
    """Grow polygons by the disc's radius (plus a slack, metres).

    `ground` is a house's outline and a point where the disc can be: then corners that it cannot
    get to are left out.
    """
    return Grown(polygons, KEEP_M + slack_m, chords, ground)


def ellipse(first: tuple[float, float], second: tuple[float, float], length: float) -> Polygon:
    """Return all points on ways of at most `length` between two points (a polygon around them)."""
    straight = math.dist(first, second)
    long, short = length / 2.0, math.sqrt(max(0.0, length * length - straight * straight)) / 2.0
    heading = math.atan2(second[1] - first[1], second[0] - first[0])
    middle = ((first[0] + second[0]) / 2.0, (first[1] + second[1]) / 2.0)
    # Around, not inside: the sides of a 32-gon pass at 0.995 of its radius.
    turns = np.linspace(0.0, 2.0 * math.pi, 32, endpoint=False)
    u, v = 1.005 * long * np.cos(turns), 1.005 * short * np.sin(turns)
    c, s = math.cos(heading), math.sin(heading)
    return Polygon(np.column_stack([middle[0] + c * u - s * v, middle[1] + s * u + c * v]))


def joined(
    start: tuple[float, float], goal: tuple[float, float], free: Geometry, taken: Geometry
) -> bool:
    """Whether start and goal lie in one piece of `free` once `taken` is cut out of it."""
    ends = shapely.points([start, goal])
    pieces = shapely.get_parts(shapely.difference(free, taken))
    return any(shapely.intersects(piece, ends).all() for piece in pieces)
