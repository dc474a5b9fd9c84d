"""Navigation against networkx and shapely: the same questions, the same answers, side by side.

    python benchmarks/navigation.py [--scenes 12] [--seed 0] [--out FILE]

In each house: building the lattice, steps from one node to all, an obstacle that comes and goes,
building the tangent graph, a shortest path without and with four obstacles, and whether they seal
it. Both sides run in turn in one process; times are the median of the best of several runs, in ms,
and `times_faster` is the plain side's time over ours. Exits 1 if answers differ.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import shapely

from internav_data.catalog import catalogue
from internav_data.geometry import Polygons, footprint, house_footprints, yaw_quaternion
from internav_data.houses import HouseConfig, build_house
from internav_data.navigation import CLEARANCE_M, SPACING_M, Lattice, TangentGraph
from internav_data.records import Pose, Purpose, generator

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator
    from numpy.typing import NDArray

    from internav_data.records import House, Vec2

    Floats = NDArray[np.float64]

CHORDS = 8
"""Chords a quarter circle of the plain visibility graph: 0.16 % short on arcs."""
AGREE = 0.01
QUESTIONS = 8
OBSTACLES = 4


def best_ms(work: Callable[[], object], runs: int) -> float:
    """Return the best time of several runs: other work of the machine does not count."""
    times = []
    for _ in range(runs):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)


def plain_lattice(solid: NDArray[Any], house: House, shape: tuple[int, int]) -> nx.Graph:
    """Return nodes and swept edges by shapely distances to polygons `solid` (n,), in a tree."""
    i, j = (a.ravel() for a in np.indices(shape))
    tree = shapely.STRtree(solid)
    points = shapely.points(SPACING_M * np.column_stack([i, j]).astype(float))
    inside = shapely.covers(shapely.Polygon(house.outline), points)
    near = tree.query(points, predicate="dwithin", distance=CLEARANCE_M - 1e-12)[0]
    free = inside.copy()
    free[near] = False
    number = np.where(free, np.arange(len(i)), -1).reshape(shape)
    pairs = np.vstack(
        [
            np.column_stack([number[:-1].ravel(), number[1:].ravel()]),
            np.column_stack([number[:, :-1].ravel(), number[:, 1:].ravel()]),
        ]
    )
    pairs = pairs[(pairs >= 0).all(axis=1)]
    lines = shapely.linestrings(shapely.get_coordinates(points)[pairs])
    swept = np.ones(len(lines), dtype=bool)
    swept[tree.query(lines, predicate="dwithin", distance=CLEARANCE_M - 1e-12)[0]] = False
    graph = nx.Graph()
    graph.add_nodes_from(np.flatnonzero(free).tolist())
    graph.add_edges_from(pairs[swept].tolist())
    return graph


def plain_distance(solid: NDArray[Any], p: Vec2, q: Vec2) -> float | None:
    """Return the shortest path's length among polygons `solid` (n,) by a visibility graph."""
    area = shapely.union_all(shapely.buffer(solid, CLEARANCE_M, quad_segs=CHORDS))
    core = shapely.union_all(shapely.buffer(solid, CLEARANCE_M - 1e-6, quad_segs=CHORDS))
    shapely.prepare(core)
    points = [np.array([p, q])]
    for ring in shapely.get_rings(shapely.orient_polygons(shapely.get_parts(area))):
        corners = shapely.get_coordinates(ring)[:-1]
        a, b = corners - np.roll(corners, 1, 0), np.roll(corners, -1, 0) - corners
        points.append(corners[a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0] > 0])
    nodes = np.vstack(points)
    first, second = np.triu_indices(len(nodes), 1)
    lines = shapely.linestrings(np.stack([nodes[first], nodes[second]], axis=1))
    seen = ~shapely.intersects(core, lines)
    far = np.hypot(*(nodes[first] - nodes[second]).T)
    graph = nx.Graph()
    graph.add_nodes_from((0, 1))
    kept = (first[seen].tolist(), second[seen].tolist(), far[seen].tolist())
    graph.add_weighted_edges_from(zip(*kept, strict=True))
    try:
        return float(nx.dijkstra_path_length(graph, 0, 1))
    except nx.NetworkXNoPath:
        return None


def spawned(graph: TangentGraph, p: Vec2, q: Vec2, random: Generator) -> Polygons:
    """Strew some of the catalogue's obstacles along the shortest path, as spawning does."""
    line = shapely.LineString(graph.path(p, q))
    obstacles = catalogue().spawnable
    groups = []
    for _ in range(OBSTACLES):
        spot = line.interpolate(float(random.uniform(0.15, 0.85)), normalized=True)
        x, y = spot.x + float(random.normal(0, 0.25)), spot.y + float(random.normal(0, 0.25))
        yaw = yaw_quaternion(15 * int(random.integers(24)))
        asset = obstacles[int(random.integers(len(obstacles)))]
        groups.append(footprint(asset, Pose(x, y, 0.0, yaw)))
    return Polygons.joined(groups)


def questions(
    lattice: Lattice, graph: TangentGraph, random: Generator
) -> list[tuple[Any, Any, Any]]:
    labels = lattice.components()
    nodes = np.argwhere(labels == np.bincount(labels[labels >= 0]).argmax())
    out = []
    while len(out) < QUESTIONS:
        (a, b), (c, d) = nodes[random.integers(len(nodes), size=2)].tolist()
        p, q = (SPACING_M * a, SPACING_M * b), (SPACING_M * c, SPACING_M * d)
        if math.dist(p, q) >= 2.0:
            out.append((p, q, spawned(graph, p, q, random)))
    return out


def agree(ours: float | None, plain: float | None) -> bool:
    """Compare within 1 %; a gap a hair too narrow may be open to chords, never the reverse."""
    if ours is None or plain is None:
        return ours is None
    return abs(ours - plain) <= AGREE * plain


def path_times(
    times: dict[str, list[float]], polygons: Polygons, solid: NDArray[Any], asked: list[Any]
) -> int:
    """Time shortest paths among polygons `solid` (n,); the plain side answers one of each kind.

    Returns the number of answers that differ.
    """
    graph = TangentGraph(polygons)
    free_ms, obstructed_ms, sealed_ms = [], [], []
    differ = 0
    for p, q, obstacles in asked:
        fresh = TangentGraph(polygons)  # its cache is empty
        free, length = [], graph.distance(p, q, obstacles)
        free_ms.append(best_ms(lambda c=free, f=fresh, a=p, b=q: c.append(f.distance(a, b)), 1))
        sealed_ms.append(best_ms(lambda a=p, b=q, t=obstacles: graph.sealed(a, b, t), 5))
        if len(free_ms) == 1:
            differ += compare(times, "without obstacles", free[0], solid, p, q)
        if length is not None:
            obstructed_ms.append(best_ms(lambda a=p, b=q, t=obstacles: graph.distance(a, b, t), 5))
            if len(obstructed_ms) == 1:
                everything = np.append(solid, [shapely.Polygon(t) for t in obstacles])
                differ += compare(times, "past four obstacles", length, everything, p, q)
    times["shortest path without obstacles"][0] = median(free_ms)
    if obstructed_ms:
        times["shortest path past four obstacles"][0] = median(obstructed_ms)
    times["whether four obstacles seal"] = [median(sealed_ms)]
    return differ


def compare(
    times: dict[str, list[float]],
    name: str,
    ours: float | None,
    solid: NDArray[Any],
    p: Vec2,
    q: Vec2,
) -> int:
    plain: list[float | None] = []
    took = best_ms(lambda: plain.append(plain_distance(solid, p, q)), 1)
    times[f"shortest path {name}"] = [0.0, took]
    return int(not agree(ours, plain[0]))


def house_times(scene: int, seed: int) -> tuple[dict[str, list[float]], int]:
    """Return the times of every question in one house, and the number of answers that differ."""
    house = build_house(seed, scene, HouseConfig(), catalogue())
    polygons = house_footprints(house)
    solid = np.array([shapely.Polygon(p) for p in polygons])
    lattice, graph = Lattice.of(house), TangentGraph.of(house)
    asked = questions(lattice, graph, generator(seed, Purpose.SPAWN, scene))
    plain = plain_lattice(solid, house, lattice.shape)
    _, q, obstacles = asked[0]
    goal = (round(q[0] / SPACING_M), round(q[1] / SPACING_M))
    node = goal[0] * lattice.shape[1] + goal[1]
    steps = lattice.distances(*goal)
    reached = nx.single_source_shortest_path_length(plain, node)
    differ = int({int(k): int(steps.flat[k]) for k in np.flatnonzero(steps >= 0)} != reached)
    group = np.array([shapely.Polygon(t) for t in obstacles])

    def again() -> None:
        lattice.remove(lattice.add(obstacles))

    def rebuilt() -> None:
        plain_lattice(np.append(solid, group), house, lattice.shape)

    times: dict[str, list[float]] = {
        "lattice": [
            best_ms(lambda: Lattice.of_polygons(polygons, house.outline), 5),
            best_ms(lambda: plain_lattice(solid, house, lattice.shape), 2),
        ],
        "steps from one node to all": [
            best_ms(lambda: lattice.distances(*goal), 9),
            best_ms(lambda: nx.single_source_shortest_path_length(plain, node), 3),
        ],
        "four obstacles come and go on the lattice": [best_ms(again, 9), best_ms(rebuilt, 2)],
        "tangent graph of a house": [best_ms(lambda: TangentGraph(polygons), 3)],
    }
    differ += path_times(times, polygons, solid, asked)
    return times, differ


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0] if __doc__ else None)
    parser.add_argument("--scenes", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    house_times(0, options.seed)  # compiles, or loads what was compiled
    gathered: dict[str, list[list[float]]] = {}
    differ = 0
    for scene in range(options.scenes):
        times, wrong = house_times(scene, options.seed)
        differ += wrong
        for name, pair in times.items():
            gathered.setdefault(name, []).append(pair)
    result: dict[str, Any] = {}
    for name, pairs in gathered.items():
        row = {"internav_ms": round(median(p[0] for p in pairs), 4)}
        if len(pairs[0]) > 1:
            row["plain_ms"] = round(median(p[1] for p in pairs), 3)
            row["times_faster"] = round(median(p[1] / p[0] for p in pairs), 1)
        result[name] = row
    report = {"scenes": options.scenes, "answers_that_differ": differ, "questions": result}
    text = json.dumps(report, indent=2)
    print(text)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
