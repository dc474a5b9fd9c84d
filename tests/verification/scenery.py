"""Hand-made houses and episodes whose figures come from plain brute force."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from itertools import pairwise

from internav_data.dataset import Identity, assemble, open_staging, stage_scene
from internav_data.records import (
    Asset,
    Door,
    Episode,
    Goal,
    House,
    Material,
    NodePath,
    Obstacle,
    Part,
    Physics,
    Pose,
    Room,
    SceneObject,
    Start,
    Wall,
)

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
HALF_WALL = 0.06
DOOR = 1.0


def part(shape, centre, size):
    return Part(shape, centre, size, UPRIGHT, (), (120, 90, 60), "wood")


def asset(asset_id, size, parts=None, *, mass=8.0, spawnable=True, pickable=False):
    parts = parts or (part("box", (0.0, 0.0, size[2] / 2), size),)
    return Asset(
        asset_id, asset_id.split("_")[0], size, mass, 0.6, True, pickable, spawnable, True, parts
    )


def table(asset_id, width, depth, height):
    legs = [
        part(
            "box",
            (x * (width - 0.06) / 2, y * (depth - 0.06) / 2, height / 2 - 0.02),
            (0.06, 0.06, height - 0.04),
        )
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    top = part("box", (0.0, 0.0, height - 0.02), (width, depth, 0.04))
    return asset(asset_id, (width, depth, height), (*legs, top), spawnable=False)


ASSETS = {
    a.asset_id: a
    for a in (
        asset("Box_1", (0.6, 0.6, 0.5)),
        asset("Box_2", (0.3, 0.4, 0.6)),
        asset("Bar_1", (1.2, 0.2, 0.7)),
        asset("Drum_1", (0.5, 0.5, 0.6), (part("cylinder", (0.0, 0.0, 0.3), (0.5, 0.5, 0.6)),)),
        asset("Pot_1", (0.4, 0.4, 0.4), mass=3.0, pickable=True),
        asset("Safe_1", (0.6, 0.6, 0.9), mass=300.0),
        table("Table_1", 1.4, 0.8, 0.75),
        asset("Cupboard_1", (1.0, 0.5, 1.8), spawnable=False),
    )
}


@dataclass(frozen=True)
class Grid:
    """A house of equal square rooms: `columns` x `rows`, with a door in the middle of each wall."""

    columns: int
    rows: int
    side: float = 4.0

    def house(self, scene=7, things=()):
        lines_x = [k * self.side - HALF_WALL for k in range(self.columns + 1)]
        lines_y = [k * self.side - HALF_WALL for k in range(self.rows + 1)]
        rooms = tuple(
            Room(
                self.number(c, r),
                "living",
                (
                    (lines_x[c], lines_y[r]),
                    (lines_x[c + 1], lines_y[r]),
                    (lines_x[c + 1], lines_y[r + 1]),
                    (lines_x[c], lines_y[r + 1]),
                ),
                self.side**2,
                2.6,
                "oak",
                "white",
            )
            for r in range(self.rows)
            for c in range(self.columns)
        )
        doors, walls = self._doors_and_walls(lines_x, lines_y)
        outline = (
            (lines_x[0], lines_y[0]),
            (lines_x[-1], lines_y[0]),
            (lines_x[-1], lines_y[-1]),
            (lines_x[0], lines_y[-1]),
        )
        return House(
            scene_id=f"scene-{scene:06d}",
            scene=scene,
            seed=0,
            split="train",
            preset="paper",
            outline=outline,
            rooms=rooms,
            doors=tuple(doors),
            windows=(),
            walls=tuple(walls),
            objects=tuple(things),
            materials=(
                Material("oak", (120, 90, 60), "planks"),
                Material("white", (250,) * 3, "plain"),
            ),
            room_graph=tuple(sorted(d.rooms for d in doors)),
            area_m2=self.side**2 * len(rooms),
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
                    doors.append(Door(len(doors), pair, "single", x, middle, 90.0, DOOR, 2.1, True))
                for low, high in self._pieces(lines_y[r], lines_y[r + 1], middle, inner):
                    walls.append(Wall(x - HALF_WALL, low, x + HALF_WALL, high, 0.0, 2.6))
                if inner:
                    walls.append(
                        Wall(x - HALF_WALL, middle - 0.5, x + HALF_WALL, middle + 0.5, 2.1, 2.6)
                    )
        for r, y in enumerate(lines_y):
            for c in range(self.columns):
                inner = 0 < r < self.rows
                middle = (lines_x[c] + lines_x[c + 1]) / 2
                if inner:
                    pair = (self.number(c, r - 1), self.number(c, r))
                    doors.append(Door(len(doors), pair, "single", middle, y, 0.0, DOOR, 2.1, True))
                for low, high in self._pieces(lines_x[c], lines_x[c + 1], middle, inner):
                    walls.append(Wall(low, y - HALF_WALL, high, y + HALF_WALL, 0.0, 2.6))
                if inner:
                    walls.append(
                        Wall(middle - 0.5, y - HALF_WALL, middle + 0.5, y + HALF_WALL, 2.1, 2.6)
                    )
        return doors, walls

    @staticmethod
    def _pieces(low, high, middle, inner):
        low, high = low - HALF_WALL, high + HALF_WALL
        return ((low, middle - 0.5), (middle + 0.5, high)) if inner else ((low, high),)


def thing(number, asset_id, room, x, y, *, yaw_deg=0.0, group=-1):
    half = math.radians(yaw_deg) / 2
    turn = (0.0, 0.0, round(math.sin(half), 6), round(math.cos(half), 6))
    return SceneObject(number, asset_id, asset_id.split("_")[0], room, x, y, 0.0, turn, group, -1)


def obstacle(asset_id, x, y, *, yaw_deg=0.0):
    half = math.radians(yaw_deg) / 2
    turn = (0.0, 0.0, round(math.sin(half), 6), round(math.cos(half), 6))
    a = ASSETS[asset_id]
    return Obstacle(
        asset_id,
        a.type,
        x,
        y,
        0.0,
        turn,
        a.mass_kg,
        a.friction,
        a.pushable,
        a.pickable,
        0,
        0.1,
        0.0001,
        None,
    )


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
    return Episode(
        episode_id=f"{house.scene_id}/{index:04d}",
        scene_id=house.scene_id,
        split=house.split,
        index=index,
        seed=0,
        room_count=len(house.rooms),
        mode="blocked" if (house.scene + index) % 2 == 0 else "lengthened",
        sealed=obstructed_path_m is None,
        rooms_on_path=len(paths[0]),
        obstacle_count=len(obstacles),
        shortest_path_m=shortest_path_m,
        shortest_path_steps=brute_steps(house, start, goal),
        obstructed_path_m=obstructed_path_m,
        obstructed_path_steps=brute_steps(house, start, goal, obstacles),
        start=Start(*start, *ends[0], yaw, rooms[0]),
        goal=Goal(*goal, *ends[1], rooms[1]),
        room_paths=paths,
        room_paths_truncated=False,
        node_paths=tuple(node_paths),
        node_paths_truncated=False,
        obstacles=tuple(obstacles),
        expert=None,
        physics=Physics("bullet", "3.2.7", 0.1, 0.0001),
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
    things = (
        thing(0, "Table_1", 0, 1.0, 0.6),
        thing(1, "Cupboard_1", 1, 6.0, 3.5),
        thing(2, "Box_1", 1, 6.5, 0.5, yaw_deg=45.0),
    )
    house = replace(Grid(2, 1).house(number, things), split=split)
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
    store = open_staging(root, identity)
    for number, (house, episodes) in enumerate(scenes):
        stage_scene(store, number, house, episodes)
    return assemble(root, identity, list((assets or ASSETS).values()), len(scenes))
