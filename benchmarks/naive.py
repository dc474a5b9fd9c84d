"""Baseline: episodes as one would write them with networkx, shapely and plain pybullet.

The same algorithm as `internav_data.episodes` and the same definitions (exact distances, Bullet
settles every obstacle), written with care for these libraries: data that episodes share is
computed once a house, shapely is called on arrays, trees are queried instead of scanned, graphs are
edited instead of rebuilt. It lacks only compiled kernels, and physics that is solved once and
reused.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import islice, pairwise, product
from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np
import shapely
from naive_bullet import settle
from shapely.affinity import translate

from internav_data.geometry import part_corners, transform, yaw_quaternion
from internav_data.records import Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from naive_bullet import SettledPose

    from internav_data.records import Asset, House

SPACING = 0.25
CLEARANCE = 0.2 - 1e-6
LOW, HIGH = 0.02, 1.8
GAP = 0.01
SIDEWAYS = 0.25
LEAST_CLEAR = 2.0
SPOTS, REDRAWS = 200, 50
ROUND = 4  # grown corners turn in steps of 22.5 degrees: ways are right to 0.4 %

Point = tuple[float, float]
Node = tuple[int, int]


def plan_of(asset: Asset, pose: Pose) -> list[shapely.Polygon]:
    """Footprint: each part between 2 cm and 1.8 m, projected."""
    if not asset.blocks:
        return []
    polygons = []
    for part in asset.parts:
        corners = transform(part_corners(part), pose)
        inside = corners[(corners[:, 2] >= LOW) & (corners[:, 2] <= HIGH)]
        pieces = [inside[:, :2]]
        for level in (LOW, HIGH):
            below, above = corners[corners[:, 2] < level], corners[corners[:, 2] > level]
            if len(below) and len(above):
                a, b = np.repeat(below, len(above), axis=0), np.tile(above, (len(below), 1))
                t = (level - a[:, 2:]) / (b[:, 2:] - a[:, 2:])
                pieces.append((a + t * (b - a))[:, :2])
        points = np.vstack(pieces)
        if len(points) > 2:
            polygons.append(shapely.MultiPoint(points).convex_hull)
    return polygons


@lru_cache(maxsize=16384)
def standing(asset: Asset, yaw_deg: int) -> shapely.Geometry:
    """Footprint of an upright asset at the origin, as one geometry."""
    pose = Pose(0.0, 0.0, 0.0, yaw_quaternion(yaw_deg))
    return shapely.union_all(plan_of(asset, pose))


def grown(geometry: shapely.Geometry) -> shapely.Geometry:
    """Return the positions at which the agent's disc touches a geometry."""
    return geometry.buffer(CLEARANCE, quad_segs=ROUND)


class Sight:
    """Visibility graph of the floor: networkx for the graph, shapely for what sees what."""

    def __init__(self, floor: shapely.Geometry) -> None:
        self.floor = floor
        self.open = _open(floor)
        self.corners, self.before, self.after = _reflex_corners(floor)
        self.graph = nx.Graph()
        self.graph.add_nodes_from(range(len(self.corners)))
        pairs = np.array([(a, b) for a in range(len(self.corners)) for b in range(a)])
        if len(pairs):
            self._connect(pairs)
        self.edges = list(self.graph.edges)
        self.lines = shapely.linestrings(self.corners[np.array(self.edges)]) if self.edges else []
        self.tree = shapely.STRtree(self.lines)
        self.seen: dict[Point, list[tuple[int, float]]] = {}

    def _connect(self, pairs: np.ndarray) -> None:
        a, b = self.corners[pairs[:, 0]], self.corners[pairs[:, 1]]
        useful = self._tangent(b - a, pairs[:, 0]) & self._tangent(a - b, pairs[:, 1])
        pairs, a, b = pairs[useful], a[useful], b[useful]
        open_ = shapely.covers(self.open, shapely.linestrings(np.stack([a, b], axis=1)))
        lengths = np.linalg.norm(a - b, axis=1)
        self.graph.add_weighted_edges_from(
            (int(m), int(n), float(d))
            for (m, n), d in zip(pairs[open_], lengths[open_], strict=True)
        )

    def _tangent(self, ray: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Whether shortest ways can bend at a corner when they come along a ray."""
        first, second = self.before[at] - self.corners[at], self.after[at] - self.corners[at]
        left = ray[:, 0] * first[:, 1] - ray[:, 1] * first[:, 0]
        right = ray[:, 0] * second[:, 1] - ray[:, 1] * second[:, 0]
        return left * right >= -1e-12

    def visible(self, point: Point) -> list[tuple[int, float]]:
        """Corners seen from a point, with their distances."""
        if point not in self.seen:
            everyone = np.arange(len(self.corners))
            useful = everyone[self._tangent(np.array(point) - self.corners, everyone)]
            targets = self.corners[useful]
            lines = shapely.linestrings(
                np.stack([np.broadcast_to(point, targets.shape), targets], axis=1)
            )
            open_ = shapely.covers(self.open, lines)
            self.seen[point] = [(int(k), math.dist(point, self.corners[k])) for k in useful[open_]]
        return self.seen[point]

    def path(self, start: Point, goal: Point) -> list[Point] | None:
        """Shortest way as points, None where there is none."""
        if shapely.covers(self.open, shapely.LineString([start, goal])):
            return [start, goal]
        for name, point in (("start", start), ("goal", goal)):
            self.graph.add_weighted_edges_from((name, k, d) for k, d in self.visible(point))
        try:
            middle = nx.dijkstra_path(self.graph, "start", "goal")[1:-1]
        except (nx.NetworkXNoPath, nx.NodeNotFound):
            return None
        finally:
            self.graph.remove_nodes_from(["start", "goal"])
        return [start, *(tuple(self.corners[k]) for k in middle), goal]

    def with_obstacles(self, shapes: shapely.Geometry) -> Sight:
        """Visibility graph of the floor without some shapes, built from this one."""
        new = object.__new__(Sight)
        new.floor = shapely.difference(self.floor, shapes)
        new.open = _open(new.floor)
        old = {tuple(c): k for k, c in enumerate(self.corners.tolist())}
        corners, before, after = _reflex_corners(new.floor)
        fresh = [k for k, c in enumerate(corners.tolist()) if tuple(c) not in old]
        new.corners = np.vstack([self.corners, corners[fresh]])
        new.before = np.vstack([self.before, before[fresh]])
        new.after = np.vstack([self.after, after[fresh]])
        new.graph = self.graph.copy()
        cut = [self.edges[k] for k in self.tree.query(shapes, predicate="crosses")]
        cut += [self.edges[k] for k in self.tree.query(shapes, predicate="contains")]
        new.graph.remove_edges_from(cut)
        first = len(self.corners)
        pairs = np.array(
            [(a, b) for a in range(first, len(new.corners)) for b in range(a)], dtype=np.int64
        )
        if len(pairs):
            new._connect(pairs)
        new.seen = {}
        return new


def _open(floor: shapely.Geometry) -> shapely.Geometry:
    """Return the floor a micrometre larger: ways that touch its corners stay inside it."""
    larger = floor.buffer(1e-6, join_style="mitre")
    shapely.prepare(larger)
    return larger


def _reflex_corners(floor: shapely.Geometry) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners around which ways can bend, with the corners before and after them."""
    found: list[np.ndarray] = [np.empty((0, 6))]
    for polygon in shapely.get_parts(floor):
        if not isinstance(polygon, shapely.Polygon) or polygon.is_empty:
            continue
        polygon = shapely.geometry.polygon.orient(polygon)  # noqa: PLW2901
        for ring in (polygon.exterior, *polygon.interiors):
            at = np.asarray(ring.coords)[:-1]
            before, after = np.roll(at, 1, axis=0), np.roll(at, -1, axis=0)
            u, v = at - before, after - at
            reflex = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] < -1e-12
            found.append(np.hstack([at, before, after])[reflex])
    stacked = np.vstack(found)
    return stacked[:, :2], stacked[:, 2:4], stacked[:, 4:]


def blockers_of(house: House) -> list[shapely.Polygon]:
    """Return the plans of all that blocks: walls and furniture between the two heights."""
    walls = [
        shapely.box(w.x_min, w.y_min, w.x_max, w.y_max)
        for w in house.walls
        if w.z_min < HIGH and w.z_max > LOW
    ]
    return walls + [
        plan
        for thing in house.objects
        for plan in plan_of(house.assets[thing.asset_id], thing.pose)
    ]


@dataclass
class SharedHouse:
    """Data of a house that its episodes share."""

    house: House
    blockers: list[shapely.Polygon]
    tree: shapely.STRtree
    grid: nx.Graph
    edges: list[tuple[Node, Node]]
    edge_tree: shapely.STRtree
    node_list: list[Node]
    node_tree: shapely.STRtree
    component: list[Node]
    rooms: dict[int, Any]
    room_graph: nx.Graph
    sight: Sight
    paths: dict[tuple[Point, Point], list[Point] | None] = field(default_factory=dict)

    @staticmethod
    def of(house: House) -> SharedHouse:
        """Compute the data of a house that its episodes share."""
        blockers = blockers_of(house)
        tree = shapely.STRtree(blockers)
        outline = shapely.Polygon(house.outline)
        x_max, y_max = outline.bounds[2:]
        nodes = [
            (i, j) for i in range(int(x_max / SPACING) + 1) for j in range(int(y_max / SPACING) + 1)
        ]
        points = shapely.points(np.array(nodes) * SPACING)
        free = shapely.contains(outline, points)
        free[tree.query(points, predicate="dwithin", distance=CLEARANCE)[0]] = False
        kept = {n for n, f in zip(nodes, free, strict=True) if f}
        edges = [
            ((i, j), other)
            for i, j in sorted(kept)
            for other in ((i + 1, j), (i, j + 1))
            if other in kept
        ]
        lines = shapely.linestrings(np.array(edges) * SPACING)
        blocked = set(tree.query(lines, predicate="dwithin", distance=CLEARANCE)[0].tolist())
        keep = [k for k in range(len(edges)) if k not in blocked]
        grid = nx.Graph()
        grid.add_nodes_from(sorted(kept))
        grid.add_edges_from(edges[k] for k in keep)
        node_list = sorted(kept)
        floor = shapely.difference(outline, grown(shapely.union_all(blockers)))
        room_graph = nx.Graph(list(house.room_graph))
        room_graph.add_nodes_from(r.room_id for r in house.rooms)
        rooms = {r.room_id: shapely.Polygon(r.polygon) for r in house.rooms}
        for polygon in rooms.values():
            shapely.prepare(polygon)
        return SharedHouse(
            house=house,
            blockers=blockers,
            tree=tree,
            grid=grid,
            edges=[edges[k] for k in keep],
            edge_tree=shapely.STRtree(lines[keep]),
            node_list=node_list,
            node_tree=shapely.STRtree(shapely.points(np.array(node_list) * SPACING)),
            component=sorted(max(nx.connected_components(grid), key=len)),
            rooms=rooms,
            room_graph=room_graph,
            sight=Sight(floor),
        )

    def room_of(self, x: float, y: float) -> int:
        """Return the id of the room that holds a point."""
        point = shapely.Point(x, y)
        return next((k for k, polygon in self.rooms.items() if polygon.covers(point)), -1)

    def path(self, a: Point, b: Point) -> list[Point] | None:
        """Return the shortest path in the house without obstacles."""
        if (a, b) not in self.paths:
            self.paths[a, b] = self.sight.path(a, b)
        return self.paths[a, b]

    def cut_by(self, shape: shapely.Geometry) -> tuple[list[Node], list[tuple[Node, Node]]]:
        """Return the nodes and edges that an obstacle blocks in the house's grid."""
        nodes = self.node_tree.query(shape, predicate="dwithin", distance=CLEARANCE)
        edges = self.edge_tree.query(shape, predicate="dwithin", distance=CLEARANCE)
        return [self.node_list[k] for k in nodes], [self.edges[k] for k in edges]


@dataclass
class NaiveObstacle:
    """An obstacle at rest."""

    asset: Asset
    rest: SettledPose
    shape: shapely.Geometry


@dataclass
class NaiveEpisode:
    """Fields of an episode that the comparison needs."""

    mode: str
    start: Node
    goal: Node
    shortest_path_steps: int
    shortest_path_m: float
    obstructed_path_steps: int | None
    obstructed_path_m: float | None
    obstacles: list[NaiveObstacle]


def length(points: list[Point]) -> float:
    return sum(math.dist(a, b) for a, b in pairwise(points))


def steps_between(grid: nx.Graph, start: Node, goal: Node) -> int | None:
    if start not in grid or goal not in grid:
        return None
    try:
        return int(nx.shortest_path_length(grid, start, goal))
    except nx.NetworkXNoPath:
        return None


def judge(
    site: SharedHouse, start: Node, goal: Node, shapes: Sequence[shapely.Geometry]
) -> tuple[int | None, float | None]:
    """Return the lattice steps and Euclidean metres of the path among obstacles."""
    grid = site.grid.copy()
    for shape in shapes:
        nodes, edges = site.cut_by(shape)
        grid.remove_edges_from(edges)
        grid.remove_nodes_from(nodes)
    sight = site.sight.with_obstacles(grown(shapely.union_all(list(shapes))))
    path = sight.path(_metres(start), _metres(goal))
    return steps_between(grid, start, goal), None if path is None else length(path)


def _metres(node: Node) -> Point:
    return node[0] * SPACING, node[1] * SPACING


def build_episodes(
    site: SharedHouse,
    count: int,
    pool: Sequence[Asset],
    max_obstacles: int,
    rng: np.random.Generator,
) -> list[NaiveEpisode]:
    """Make episodes of one house."""
    return [_episode(site, index, pool, max_obstacles, rng) for index in range(count)]


def _episode(
    site: SharedHouse,
    index: int,
    pool: Sequence[Asset],
    max_obstacles: int,
    rng: np.random.Generator,
) -> NaiveEpisode:
    mode = "blocked" if (site.house.scene + index) % 2 == 0 else "lengthened"
    for _ in range(REDRAWS):
        start, goal, clear = _ends(site, rng)
        node_paths = _node_paths(site, start, goal)
        shortest_path_steps = steps_between(site.grid, start, goal)
        assert shortest_path_steps is not None
        episode = NaiveEpisode(
            mode, start, goal, shortest_path_steps, clear, shortest_path_steps, None, []
        )
        if _spawn(site, episode, node_paths, pool, max_obstacles, rng):
            shapes = [o.shape for o in episode.obstacles]
            path = site.sight.with_obstacles(grown(shapely.union_all(shapes))).path(
                _metres(start), _metres(goal)
            )
            episode.obstructed_path_m = None if path is None else length(path)
            return episode
    raise RuntimeError(f"{site.house.scene_id}: no episode in {REDRAWS} draws")


def _ends(site: SharedHouse, rng: np.random.Generator) -> tuple[Node, Node, float]:
    while True:
        a, b = (site.component[int(k)] for k in rng.integers(len(site.component), size=2))
        same = site.room_of(*_metres(a)) == site.room_of(*_metres(b))
        if same != (len(site.rooms) == 1):
            continue
        path = site.sight.path(_metres(a), _metres(b))
        if path is not None and length(path) >= LEAST_CLEAR:
            return a, b, length(path)


def _node_paths(site: SharedHouse, start: Node, goal: Node) -> list[list[Point]]:
    a, b = site.room_of(*_metres(start)), site.room_of(*_metres(goal))
    if a == b:
        return [[_metres(start), _metres(goal)]]
    doors: dict[tuple[int, int], list[Point]] = {}
    for door in site.house.doors:
        if door.open:
            doors.setdefault(door.rooms, []).append((door.x, door.y))
    rooms = sorted(nx.all_simple_paths(site.room_graph, a, b), key=lambda p: (len(p), p))[:64]
    found: list[list[Point]] = []
    for path in rooms:
        choices = [doors[min(s), max(s)] for s in pairwise(path)]
        some = islice(product(*choices), 64 - len(found))
        found += [[_metres(start), *centres, _metres(goal)] for centres in some]
    return found


def _spawn(
    site: SharedHouse,
    episode: NaiveEpisode,
    node_paths: list[list[Point]],
    pool: Sequence[Asset],
    max_obstacles: int,
    rng: np.random.Generator,
) -> bool:
    grid = site.grid.copy()
    for _ in range(SPOTS):
        if _done(episode):
            return True
        if len(episode.obstacles) == max_obstacles:
            return False
        obstacle = _try(site, episode, node_paths, pool, rng)
        if obstacle is None:
            continue
        nodes, edges = site.cut_by(obstacle.shape)
        edges = [e for e in edges if grid.has_edge(*e)]
        grid.remove_edges_from(edges)
        steps = steps_between(grid, episode.start, episode.goal)
        over = episode.start in nodes or episode.goal in nodes
        if over or (steps is None and episode.mode == "lengthened"):
            grid.add_edges_from(edges)
            continue
        episode.obstacles.append(obstacle)
        episode.obstructed_path_steps = steps
    return _done(episode)


def _done(episode: NaiveEpisode) -> bool:
    if episode.mode == "blocked":
        return episode.obstructed_path_steps is None
    return (
        episode.obstructed_path_steps is not None
        and episode.obstructed_path_steps > episode.shortest_path_steps
    )


def _try(  # noqa: PLR0911 - every refusal is a return
    site: SharedHouse,
    episode: NaiveEpisode,
    node_paths: list[list[Point]],
    pool: Sequence[Asset],
    rng: np.random.Generator,
) -> NaiveObstacle | None:
    asset = pool[int(rng.integers(len(pool)))]
    points = node_paths[int(rng.integers(len(node_paths)))]
    k = int(rng.integers(len(points) - 1))
    along, sideways = float(rng.random()), float(rng.normal(0.0, SIDEWAYS))
    yaw_deg = 15 * int(rng.integers(24))
    path = site.path(points[k], points[k + 1])
    if path is None:
        return None
    line = shapely.LineString(path)
    at = line.interpolate(along, normalized=True)
    ahead = line.interpolate(min(along * line.length + 0.01, line.length))
    behind = line.interpolate(max(along * line.length - 0.01, 0.0))
    ux, uy = ahead.x - behind.x, ahead.y - behind.y
    norm = math.hypot(ux, uy) or 1.0
    x, y = at.x - sideways * uy / norm, at.y + sideways * ux / norm
    if site.room_of(x, y) != site.room_of(at.x, at.y):
        return None
    x, y = round(x, 4), round(y, 4)
    shape = translate(standing(asset, yaw_deg), x, y)
    if len(site.tree.query(shape, predicate="dwithin", distance=GAP)):
        return None
    if any(shape.distance(o.shape) < GAP for o in episode.obstacles):
        return None
    others = [(o.asset, o.rest.pose, o.shape) for o in episode.obstacles]
    rest = settle(site.house, others, asset, x, y, yaw_deg, shape)
    if rest is None:
        return None
    exact = shapely.union_all(plan_of(asset, rest.pose))
    if len(site.tree.query(exact, predicate="intersects")):
        return None
    if any(exact.intersects(o.shape) for o in episode.obstacles):
        return None
    return NaiveObstacle(asset, rest, exact)
