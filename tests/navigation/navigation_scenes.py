"""Houses and polygons for the tests of navigation, made without the generator."""

from __future__ import annotations

import math

import builders
import numpy as np
from builders import WALL_HALF_M as HALF
from hypothesis import strategies as st

from internav_data.geometry import Polygons, round_m


def rectangle(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def turned(x, y, width, depth, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    w, d = width / 2, depth / 2
    corners = ((-w, -d), (w, -d), (w, d), (-w, d))
    return [(x + c * a - s * b, y + s * a + c * b) for a, b in corners]


def round_object(x, y, radius):
    return [
        (x + radius * math.cos(k * math.pi / 8), y + radius * math.sin(k * math.pi / 8))
        for k in range(16)
    ]


def ring(width, height, thick=0.12):
    """Outer walls that share no volume, as houses have them."""
    return [
        rectangle(-thick, -thick, width + thick, 0.0),
        rectangle(-thick, height, width + thick, height + thick),
        rectangle(-thick, 0.0, 0.0, height),
        rectangle(width, 0.0, width + thick, height),
    ]


@st.composite
def convex(draw, width=6.0, height=4.0):
    """A convex polygon of 3 to 8 corners, or a box flush with the grid of 1 cm."""
    x, y = (
        draw(st.integers(0, int(100 * width))) / 100,
        draw(st.integers(0, int(100 * height))) / 100,
    )
    kind = draw(st.sampled_from(["box", "turned", "polygon"]))
    if kind == "polygon":
        turns = sorted(draw(st.lists(st.integers(0, 71), min_size=3, max_size=8, unique=True)))
        radius = draw(st.integers(5, 60)) / 100
        angles = [math.radians(5 * t) for t in turns]
        # Corners on one circle in order of angle are convex whatever the angles are.
        return [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles]
    w, d = draw(st.integers(5, 150)) / 100, draw(st.integers(5, 80)) / 100
    if kind == "box":
        return rectangle(x, y, x + w, y + d)
    return turned(x, y, w, d, 15 * draw(st.integers(0, 23)))


@st.composite
def cluttered(draw, max_objects=8):
    """A room of 6 x 4 m, halved by a wall with a door, with convex things in it."""
    door = draw(st.integers(50, 250)) / 100
    wide = draw(st.sampled_from([0.39, 0.399, 0.4, 0.77, 1.0]))
    walls = [rectangle(2.94, 0.0, 3.06, door), rectangle(2.94, door + wide, 3.06, 4.0)]
    objects = draw(st.lists(convex(), max_size=max_objects))
    return [*ring(6.0, 4.0), *walls], objects


def random_rooms(seed, columns=4, rows=2, objects=60, size=(5.0, 7.0)):
    """Polygons of a house: rooms on a grid, a door in each wall between two, things strewn."""
    rng = np.random.default_rng(seed)
    width, depth = size
    polygons = ring(columns * width, rows * depth)
    for c in range(1, columns):
        for r in range(rows):
            at = round_m(rng.uniform(r * depth + 0.5, (r + 1) * depth - 1.5))
            polygons.append(rectangle(c * width - HALF, r * depth, c * width + HALF, at))
            polygons.append(rectangle(c * width - HALF, at + 1, c * width + HALF, (r + 1) * depth))
    for r in range(1, rows):
        for c in range(columns):
            at = round_m(rng.uniform(c * width + 0.5, (c + 1) * width - 1.5))
            low, high = c * width + HALF, (c + 1) * width - HALF
            polygons.append(rectangle(low, r * depth - HALF, at, r * depth + HALF))
            polygons.append(rectangle(at + 1, r * depth - HALF, high, r * depth + HALF))
    for _ in range(objects):
        x, y = (float(v) for v in rng.uniform((0, 0), (columns * width, rows * depth)))
        if rng.random() < 0.2:
            polygons.append(round_object(x, y, float(rng.uniform(0.1, 0.3))))
        else:
            w, d = (float(v) for v in rng.uniform((0.3, 0.3), (1.6, 0.8)))
            polygons.append(turned(x, y, w, d, 15 * int(rng.integers(24))))
    return Polygons.of(polygons), rectangle(0.0, 0.0, columns * width, rows * depth)


def house_of(rooms, doors, graph, walls=(), objects=(), outline=None):
    """A house record that holds what navigation reads of it."""
    return builders.house(
        [builders.room(k, polygon, 1.0) for k, polygon in rooms.items()],
        outline or rectangle(0.0, 0.0, 1.0, 1.0),
        doors=tuple(doors),
        walls=tuple(walls),
        objects=tuple(
            builders.scene_object(n, "DiningTable_0", 0, x, y, yaw_deg=yaw)
            for n, (x, y, yaw) in enumerate(objects)
        ),
        room_graph=tuple(graph),
        assets=builders.by_id(builders.table(size=(1.2, 0.8, 0.76))),
    )


def graph_house(edges, count):
    """Only rooms and a graph between them: no shapes."""
    rooms = {k: rectangle(k, 0.0, k + 1.0, 1.0) for k in range(count)}
    edges = sorted({(min(e), max(e)) for e in edges})
    doors = [builders.door(n, e, float(n), 0.5) for n, e in enumerate(edges)]
    return house_of(rooms, doors, edges)


def two_rooms(objects=()):
    """Interior 0..6 x 0..4 m; a wall at x = 3 with a door of 1 m in its middle."""
    low, high = -HALF, 4.0 + HALF
    wall = builders.wall
    walls = [
        wall(-2 * HALF, -2 * HALF, 6 + 2 * HALF, 0.0),
        wall(-2 * HALF, 4.0, 6 + 2 * HALF, 4 + 2 * HALF),
        wall(-2 * HALF, 0.0, 0.0, 4.0),
        wall(6.0, 0.0, 6 + 2 * HALF, 4.0),
        wall(3 - HALF, 0.0, 3 + HALF, 1.5),
        wall(3 - HALF, 2.5, 3 + HALF, 4.0),
        builders.lintel(3 - HALF, 1.5, 3 + HALF, 2.5),
    ]
    rooms = {0: rectangle(low, low, 3.0, high), 1: rectangle(3.0, low, 6 + HALF, high)}
    doors = [builders.door(0, (0, 1), 3.0, 2.0)]
    outline = tuple(rectangle(low, low, 6 + HALF, high))
    return house_of(rooms, doors, [(0, 1)], walls, objects, outline)
