"""Slow, plain answers by shapely and networkx to compare the kernels with."""

from __future__ import annotations

import math

import networkx as nx
import numpy as np
import shapely

RADIUS = 0.2 - 1e-6
QUARTER = 16
OUTSIDE_IN = 1.0 / math.cos(math.pi / (4 * QUARTER))
"""Times this, a polygon round a circle's corners holds the circle."""


def shapes(polygons):
    return np.array([shapely.Polygon(p) for p in polygons])


def grown(polygons, radius=RADIUS):
    """Union of polygons grown by a circle of chords: within the true one."""
    return shapely.union_all(shapely.buffer(shapes(polygons), radius, quad_segs=QUARTER))


def joined(polygons, p, q, radius=RADIUS):
    """Return whether p and q lie in one piece of the plane outside grown polygons."""
    left = shapely.box(-50, -50, 50, 50).difference(grown(polygons, radius))
    parts = shapely.get_parts(left)
    p, q = shapely.Point(p), shapely.Point(q)
    return any(part.distance(p) < 1e-9 and part.distance(q) < 1e-9 for part in parts)


def shortest(polygons, p, q, radius=RADIUS):
    """Return the shortest path among grown polygons by the full visibility graph; None without one.

    A lower bound for `radius`; for `radius * OUTSIDE_IN` an upper one.
    """
    area = grown(polygons, radius)
    core = shapely.union_all(shapely.buffer(shapes(polygons), radius - 1e-6, quad_segs=QUARTER))
    shapely.prepare(core)
    points = np.vstack([[p, q], _convex_corners(area)])
    a, b = np.triu_indices(len(points), 1)
    far = np.hypot(*(points[a] - points[b]).T)
    lines = shapely.linestrings(np.stack([points[a], points[b]], axis=1))
    seen = ~shapely.intersects(core, lines)
    graph = nx.Graph()
    graph.add_nodes_from((0, 1))
    graph.add_weighted_edges_from(
        zip(a[seen].tolist(), b[seen].tolist(), far[seen].tolist(), strict=True)
    )
    try:
        return nx.dijkstra_path_length(graph, 0, 1)
    except nx.NetworkXNoPath:
        return None


def _convex_corners(area):
    corners = [np.empty((0, 2))]
    for part in shapely.get_parts(area):
        for line in shapely.get_rings(shapely.orient_polygons(part)):
            points = shapely.get_coordinates(line)[:-1]
            before, after = points - np.roll(points, 1, 0), np.roll(points, -1, 0) - points
            turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
            corners.append(points[turn > 0])
    return np.vstack(corners)


def lattice_graph(polygons, outline, shape):
    """Free nodes and edges by shapely distances, as a networkx graph, and all distances."""
    solid = shapes(polygons)
    inside = shapely.Polygon(outline)
    graph = nx.Graph()
    for i in range(shape[0]):
        for j in range(shape[1]):
            point = shapely.Point(0.25 * i, 0.25 * j)
            if inside.covers(point) and _far(solid, point):
                graph.add_node((i, j))
    for i, j in list(graph):
        for a, b in ((i + 1, j), (i, j + 1)):
            line = shapely.LineString([(0.25 * i, 0.25 * j), (0.25 * a, 0.25 * b)])
            if (a, b) in graph and _far(solid, line) and inside.covers(line):
                graph.add_edge((i, j), (a, b))
    return graph


def _far(solid, geometry):
    return len(solid) == 0 or bool(shapely.distance(solid, geometry).min() >= RADIUS)
