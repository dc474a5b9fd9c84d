"""Hand-made houses and episodes whose figures come from plain brute force."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from itertools import pairwise

import builders
from builders import WALL_HALF_M as HALF_WALL
from builders import crate, part

from internav_data.dataset import Identity, assemble, open_staging, stage_scene
from internav_data.physics.engines import DEFAULT_ENGINE
from internav_data.records import Asset, NodePath, Physics, Pose

ASSETS = builders.by_id(
    crate("Box_1", (0.6, 0.6, 0.5), mass_kg=8.0),
    crate("Box_2", (0.3, 0.4, 0.6), mass_kg=8.0),
    crate("Bar_1", (1.2, 0.2, 0.7), mass_kg=8.0),
    builders.asset("Drum_1", part("cylinder", (0.0, 0.0, 0.3), (0.5, 0.5, 0.6)), mass_kg=8.0),
    crate("Pot_1", (0.4, 0.4, 0.4), mass_kg=3.0, pickable=True),
    crate("Safe_1", (0.6, 0.6, 0.9), mass_kg=300.0),
    builders.table("Table_1", (1.4, 0.8, 0.75), inset_m=0.03, mass_kg=8.0, spawnable=False),
    crate("Cupboard_1", (1.0, 0.5, 1.8), mass_kg=8.0, spawnable=False),
)


@dataclass(frozen=True)
class Grid:
    """A house of equal square rooms: `columns` x `rows`, with a door in the middle of each wall."""

    columns: int
    rows: int
    side: float = 4.0

    def house(self, scene=7, objects=()):
        lines_x = [k * self.side - HALF_WALL for k in range(self.columns + 1)]
        lines_y = [k * self.side - HALF_WALL for k in range(self.rows + 1)]
        rooms = tuple(
            builders.room(
                self.number(c, r),
                builders.rectangle(lines_x[c], lines_y[r], lines_x[c + 1], lines_y[r + 1]),
                self.side**2,
            )
            for r in range(self.rows)
            for c in range(self.columns)
        )
        doors, walls = self._doors_and_walls(lines_x, lines_y)
        return builders.house(
            rooms,
            builders.rectangle(lines_x[0], lines_y[0], lines_x[-1], lines_y[-1]),
            scene,
            doors=doors,
            walls=walls,
            objects=tuple(objects),
            room_graph=tuple(sorted(d.rooms for d in doors)),
            assets=ASSETS,
        )

    def number(self, column, row):
        return row * self.columns + column

    def _doors_and_walls(self, lines_x, lines_y):  # noqa: C901 - the same for both directions
        doors, walls = [], []
        for c, x in enumerate(lines_x):
            for r in range(self.rows):
                inner = 0 < c < self.columns
                middle = (lines_y[r] + lines_y[r + 1]) / 2
                if inner:
                    pair = (self.number(c - 1, r), self.number(c, r))
                    doors.append(builders.door(len(doors), pair, x, middle))
                for low, high in self._pieces(lines_y[r], lines_y[r + 1], middle, inner):
                    walls.append(builders.wall(x - HALF_WALL, low, x + HALF_WALL, high))
                if inner:
                    walls.append(
                        builders.lintel(x - HALF_WALL, middle - 0.5, x + HALF_WALL, middle + 0.5)
                    )
        for r, y in enumerate(lines_y):
            for c in range(self.columns):
                inner = 0 < r < self.rows
                middle = (lines_x[c] + lines_x[c + 1]) / 2
                if inner:
                    pair = (self.number(c, r - 1), self.number(c, r))
                    doors.append(builders.door(len(doors), pair, middle, y, 0.0))
                for low, high in self._pieces(lines_x[c], lines_x[c + 1], middle, inner):
                    walls.append(builders.wall(low, y - HALF_WALL, high, y + HALF_WALL))
                if inner:
                    walls.append(
                        builders.lintel(middle - 0.5, y - HALF_WALL, middle + 0.5, y + HALF_WALL)
                    )
        return doors, walls

    @staticmethod
    def _pieces(low, high, middle, inner):
        low, high = low - HALF_WALL, high + HALF_WALL
        return ((low, middle - 0.5), (middle + 0.5, high)) if inner else ((low, high),)


def obstacle(asset_id, x, y, *, yaw_deg=0.0):
    return builders.obstacle(ASSETS[asset_id], x, y, yaw_deg=yaw_deg, penetration_m=0.0001)


def _rectangle(a: Asset, pose: Pose):
    """Corners of the plan of an asset whose plan is its bounding box."""
    turn = 2 * math.atan2(pose.quaternion[2], pose.quaternion[3])
    c, s = math.cos(turn), math.sin(turn)
    half = (a.size[0] / 2, a.size[1] / 2)
    return [
        (pose.x + c * u * half[0] - s * v * half[1], pose.y + s * u * half[0] + c * v * half[1])
        for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]


def _inside(p, ring):
    return all(
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= 0
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
    )


def _to_segment(p, a, b):
    dx, dy = b[0] - a[0], b[1] - a[1]
    t = ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / (dx * dx + dy * dy)
    t = min(1.0, max(0.0, t))
    return math.hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy)


def _turns(a, b, p):
    return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])


def _apart(a, b, ring):
    """Distance between a segment and a convex ring, by looking at every pair of ends."""
    if _inside(a, ring) or _inside(b, ring):
        return 0.0
    best = math.inf
    for c, d in zip(ring, [*ring[1:], ring[0]], strict=True):
        if _turns(a, b, c) * _turns(a, b, d) < 0 and _turns(c, d, a) * _turns(c, d, b) < 0:
            return 0.0
        best = min(best, _to_segment(a, c, d), _to_segment(b, c, d))
        best = min(best, _to_segment(c, a, b), _to_segment(d, a, b))
    return best


def rings_of(house, obstacles=()):
    """Plans of all that blocks (assets of these tests cover their bounding boxes)."""
    rings = [
        [(w.x_min, w.y_min), (w.x_max, w.y_min), (w.x_max, w.y_max), (w.x_min, w.y_max)]
        for w in house.walls
        if w.z_min < 1.8
    ]
    for placed in (*house.objects, *obstacles):
        a = ASSETS[placed.asset_id]
        if a.asset_id.startswith("Drum"):
            rings.append(
                [
                    (
                        placed.x + a.size[0] / 2 * math.cos(k * math.pi / 8),
                        placed.y + a.size[1] / 2 * math.sin(k * math.pi / 8),
                    )
                    for k in range(16)
                ]
            )
        else:
            rings.append(_rectangle(a, placed.pose))
    return rings


def brute_steps(house, start, goal, obstacles=()):
    """Breadth-first search that measures every edge it takes."""
    rings = rings_of(house, obstacles)

    def near(p):
        return [
            r
            for r in rings
            if min(x for x, _ in r) - 0.6 < p[0] < max(x for x, _ in r) + 0.6
            and min(y for _, y in r) - 0.6 < p[1] < max(y for _, y in r) + 0.6
        ]

    seen = {start: 0}
    queue = deque([start])
    while queue:
        node = queue.popleft()
        if node == goal:
            return seen[node]
        for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            other = (node[0] + di, node[1] + dj)
            if other in seen:
                continue
            a, b = (tuple(0.25 * k for k in n) for n in (node, other))
            if all(_apart(a, b, ring) >= 0.2 - 1e-6 for ring in near(b)):
                seen[other] = seen[node] + 1
                queue.append(other)
    return None


def brute_paths(house, first, second):
    """All simple room paths by recursion, then all choices of doors."""
    beside = {r.room_id: set() for r in house.rooms}
    for a, b in house.room_graph:
        beside[a].add(b)
        beside[b].add(a)

    def further(path):
        if path[-1] == second:
            return [tuple(path)]
        return [p for n in sorted(beside[path[-1]] - set(path)) for p in further([*path, n])]

    return tuple(sorted(further([first]), key=lambda p: (len(p), p)))


def episode(house, index, start, goal, obstacles, *, shortest_path_m, obstructed_path_m, yaw=90):
    """An episode whose steps and paths come from brute force; lengths are given."""
    rooms = [
        next(
            r.room_id
            for r in house.rooms
            if r.polygon[0][0] <= 0.25 * i <= r.polygon[2][0]
            and r.polygon[0][1] <= 0.25 * j <= r.polygon[2][1]
        )
        for i, j in (start, goal)
    ]
    paths = brute_paths(house, *rooms)
    ends = [(0.25 * i, 0.25 * j) for i, j in (start, goal)]
    door_of = {d.rooms: d for d in house.doors}
    node_paths = []
    for path in paths:
        doors = [door_of[min(a, b), max(a, b)] for a, b in pairwise(path)]
        points = (ends[0], *((d.x, d.y) for d in doors), ends[1])
        node_paths.append(NodePath(tuple(d.door_id for d in doors), points))
    return builders.episode(
        house,
        builders.start(*start, yaw, rooms[0]),
        builders.goal(*goal, rooms[1]),
        obstacles,
        index=index,
        mode="blocked" if (house.scene + index) % 2 == 0 else "lengthened",
        sealed=obstructed_path_m is None,
        rooms_on_path=len(paths[0]),
        shortest_path_m=shortest_path_m,
        shortest_path_steps=brute_steps(house, start, goal),
        obstructed_path_m=obstructed_path_m,
        obstructed_path_steps=brute_steps(house, start, goal, obstacles),
        room_paths=paths,
        node_paths=tuple(node_paths),
        physics=Physics(DEFAULT_ENGINE, "3.2.7", 0.1, 0.0001),
    )


def taut(start, chain, goal, radius=0.2):
    """Length of a string from start to goal round circles: (centre, +1 on its left, -1 right)."""
    stops = [(start, 0.0), *((centre, radius * side) for centre, side in chain), (goal, 0.0)]
    length, heading = 0.0, None
    for (a, ra), (b, rb) in pairwise(stops):
        gap = math.dist(a, b)
        straight = math.sqrt(gap * gap - (rb - ra) ** 2)
        direction = math.atan2(b[1] - a[1], b[0] - a[0]) - math.atan2(rb - ra, straight)
        if heading is not None:
            turn = math.remainder(direction - heading, math.tau)
            assert turn * ra >= -1e-9, "the string does not touch this circle"
            length += abs(turn) * radius
        length += straight
        heading = direction
    return length


def small_scenes():
    """Three houses with two valid episodes each, lengths worked out as taut strings."""
    return [_scene(0), _scene(1), _scene(2)]


def _scene(number):
    split = {0: "val", 1: "test"}.get(number, "train")
    objects = (
        builders.scene_object(0, "Table_1", 0, 1.0, 0.6),
        builders.scene_object(1, "Cupboard_1", 1, 6.0, 3.5),
        builders.scene_object(2, "Box_1", 1, 6.5, 0.5, yaw_deg=45.0),
    )
    house = replace(Grid(2, 1).house(number, objects), split=split)
    start, goal = (4, 8), (28, 8)
    here, there = (1.0, 2.0), (7.0, 2.0)
    made = []
    for index in range(2):
        if (number + index) % 2 == 0 and number == 0:
            obstacles = [obstacle("Bar_1", 3.5, 2.0, yaw_deg=90.0)]
            obstructed_path_m = None
        elif (number + index) % 2 == 0:
            # A gap of 0.42 m beside the box: open for the disc, between two rows of the lattice.
            obstacles = [obstacle("Box_2", 3.94, 1.82)]
            obstructed_path_m = taut(here, [((3.79, 2.02), -1), ((4.09, 2.02), -1)], there)
        else:
            obstacles = [obstacle("Box_1", 2.5, 2.0)]
            obstructed_path_m = taut(here, [((2.2, 1.7), 1), ((2.8, 1.7), 1)], there)
        made.append(
            episode(
                house,
                index,
                start,
                goal,
                obstacles,
                shortest_path_m=6.0,
                obstructed_path_m=None
                if obstructed_path_m is None
                else round(obstructed_path_m, 4),
            )
        )
    return house, made


IDENTITY = Identity(
    "internav-gen", "0", 0, 1, "0" * 64, {"episodes_per_scene": 2, "test_episodes_per_scene": 2}
)


def write_dataset(root, scenes, assets=None, config=None):
    """Write scenes as a dataset, by the same road as the generator."""
    identity = replace(IDENTITY, config={**IDENTITY.config, **(config or {})})
    staging = open_staging(root, identity)
    for number, (house, episodes) in enumerate(scenes):
        stage_scene(staging, number, house, episodes)
    return assemble(root, identity, list((assets or ASSETS).values()), len(scenes))
