"""Predicates of an episode: start and goal, mode, paths, distances."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from shapely import Point, Polygon

from internav_data.verification.checked_lattice import SPACING_M
from internav_data.verification.checked_path import CheckedPath
from internav_data.verification.obstacles import check_obstacles
from internav_data.verification.relevance import Removals, check_relevance

if TYPE_CHECKING:
    from shapely import Geometry

    from internav_data.records import Episode, Goal, Start
    from internav_data.verification.checked_lattice import FreeSpace
    from internav_data.verification.checked_layout import CheckedLayout
    from internav_data.verification.findings import FindingCollector

MIN_SHORTEST_PATH_M = 2.0
ROUNDED_M = 1e-4
"""Stored lengths are rounded to 0.1 mm."""
YAWS_DEG = (0, 90, 180, 270)
AHEAD = ((1, 0), (0, 1), (-1, 0), (0, -1))
"""Step ahead by heading, in the order of `YAWS_DEG`."""


def check_episode(
    layout: CheckedLayout, episode: Episode, report: FindingCollector, *, exact: bool
) -> bool:
    """Check every predicate of one episode; `exact` adds the finely cut visibility graph.

    Returns
    -------
    bool
        Whether all of them hold.

    """
    before = sum(report.by_predicate.values())
    check = _EpisodeCheck(layout, episode, report)
    if check.ends():
        check.paths()
        footprints = check_obstacles(layout, episode, report)
        if footprints is not None:
            check.steps(footprints)
            check.lengths([plan for plans in footprints for plan in plans], exact=exact)
    return sum(report.by_predicate.values()) == before


class _EpisodeCheck:
    """Check of one episode."""

    def __init__(self, layout: CheckedLayout, episode: Episode, report: FindingCollector) -> None:
        self.layout = layout
        self.episode = episode
        self.report = report
        self.start = layout.lattice.node(episode.start.i, episode.start.j)
        self.goal = layout.lattice.node(episode.goal.i, episode.goal.j)
        self.from_xy = (episode.start.x, episode.start.y)
        self.to_xy = (episode.goal.x, episode.goal.y)

    def expect(self, holds: object, predicate: str, expected: object, got: object) -> bool:
        return self.report.expect(
            holds, f"episode.{predicate}", expected, got, self.episode.episode_id
        )

    def ends(self) -> bool:
        """Check start and goal; return whether distances between them are defined."""
        layout, episode = self.layout, self.episode
        good = self._end("start", episode.start, self.start)
        good &= self._end("goal", episode.goal, self.goal)
        yaw = episode.start.yaw_deg
        self.expect(yaw in YAWS_DEG, "start-yaw", f"one of {YAWS_DEG}", yaw)
        if len(layout.house.rooms) > 1:
            self.expect(
                episode.start.room != episode.goal.room,
                "rooms-differ",
                "start and goal in two rooms",
                f"both in {episode.start.room}",
            )
        if good:
            parts = [int(layout.components[n]) for n in (self.start, self.goal)]
            good = self.expect(
                parts[0] == parts[1] == layout.main_component,
                "same-component",
                f"both in component {layout.main_component}",
                parts,
            )
        wanted = "blocked" if (layout.house.scene + episode.index) % 2 == 0 else "lengthened"
        self.expect(episode.mode == wanted, "mode", wanted, episode.mode)
        self.expect(
            episode.room_count == len(layout.house.rooms),
            "room-count",
            len(layout.house.rooms),
            episode.room_count,
        )
        return good

    def _end(self, name: str, end: Start | Goal, node: int) -> bool:
        wanted = (end.i * SPACING_M, end.j * SPACING_M)
        good = self.expect((end.x, end.y) == wanted, f"{name}-node", wanted, (end.x, end.y))
        rooms = {r.room_id: r.polygon for r in self.layout.house.rooms}
        if self.expect(end.room in rooms, f"{name}-room", f"one of {sorted(rooms)}", end.room):
            gap = Polygon(rooms[end.room]).distance(Point(end.x, end.y))
            self.expect(gap < ROUNDED_M, f"{name}-room", f"room {end.room}", f"{gap:.4f} m off it")
        else:
            good = False
        free = node >= 0 and bool(self.layout.lattice.free.nodes[node])
        return self.expect(free, f"{name}-free", "a free node", (end.i, end.j)) and good

    def paths(self) -> None:
        """Check room paths, node paths and the number of rooms on the path."""
        episode = self.episode
        ends = (episode.start.room, episode.goal.room)
        paths, cut = self.layout.room_paths(*ends)
        self.expect(episode.room_paths == paths, "room-paths", paths, episode.room_paths)
        self.expect(
            episode.room_paths_truncated == cut,
            "room-paths-truncated",
            cut,
            episode.room_paths_truncated,
        )
        room_count = len(paths[0]) if paths else 0
        self.expect(
            episode.rooms_on_path == room_count, "rooms-on-path", room_count, episode.rooms_on_path
        )
        doors, cut = self.layout.door_paths(*ends)
        stored = tuple(path.doors for path in episode.node_paths)
        self.expect(stored == doors, "node-paths", doors, stored)
        self.expect(
            episode.node_paths_truncated == cut,
            "node-paths-truncated",
            cut,
            episode.node_paths_truncated,
        )
        centres = {door.door_id: (door.x, door.y) for door in self.layout.house.doors}
        for path in episode.node_paths:
            if not set(path.doors) <= set(centres):
                continue
            points = (self.from_xy, *(centres[d] for d in path.doors), self.to_xy)
            self.expect(path.points == points, "node-path-points", points, path.points)

    def steps(self, footprints: list[list[Geometry]]) -> None:
        """Check the lattice distances with and without obstacles, and which of these matter."""
        layout, episode = self.layout, self.episode
        unobstructed = layout.lattice.distances(self.goal, layout.lattice.free)[self.start]
        removals = Removals(layout.lattice, footprints, self.start, self.goal)
        free = removals.free()
        for name, node in (("start", self.start), ("goal", self.goal)):
            self.expect(free.nodes[node], f"{name}-uncovered", "no obstacle over it", "one")
        steps = int(removals.steps) if math.isfinite(removals.steps) else None
        self.expect(
            episode.shortest_path_steps == unobstructed,
            "shortest-path-steps",
            unobstructed,
            episode.shortest_path_steps,
        )
        self.expect(
            episode.obstructed_path_steps == steps,
            "obstructed-path-steps",
            steps,
            episode.obstructed_path_steps,
        )
        if episode.mode == "blocked":
            self.expect(steps is None, "blocked", "no way on the lattice", f"{steps} steps")
        else:
            longer = steps is not None and steps > unobstructed
            self.expect(longer, "lengthened", f"more than {unobstructed} steps", steps)
        check_relevance(episode, removals, self.report)
        self._surroundings(free)

    def _surroundings(self, free: FreeSpace) -> None:
        """Check what is stated of the start: the step ahead, and the nodes within reach."""
        start, lattice = self.episode.start, self.layout.lattice
        if start.faces_wall is not None and start.yaw_deg in YAWS_DEG:
            di, dj = AHEAD[YAWS_DEG.index(start.yaw_deg)]
            ahead = lattice.node(start.i + di, start.j + dj)
            blocked = not lattice.edge_free(self.start, ahead, lattice.free)
            self.expect(start.faces_wall == blocked, "start-faces-wall", blocked, start.faces_wall)
        if start.reachable_nodes is not None:
            found = lattice.reachable(self.start, free)
            self.expect(
                start.reachable_nodes == found,
                "start-reachable-nodes",
                found,
                start.reachable_nodes,
            )

    def lengths(self, footprints: list[Geometry], *, exact: bool) -> None:
        """Check the Euclidean distances with and without obstacles."""
        episode, layout = self.episode, self.layout
        straight = math.dist(self.from_xy, self.to_xy)
        self.expect(
            episode.shortest_path_m >= MIN_SHORTEST_PATH_M,
            "shortest-path-min",
            f"{MIN_SHORTEST_PATH_M} m",
            episode.shortest_path_m,
        )
        self._bounds(
            "shortest-path-m", episode.shortest_path_m, straight, episode.shortest_path_steps
        )
        self.expect(
            episode.sealed == (episode.obstructed_path_m is None),
            "sealed-flag",
            episode.sealed,
            episode.obstructed_path_m,
        )
        unobstructed = CheckedPath(layout, self.from_xy, self.to_xy)
        agrees = unobstructed.agrees(episode.shortest_path_m)
        found = episode.shortest_path_m if agrees else f"{unobstructed.length():.4f} m"
        self.expect(agrees, "shortest-path-m", found, episode.shortest_path_m)
        obstructed = CheckedPath(layout, self.from_xy, self.to_xy, footprints)
        if episode.obstructed_path_m is None:
            shut = not obstructed.connected(stated=False)
            self.expect(shut, "sealed", "not sealed: the disc can pass", "sealed")
        else:
            self._bounds(
                "obstructed-path-m",
                episode.obstructed_path_m,
                episode.shortest_path_m,
                episode.obstructed_path_steps,
            )
            self._open_path(obstructed, episode.obstructed_path_m)
        if exact:
            close = unobstructed.agrees_exactly(episode.shortest_path_m)
            self.expect(
                close,
                "shortest-path-m-exact",
                "the finely cut graph's length",
                episode.shortest_path_m,
            )

    def _bounds(self, name: str, length: float, min_length: float, steps: int | None) -> None:
        low = length >= min_length - ROUNDED_M
        self.expect(low, f"{name}-bounds", f"at least {min_length:.4f} m", length)
        if steps is not None:
            max_length = steps * SPACING_M
            high = length <= max_length + ROUNDED_M
            self.expect(high, f"{name}-bounds", f"at most {max_length:.2f} m", length)

    def _open_path(self, obstructed: CheckedPath, stated: float) -> None:
        if obstructed.agrees(stated):
            self.expect(True, "obstructed-path-m", "", "")  # noqa: FBT003 - counted
        elif not obstructed.connected(stated=True):
            self.expect(False, "sealed", "sealed: no way for the disc", f"{stated} m")  # noqa: FBT003
        else:
            self.expect(False, "obstructed-path-m", f"{obstructed.length():.4f} m", stated)  # noqa: FBT003
