"""Predicates of an episode's statement: ends, mode, paths, distances."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from shapely import Point, Polygon

from internav_data.verification.checked_lattice import SPACING_M
from internav_data.verification.lengths import Between
from internav_data.verification.obstacles import check_obstacles

if TYPE_CHECKING:
    from shapely import Geometry

    from internav_data.records import Episode, Goal, Start
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.verification.findings import FindingCollector

LEAST_CLEAR_M = 2.0
ROUNDED_M = 1e-4
"""Stored lengths are rounded to 0.1 mm."""
YAWS_DEG = (0, 90, 180, 270)


def check_episode(
    site: CheckedLayout, episode: Episode, report: FindingCollector, *, exact: bool
) -> bool:
    """Judge every predicate of one episode; `exact` adds the finely cut visibility graph.

    Returns
    -------
    bool
        Whether all of them hold.

    """
    before = sum(report.by_predicate.values())
    judge = _Judge(site, episode, report)
    if judge.ends():
        judge.paths()
        taken = check_obstacles(site, episode, report)
        if taken is not None:
            judge.steps(taken)
            judge.lengths(taken, exact=exact)
    return sum(report.by_predicate.values()) == before


class _Judge:
    """One episode before its predicates."""

    def __init__(self, site: CheckedLayout, episode: Episode, report: FindingCollector) -> None:
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
        self.expect(
            episode.room_paths_truncated == cut, "room-paths-cut", cut, episode.room_paths_truncated
        )
        least = len(paths[0]) if paths else 0
        self.expect(episode.rooms_on_path == least, "rooms-on-way", least, episode.rooms_on_path)
        doors, cut = self.site.door_paths(*ends)
        stored = tuple(path.doors for path in episode.node_paths)
        self.expect(stored == doors, "node-paths", doors, stored)
        self.expect(
            episode.node_paths_truncated == cut, "node-paths-cut", cut, episode.node_paths_truncated
        )
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
        self.expect(
            episode.shortest_path_steps == clear, "clear-steps", clear, episode.shortest_path_steps
        )
        self.expect(
            episode.obstructed_path_steps == steps, "steps", steps, episode.obstructed_path_steps
        )
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
            episode.shortest_path_m >= LEAST_CLEAR_M,
            "clear-least",
            f"{LEAST_CLEAR_M} m",
            episode.shortest_path_m,
        )
        self._bounds("clear-m", episode.shortest_path_m, straight, episode.shortest_path_steps)
        self.expect(
            episode.sealed == (episode.obstructed_path_m is None),
            "sealed-way",
            episode.sealed,
            episode.obstructed_path_m,
        )
        clear = Between(site, self.from_xy, self.to_xy)
        agrees = clear.agrees(episode.shortest_path_m)
        found = episode.shortest_path_m if agrees else f"{clear.length():.4f} m"
        self.expect(agrees, "clear-m", found, episode.shortest_path_m)
        way = Between(site, self.from_xy, self.to_xy, taken)
        if episode.obstructed_path_m is None:
            shut = not way.connected(stated=False)
            self.expect(shut, "sealed", "not sealed: the disc can pass", "sealed")
        else:
            self._bounds(
                "way-m",
                episode.obstructed_path_m,
                episode.shortest_path_m,
                episode.obstructed_path_steps,
            )
            self._open_way(way, episode.obstructed_path_m)
        if exact:
            close = clear.agrees_exactly(episode.shortest_path_m)
            self.expect(
                close, "clear-m-exact", "the finely cut graph's length", episode.shortest_path_m
            )

    def _bounds(self, name: str, length: float, least: float, steps: int | None) -> None:
        low = length >= least - ROUNDED_M
        self.expect(low, f"{name}-bounds", f"at least {least:.4f} m", length)
        if steps is not None:
            most = steps * SPACING_M
            high = length <= most + ROUNDED_M
            self.expect(high, f"{name}-bounds", f"at most {most:.2f} m", length)

    def _open_way(self, way: Between, stated: float) -> None:
        if way.agrees(stated):
            self.expect(True, "way-m", "", "")  # noqa: FBT003 - counted
        elif not way.connected(stated=True):
            self.expect(False, "sealed", "sealed: no way for the disc", f"{stated} m")  # noqa: FBT003
        else:
            self.expect(False, "way-m", f"{way.length():.4f} m", stated)  # noqa: FBT003
