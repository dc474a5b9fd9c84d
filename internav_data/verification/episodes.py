"""Predicates of an episode's statement: ends, mode, paths, distances."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely import Point, Polygon

from internav_data.verification.ground import KEEP_M, SPACING_M
from internav_data.verification.obstacles import check_obstacles
from internav_data.verification.ways import FINE, FINEST, Sight, ellipse, grown, joined

if TYPE_CHECKING:
    from shapely import Geometry

    from internav_data.records import Episode, Goal, Start
    from internav_data.verification.findings import Collector
    from internav_data.verification.site import Site

LEAST_CLEAR_M = 2.0
AGREE = 0.0005
"""Any-angle distances agree with the visibility graph within this share …"""
AGREE_M = 0.001
"""… and this length. The format promises 1 %; the generator's own graph is exact."""
LOOK = 1.05
"""Ways longer than this share of what is stated need not be known closer."""
ROUNDED_M = 1e-4
"""Stored lengths are rounded to 0.1 mm."""
BAND_M = 5e-5
"""Where a radius this much larger or smaller changes the answer, either answer stands."""
NEAR_M = 0.5
"""What lies farther than this outside an ellipse of ways keeps no disc off them."""
YAWS_DEG = (0, 90, 180, 270)


def check_episode(site: Site, episode: Episode, report: Collector, *, exact: bool) -> None:
    """Judge every predicate of one episode; `exact` adds the finely cut visibility graph."""
    judge = _Judge(site, episode, report)
    if not judge.ends():
        return
    judge.paths()
    taken = check_obstacles(site, episode, report)
    if taken is None:
        return
    judge.steps(taken)
    judge.lengths(taken, exact=exact)


def _slack(length: float) -> float:
    return AGREE * length + AGREE_M


class _Judge:
    """One episode before its predicates."""

    def __init__(self, site: Site, episode: Episode, report: Collector) -> None:
        self.site = site
        self.episode = episode
        self.report = report
        self.start = site.ground.node(episode.start.i, episode.start.j)
        self.goal = site.ground.node(episode.goal.i, episode.goal.j)
        self.from_xy = (episode.start.x, episode.start.y)
        self.to_xy = (episode.goal.x, episode.goal.y)

    def expect(self, holds: object, predicate: str, expected: object, got: object) -> bool:
        return self.report.expect(
            holds, f"episode.{predicate}", expected, got, self.episode.episode_id
        )

    def ends(self) -> bool:
        """Judge start and goal; return whether distances between them mean anything."""
        site, episode = self.site, self.episode
        good = self._end("start", episode.start, self.start)
        good &= self._end("goal", episode.goal, self.goal)
        yaw = episode.start.yaw_deg
        self.expect(yaw in YAWS_DEG, "start-yaw", f"one of {YAWS_DEG}", yaw)
        if len(site.house.rooms) > 1:
            self.expect(
                episode.start.room != episode.goal.room,
                "rooms-differ",
                "start and goal in two rooms",
                f"both in {episode.start.room}",
            )
        if good:
            parts = [int(site.components[n]) for n in (self.start, self.goal)]
            good = self.expect(
                parts[0] == parts[1] == site.main_component,
                "same-component",
                f"both in component {site.main_component}",
                parts,
            )
        wanted = "blocked" if (site.house.scene + episode.index) % 2 == 0 else "lengthened"
        self.expect(episode.mode == wanted, "mode", wanted, episode.mode)
        self.expect(
            episode.room_count == len(site.house.rooms),
            "room-count",
            len(site.house.rooms),
            episode.room_count,
        )
        return good

    def _end(self, name: str, end: Start | Goal, node: int) -> bool:
        wanted = (end.i * SPACING_M, end.j * SPACING_M)
        good = self.expect((end.x, end.y) == wanted, f"{name}-node", wanted, (end.x, end.y))
        rooms = {r.room_id: r.polygon for r in self.site.house.rooms}
        if self.expect(end.room in rooms, f"{name}-room", f"one of {sorted(rooms)}", end.room):
            gap = Polygon(rooms[end.room]).distance(Point(end.x, end.y))
            self.expect(gap < ROUNDED_M, f"{name}-room", f"room {end.room}", f"{gap:.4f} m off it")
        else:
            good = False
        free = node >= 0 and bool(self.site.ground.clear.nodes[node])
        return self.expect(free, f"{name}-free", "a free node", (end.i, end.j)) and good

    def paths(self) -> None:
        """Judge room paths, node paths and rooms on the way."""
        episode = self.episode
        ends = (episode.start.room, episode.goal.room)
        paths, cut = self.site.room_paths(*ends)
        self.expect(episode.room_paths == paths, "room-paths", paths, episode.room_paths)
        self.expect(episode.room_paths_cut == cut, "room-paths-cut", cut, episode.room_paths_cut)
        least = len(paths[0]) if paths else 0
        self.expect(episode.rooms_on_way == least, "rooms-on-way", least, episode.rooms_on_way)
        doors, cut = self.site.door_paths(*ends)
        stored = tuple(path.doors for path in episode.node_paths)
        self.expect(stored == doors, "node-paths", doors, stored)
        self.expect(episode.node_paths_cut == cut, "node-paths-cut", cut, episode.node_paths_cut)
        centres = {door.door_id: (door.x, door.y) for door in self.site.house.doors}
        for path in episode.node_paths:
            if not set(path.doors) <= set(centres):
                continue
            points = (self.from_xy, *(centres[d] for d in path.doors), self.to_xy)
            self.expect(path.points == points, "node-path-points", points, path.points)

    def steps(self, taken: list[Geometry]) -> None:
        """Judge the lattice distances with and without obstacles."""
        site, episode = self.site, self.episode
        clear = site.ground.distances(self.goal, site.ground.clear)[self.start]
        free = site.ground.with_obstacles(taken)
        for name, node in (("start", self.start), ("goal", self.goal)):
            self.expect(free.nodes[node], f"{name}-uncovered", "no obstacle over it", "one")
        found = site.ground.distances(self.goal, free)[self.start]
        steps = int(found) if math.isfinite(found) else None
        self.expect(episode.clear_steps == clear, "clear-steps", clear, episode.clear_steps)
        self.expect(episode.steps == steps, "steps", steps, episode.steps)
        if episode.mode == "blocked":
            self.expect(steps is None, "blocked", "no way on the lattice", f"{steps} steps")
        else:
            longer = steps is not None and steps > clear
            self.expect(longer, "lengthened", f"more than {clear} steps", steps)

    def lengths(self, taken: list[Geometry], *, exact: bool) -> None:
        """Judge the any-angle distances with and without obstacles."""
        episode, site = self.episode, self.site
        straight = math.dist(self.from_xy, self.to_xy)
        self.expect(
            episode.clear_m >= LEAST_CLEAR_M, "clear-least", f"{LEAST_CLEAR_M} m", episode.clear_m
        )
        self._bounds("clear-m", episode.clear_m, straight, episode.clear_steps)
        self.expect(
            episode.sealed == (episode.way_m is None), "sealed-way", episode.sealed, episode.way_m
        )
        if self._agrees(site.sight, episode.clear_m) or self._second_look([], episode.clear_m):
            self.expect(True, "clear-m", "", "")  # noqa: FBT003 - counted
        else:
            self._report("clear-m", [], episode.clear_m)
        if episode.way_m is None:
            shut = not self._connected(taken)
            self.expect(shut, "sealed", "not sealed: the disc can pass", "sealed")
        else:
            self._bounds("way-m", episode.way_m, episode.clear_m, episode.steps)
            self._open_way(taken, episode.way_m)
        if exact:
            close = self._second_look([], episode.clear_m)
            self.expect(close, "clear-m-exact", "the finely cut graph's length", episode.clear_m)

    def _bounds(self, name: str, length: float, least: float, steps: int | None) -> None:
        low = length >= least - ROUNDED_M
        self.expect(low, f"{name}-bounds", f"at least {least:.4f} m", length)
        if steps is not None:
            most = steps * SPACING_M
            high = length <= most + ROUNDED_M
            self.expect(high, f"{name}-bounds", f"at most {most:.2f} m", length)

    def _length(self, sight: Sight, most: float) -> float:
        return sight.length(self.from_xy, self.to_xy, most)

    def _agrees(self, sight: Sight, stated: float) -> bool:
        found = self._length(sight, stated + _slack(stated))
        return abs(found - stated) <= _slack(stated)

    def _sight(self, taken: list[Geometry]) -> Sight:
        base = self.site.sight
        return Sight(base.base, grown(taken), base) if taken else base

    def _second_look(self, taken: list[Geometry], stated: float) -> bool:
        """Whether finely cut arcs, or ties within the band, agree with what is stated."""
        most = stated * LOOK + AGREE_M
        near = ellipse(self.from_xy, self.to_xy, most + NEAR_M)
        blockers = [b for b in (*self.site.blockers, *taken) if shapely.intersects(near, b)]

        def agrees(chords: int, slack_m: float) -> bool:
            sight = Sight(grown(blockers, chords, slack_m), portals=self.site.portals)
            return abs(self._length(sight, most) - stated) <= _slack(stated)

        # A gap as wide as the disc is open for the smaller disc and shut for the larger one.
        return agrees(FINE, 0.0) or agrees(FINEST, -BAND_M) or agrees(FINEST, BAND_M)

    def _report(self, name: str, taken: list[Geometry], stated: float) -> None:
        found = self._length(self._sight(taken), math.inf)
        self.expect(False, name, f"{found:.4f} m", stated)  # noqa: FBT003 - reached where it fails

    def _open_way(self, taken: list[Geometry], stated: float) -> None:
        sight = self._sight(taken)
        if self._agrees(sight, stated) or self._second_look(taken, stated):
            self.expect(True, "way-m", "", "")  # noqa: FBT003 - counted
        elif not self._connected(taken):
            self.expect(False, "sealed", "sealed: no way for the disc", f"{stated} m")  # noqa: FBT003
        else:
            self._report("way-m", taken, stated)

    def _connected(self, taken: list[Geometry]) -> bool:
        """Whether the disc gets from start to goal; ties within the band say what is stated."""
        array = np.array(taken, dtype=object)
        near = shapely.union_all(shapely.buffer(array, KEEP_M, quad_segs=FINE))
        way = joined(self.from_xy, self.to_xy, self.site.free, near)
        stated = self.episode.way_m is not None
        if way == stated:
            return way
        blockers = np.array([*self.site.blockers, *taken], dtype=object)
        for slack in (0.0, -BAND_M, BAND_M):
            solid = shapely.union_all(shapely.buffer(blockers, KEEP_M + slack, quad_segs=FINEST))
            if joined(self.from_xy, self.to_xy, self.site.outline, solid) == stated:
                return stated
        return way
