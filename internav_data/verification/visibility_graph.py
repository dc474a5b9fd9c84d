"""Euclidean distances derived again: a visibility graph of buffered shapely polygons.

The disc's centre keeps off every polygon inflated by the disc's radius (its configuration-space
obstacle; Lozano-Perez and Wesley 1979). Arcs of the inflated polygons are cut into chords, so a
length found here is a lower bound that misses by at most the chords' share (0.29 % of the arcs
alone at 6 chords a quarter, 0.04 % at 16). Only corners inside the ellipse of a stated length are
searched: that makes the check cheap.
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
"""Chords a quarter circle of the first graph."""
FINEST = 64
"""Chords a quarter circle for gaps as wide as the disc: the error is 0.02 mm."""
FINE = 16
"""Chords a quarter circle if the coarse graph and the data disagree."""
SKIN_M = 1e-5
"""Sight lines may touch: they are tested against polygons inflated by this much less."""
EPSILON_M2 = 1e-12
"""Bound of the rounding errors of products of lengths, m²."""
BATCH = 64
"""Maximum number of corners expanded together …"""
STEP_M = 2.0
"""… whose f-costs differ by no more than this."""
_UNKNOWN, _VISIBLE, _HIDDEN = 0, 1, 2
_END = -1


class InflatedPolygons:
    """Polygons inflated by the disc's radius: convex corners and the area that blocks sight.

    `corners`, `before` and `after` have the shape (n, 2): each corner and its neighbours on the
    outline, metres. `core` is the blocking area.
    """

    def __init__(
        self,
        polygons: Sequence[Geometry],
        radius_m: float,
        chords: int,
        interior: tuple[Polygon, Point] | None = None,
    ) -> None:
        array = np.array(polygons, dtype=object)
        outer: Geometry = shapely.union_all(shapely.buffer(array, radius_m, quad_segs=chords))
        # A union takes forty times as long as the rim of one.
        self.core = shapely.buffer(outer, -SKIN_M, quad_segs=chords)
        shapely.prepare(self.core)
        if interior is not None:
            outer = _enclosed(outer, *interior)
        corners: list[Floats] = []
        before: list[Floats] = []
        after: list[Floats] = []
        for part in shapely.get_parts(outer):
            # Exteriors counter-clockwise, holes clockwise: the blocked area lies on the left.
            for ring in shapely.get_rings(shapely.orient_polygons(part)):
                points = shapely.get_coordinates(ring)[:-1]
                previous, following = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
                bend = _cross(points - previous, following - points)
                # A shortest path bends round convex corners alone: others would shorten it.
                convex = bend > 0.0
                corners.append(points[convex])
                before.append(previous[convex])
                after.append(following[convex])
        self.corners = np.vstack([np.empty((0, 2)), *corners])
        self.before = np.vstack([np.empty((0, 2)), *before])
        self.after = np.vstack([np.empty((0, 2)), *after])

    def sight_blocked(self, first: Floats, second: Floats) -> Bools:
        """Return whether the lines between points (n, 2) and (n, 2) are blocked, shape (n,)."""
        lines = shapely.linestrings(np.stack([first, second], axis=1))
        return np.asarray(shapely.intersects(self.core, lines))


def _enclosed(occupied: Geometry, outline: Polygon, inside: Point) -> Geometry:
    """Return all area not connected to a point: corners there cannot be on paths from it."""
    for piece in shapely.get_parts(shapely.difference(outline, occupied)):
        if shapely.intersects(piece, inside):
            return cast("Geometry", shapely.difference(outline.buffer(1.0), piece))
    return occupied


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


class VisibilityGraph:
    """Visibility graph of one or two sets of inflated polygons; edges are tested lazily."""

    def __init__(
        self,
        base: InflatedPolygons,
        extra: InflatedPolygons | None = None,
        parent: VisibilityGraph | None = None,
        portals: Portals | None = None,
    ) -> None:
        self.base = base
        self.extra = extra
        self._base_count = len(base.corners)
        self.corners, self._before, self._after = base.corners, base.before, base.after
        if extra is not None:
            self.corners = np.vstack([base.corners, extra.corners])
            self._before = np.vstack([base.before, extra.before])
            self._after = np.vstack([base.after, extra.after])
        self._alive = self._exposed()
        self.portals: Portals | None = portals if parent is None else parent.portals
        if parent is None:
            # Visibility among walls and furniture alone is shared by all episodes of a scene.
            self.known_sights = np.full(
                (self._base_count, self._base_count), _UNKNOWN, dtype=np.int8
            )
            self.located = [] if portals is None else [portals.located(base.corners)]
        else:
            self.known_sights, self.located = parent.known_sights, parent.located[:1]
        if extra is not None and self.portals is not None:
            self.located = [*self.located, self.portals.located(extra.corners)]

    def _exposed(self) -> Bools:
        """Mask (n,) of the corners outside the other set."""
        alive = np.ones(len(self.corners), dtype=np.bool_)
        if self.extra is not None:
            base, own = self.base, self.extra
            alive[: self._base_count] = ~shapely.intersects_xy(own.core, *base.corners.T)
            alive[self._base_count :] = ~shapely.intersects_xy(base.core, *own.corners.T)
        return alive

    def _lower_bound(self, target: Floats) -> Floats:
        """Lower bound of the path from every corner to a point, metres, shape (n,)."""
        if self.portals is None:
            return np.asarray(np.hypot(*(self.corners - target).T))
        return np.concatenate(
            [self.portals.lower_bound(located, target) for located in self.located]
        )

    def length(
        self, start: tuple[float, float], goal: tuple[float, float], max_length: float
    ) -> float:
        """Return the length of the shortest path, metres, inf if longer than `max_length`."""
        origin, target = np.array(start), np.array(goal)
        if not self.base.sight_blocked(origin[None], target[None])[0] and (
            self.extra is None or not self.extra.sight_blocked(origin[None], target[None])[0]
        ):
            return math.dist(start, goal)
        heuristic = self._lower_bound(target)
        pool = np.flatnonzero(self._alive & (self._lower_bound(origin) + heuristic <= max_length))
        search = _AStar(
            ids=np.concatenate([[_END], pool, [_END]]),
            points=np.vstack([origin, self.corners[pool], target]),
            # Ends have no neighbours: any line may leave or reach them.
            before=np.pad(self._before[pool] - self.corners[pool], ((1, 1), (0, 0))),
            after=np.pad(self._after[pool] - self.corners[pool], ((1, 1), (0, 0))),
            heuristic=np.concatenate([[math.dist(start, goal)], heuristic[pool], [0.0]]),
        )
        return search.run(self._visible, max_length)

    def _visible(self, search: _AStar, first: Ints, second: Ints) -> Bools:
        """Return whether pairs of a search's points see each other, shape (n,)."""
        a, b = search.ids[first], search.ids[second]
        state = np.full(len(a), _UNKNOWN, dtype=np.int8)
        own = (a >= 0) & (a < self._base_count) & (b >= 0) & (b < self._base_count)
        state[own] = self.known_sights[a[own], b[own]]
        ask = np.flatnonzero(state == _UNKNOWN)
        if len(ask):
            hidden = self.base.sight_blocked(search.points[first[ask]], search.points[second[ask]])
            state[ask] = np.where(hidden, _HIDDEN, _VISIBLE)
            kept = ask[own[ask]]
            self.known_sights[a[kept], b[kept]] = self.known_sights[b[kept], a[kept]] = state[kept]
        visible: Bools = state == _VISIBLE
        if self.extra is not None:
            ask = np.flatnonzero(visible)
            visible[ask] = ~self.extra.sight_blocked(
                search.points[first[ask]], search.points[second[ask]]
            )
        return visible


@dataclass(frozen=True, slots=True)
class _AStar:
    """A* that expands several corners at a time; the start is point 0, the goal the last one."""

    ids: Ints
    """Numbers of the corners, -1 for start and goal, shape (n,)."""
    points: Floats
    """Positions, shape (n, 2), metres."""
    before: Floats
    after: Floats
    """Vectors from each corner to its neighbours on the outline, shape (n, 2), metres."""
    heuristic: Floats
    """Lower bound of the path to the goal, shape (n,), metres."""

    def run(self, sees: Callable[[_AStar, Ints, Ints], Bools], max_length: float) -> float:
        """Return the length of the shortest path, inf if longer than `max_length`."""
        goal = len(self.ids) - 1
        best = np.full(len(self.ids), np.inf)
        best[0] = 0.0
        waiting = np.zeros(len(self.ids), dtype=np.bool_)
        waiting[0] = True
        while True:
            waiting[goal] = False
            estimate = np.where(waiting, best + self.heuristic, np.inf)
            lowest = float(estimate.min())
            if lowest >= min(float(best[goal]), max_length + EPSILON_M2):
                return float(best[goal])
            # Several at once: a corner that is reached by a shorter path later is queued again.
            batch = np.argsort(estimate, kind="stable")[:BATCH]
            batch = batch[estimate[batch] <= lowest + STEP_M]
            waiting[batch] = False
            first, second, length = self._candidates(
                batch, best, min(max_length, float(best[goal]))
            )
            visible = sees(self, first, second)
            second, length = second[visible], length[visible]
            before = best[second]
            np.minimum.at(best, second, length)
            waiting[second[best[second] < before]] = True

    def _candidates(
        self, batch: Ints, best: Floats, max_length: float
    ) -> tuple[Ints, Ints, Floats]:
        """Pairs (of the batch, of all points) that may shorten a path, and its length."""
        x, y = self.points.T
        dx, dy = x - x[batch, None], y - y[batch, None]
        ahead = best[batch, None] + np.sqrt(dx * dx + dy * dy)
        with np.errstate(invalid="ignore"):  # no goal in reach of a point: NaN, never less
            limit = np.minimum(best - EPSILON_M2, max_length - self.heuristic)
        k, second = np.nonzero(ahead < limit)
        rays = np.column_stack([dx[k, second], dy[k, second]])
        touch = np.ones(len(k), dtype=np.bool_)
        for corner in (second, batch[k]):
            # A path touches a corner without cutting in: its neighbours lie on one side.
            sides = _cross(rays, self.before[corner]) * _cross(rays, self.after[corner])
            touch &= sides >= -EPSILON_M2
        k, second = k[touch], second[touch]
        return batch[k], second, ahead[k, second]


def inflate(
    polygons: Sequence[Geometry],
    chords: int = COARSE,
    slack_m: float = 0.0,
    interior: tuple[Polygon, Point] | None = None,
) -> InflatedPolygons:
    """Inflate polygons by the disc's radius (plus a slack, metres).

    With `interior`, a house's outline and a free point in it, corners that the disc cannot reach
    from that point are left out.
    """
    return InflatedPolygons(polygons, KEEP_M + slack_m, chords, interior)


def path_ellipse(first: tuple[float, float], second: tuple[float, float], length: float) -> Polygon:
    """Return a polygon around all paths of at most `length` between two points, metres."""
    straight = math.dist(first, second)
    long, short = length / 2.0, math.sqrt(max(0.0, length * length - straight * straight)) / 2.0
    heading = math.atan2(second[1] - first[1], second[0] - first[0])
    middle = ((first[0] + second[0]) / 2.0, (first[1] + second[1]) / 2.0)
    # Around, not inside: the sides of a 32-gon pass at 0.995 of its radius.
    turns = np.linspace(0.0, 2.0 * math.pi, 32, endpoint=False)
    u, v = 1.005 * long * np.cos(turns), 1.005 * short * np.sin(turns)
    c, s = math.cos(heading), math.sin(heading)
    return Polygon(np.column_stack([middle[0] + c * u - s * v, middle[1] + s * u + c * v]))


def connected(
    start: tuple[float, float], goal: tuple[float, float], free: Geometry, occupied: Geometry
) -> bool:
    """Return whether start and goal lie in one piece of `free` without `occupied`."""
    ends = shapely.points([start, goal])
    pieces = shapely.get_parts(shapely.difference(free, occupied))
    return any(shapely.intersects(piece, ends).all() for piece in pieces)
