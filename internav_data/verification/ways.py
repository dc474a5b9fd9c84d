"""Any-angle distances, derived again: a visibility graph of buffered shapely polygons.

The disc's centre keeps off every polygon grown by the disc's radius. Arcs of the grown polygons
are cut into chords, so a length found here is a lower bound that misses by at most the chords'
share (0.29 % of the arcs alone at 6 chords a quarter, 0.04 % at 16). Only what lies inside the
ellipse of a claimed length is looked at: that is what makes the check cheap.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

import numpy as np
import shapely
from shapely import Polygon

from internav_data.verification.checked_lattice import KEEP_M

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from shapely import Geometry, Point

    from internav_data.core.typing import Bools, Floats, Ints
    from internav_data.verification.portals import Portals

COARSE = 6
"""Chords a quarter circle at first."""
FINEST = 64
"""Chords a quarter circle for gaps as wide as the disc: 0.02 mm off on arcs."""
FINE = 16
"""Chords a quarter circle where the coarse graph and the data disagree."""
SKIN_M = 1e-5
"""Sight lines may touch: they are tested against polygons grown by this much less."""
NOTHING = 1e-12
"""Rounding errors of products of lengths stay below, m²."""
BATCH = 64
"""Corners looked at together …"""
STEP_M = 2.0
"""… when their estimates differ by no more than this."""
_UNKNOWN, _SEEN, _HIDDEN = 0, 1, 2
_END = -1


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

    def hides(self, first: Floats, second: Floats) -> Bools:
        """Whether the sight lines between points (n, 2) and (n, 2) are blocked, shape (n,)."""
        lines = shapely.linestrings(np.stack([first, second], axis=1))
        return np.asarray(shapely.intersects(self.core, lines))


def _walled(taken: Geometry, outline: Polygon, inside: Point) -> Geometry:
    """Return all that is not in one piece with a point: corners beyond cannot be on its ways."""
    for piece in shapely.get_parts(shapely.difference(outline, taken)):
        if shapely.intersects(piece, inside):
            return cast("Geometry", shapely.difference(outline.buffer(1.0), piece))
    return taken


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


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
            # What walls and furniture alone hide is shared by all episodes of a scene.
            self.sights = np.full((self._split, self._split), _UNKNOWN, dtype=np.int8)
            self.spots = [] if portals is None else [portals.spots(base.corners)]
        else:
            self.sights, self.spots = parent.sights, parent.spots[:1]
        if extra is not None and self.portals is not None:
            self.spots = [*self.spots, self.portals.spots(extra.corners)]

    def _above_ground(self) -> Bools:
        """Corners that the other set does not bury."""
        alive = np.ones(len(self.corners), dtype=np.bool_)
        if self.extra is not None:
            base, own = self.base, self.extra
            alive[: self._split] = ~shapely.intersects_xy(own.core, *base.corners.T)
            alive[self._split :] = ~shapely.intersects_xy(base.core, *own.corners.T)
        return alive

    def _least(self, target: Floats) -> Floats:
        """Lower bound of the way from every corner to a point, metres, shape (n,)."""
        if self.portals is None:
            return np.asarray(np.hypot(*(self.corners - target).T))
        return np.concatenate([self.portals.least(spots, target) for spots in self.spots])

    def length(self, start: tuple[float, float], goal: tuple[float, float], most: float) -> float:
        """Length of the shortest way, metres, inf where it is longer than `most`."""
        origin, target = np.array(start), np.array(goal)
        if not self.base.hides(origin[None], target[None])[0] and (
            self.extra is None or not self.extra.hides(origin[None], target[None])[0]
        ):
            return math.dist(start, goal)
        left = self._least(target)
        pool = np.flatnonzero(self._alive & (self._least(origin) + left <= most))
        search = _Search(
            ids=np.concatenate([[_END], pool, [_END]]),
            points=np.vstack([origin, self.corners[pool], target]),
            # Ends have no neighbours: any line may leave or reach them.
            before=np.pad(self._before[pool] - self.corners[pool], ((1, 1), (0, 0))),
            after=np.pad(self._after[pool] - self.corners[pool], ((1, 1), (0, 0))),
            left=np.concatenate([[math.dist(start, goal)], left[pool], [0.0]]),
        )
        return search.run(self._seen, most)

    def _seen(self, search: _Search, first: Ints, second: Ints) -> Bools:
        """Whether pairs of a search's points see each other, shape (n,)."""
        a, b = search.ids[first], search.ids[second]
        state = np.full(len(a), _UNKNOWN, dtype=np.int8)
        own = (a >= 0) & (a < self._split) & (b >= 0) & (b < self._split)
        state[own] = self.sights[a[own], b[own]]
        ask = np.flatnonzero(state == _UNKNOWN)
        if len(ask):
            hidden = self.base.hides(search.points[first[ask]], search.points[second[ask]])
            state[ask] = np.where(hidden, _HIDDEN, _SEEN)
            kept = ask[own[ask]]
            self.sights[a[kept], b[kept]] = self.sights[b[kept], a[kept]] = state[kept]
        seen: Bools = state == _SEEN
        if self.extra is not None:
            ask = np.flatnonzero(seen)
            seen[ask] = ~self.extra.hides(search.points[first[ask]], search.points[second[ask]])
        return seen


@dataclass(slots=True)
class _Search:
    """A*, some corners at a time: the start is point 0, the goal the last one."""

    ids: Ints
    """Numbers of the corners, -1 for start and goal."""
    points: Floats
    before: Floats
    after: Floats
    """From each corner to its neighbours on the outline, metres."""
    left: Floats
    """Lower bound of what is left to the goal."""

    def run(self, seen: Callable[[_Search, Ints, Ints], Bools], most: float) -> float:
        """Return the length of the shortest way, inf where it is longer than `most`."""
        goal = len(self.ids) - 1
        best = np.full(len(self.ids), np.inf)
        best[0] = 0.0
        waiting = np.zeros(len(self.ids), dtype=np.bool_)
        waiting[0] = True
        while True:
            waiting[goal] = False
            estimate = np.where(waiting, best + self.left, np.inf)
            lowest = float(estimate.min())
            if lowest >= min(float(best[goal]), most + NOTHING):
                return float(best[goal])
            # Several at once: a corner whose way turns out longer than need be waits again.
            batch = np.argsort(estimate, kind="stable")[:BATCH]
            batch = batch[estimate[batch] <= lowest + STEP_M]
            waiting[batch] = False
            first, second, length = self._candidates(batch, best, min(most, float(best[goal])))
            visible = seen(self, first, second)
            second, length = second[visible], length[visible]
            before = best[second]
            np.minimum.at(best, second, length)
            waiting[second[best[second] < before]] = True

    def _candidates(self, batch: Ints, best: Floats, most: float) -> tuple[Ints, Ints, Floats]:
        """Pairs (of the batch, of all points) worth a look, and how long the way is with them."""
        rays = self.points[None, :, :] - self.points[batch][:, None, :]
        ahead = best[batch][:, None] + np.sqrt(rays[..., 0] ** 2 + rays[..., 1] ** 2)
        useful = (ahead < best - NOTHING) & (ahead + self.left <= most)
        k, second = np.nonzero(useful)
        rays = rays[k, second]
        touch = np.ones(len(k), dtype=np.bool_)
        for corner in (second, batch[k]):
            # A way touches a corner without cutting in: its neighbours lie on one side.
            sides = _cross(rays, self.before[corner]) * _cross(rays, self.after[corner])
            touch &= sides >= -NOTHING
        k, second = k[touch], second[touch]
        return batch[k], second, ahead[k, second]


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
