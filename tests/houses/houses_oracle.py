"""Rules of a house, checked with shapely and networkx: slow, plain, independent."""

from __future__ import annotations

import itertools

import networkx as nx
import numpy as np
import shapely
from shapely.geometry import MultiPoint, Point, Polygon, box

from internav_data.geometry import asset_corners, transform
from internav_data.records import OUTSIDE

HALF_WALL_M = 0.06
DOOR_CLEAR_M = 0.65
RADIUS_M = 0.2
SPACING_M = 0.25
HABITABLE = {"bedroom", "dining", "kitchen", "living", "office", "studio"}
"""Room types with legal minima: an own copy."""
ASSETS_OF = {
    "bathroom": {"Toilet"},
    "bedroom": {"Bed"},
    "dining": {"DiningTable"},
    "hall": {"CoatRack", "ShoeCabinet"},
    "kitchen": {"Stove"},
    "laundry": {"WashingMachine"},
    "living": {"Sofa"},
    "office": {"Desk"},
    "storage": {"StorageRack", "ShelvingUnit", "Box", "Bookcase"},
    "studio": {"Bed"},
}
"""Assets of which a room has at least one: what makes it a room of its type."""


def room_polygon(room):
    return Polygon(room.polygon)


def clear_polygon(room):
    return room_polygon(room).buffer(-HALF_WALL_M, join_style="mitre")


def parts_of(house, thing):
    """(plan polygon, z_min, z_max) of each part."""
    asset = house.assets[thing.asset_id]
    corners, starts = asset_corners(asset)
    moved = transform(corners, thing.pose)
    out = []
    for a, b in itertools.pairwise(starts):
        points = moved[a:b]
        out.append((MultiPoint(points[:, :2]).convex_hull, points[:, 2].min(), points[:, 2].max()))
    return out


def check_rooms(house):
    polygons = [room_polygon(room) for room in house.rooms]
    outline = Polygon(house.outline)
    assert outline.is_valid
    assert outline.exterior.is_ccw
    for room, polygon in zip(house.rooms, polygons, strict=True):
        assert polygon.is_valid, room
        assert polygon.exterior.is_ccw, room
        assert abs(polygon.area - room.area_m2) < 1e-3, room
        for (ax, ay), (bx, by) in itertools.pairwise([*room.polygon, room.polygon[0]]):
            assert ax == bx or ay == by, room
    for a, b in itertools.combinations(polygons, 2):
        assert shapely.intersection(a, b, grid_size=1e-9).area < 1e-9
    union = shapely.union_all(polygons)
    assert shapely.symmetric_difference(union, outline, grid_size=1e-9).area < 1e-9
    assert abs(house.area_m2 - outline.area) < 1e-3
    x0, y0, _, _ = outline.buffer(-HALF_WALL_M, join_style="mitre").bounds
    assert abs(x0) < 1e-9
    assert abs(y0) < 1e-9


def door_zone(door, side):
    half = door.width_m / 2
    near, far = sorted((side * HALF_WALL_M, side * (HALF_WALL_M + DOOR_CLEAR_M)))
    if door.yaw_deg == 0.0:
        return box(door.x - half, door.y + near, door.x + half, door.y + far)
    return box(door.x + near, door.y - half, door.x + far, door.y + half)


def check_doors(house):
    graph = nx.Graph()
    graph.add_nodes_from(room.room_id for room in house.rooms)
    for door in house.doors:
        a, b = door.rooms
        assert a < b
        assert (a == OUTSIDE) == (door.kind == "entrance") == (not door.open)
        zones = {side: door_zone(door, side) for side in (-1, 1)}
        for room in house.rooms:
            if room.room_id in door.rooms:
                clear = clear_polygon(room).buffer(1e-6)
                assert sum(clear.covers(zone) for zone in zones.values()) == 1, (door, room)
        for thing in house.objects:
            for plan, low, high in parts_of(house, thing):
                if low < door.height_m and high > 0.02:
                    assert all(zone.intersection(plan).area < 1e-6 for zone in zones.values()), (
                        door,
                        thing,
                    )
        if door.open:
            graph.add_edge(a, b)
            opening = shapely.union_all(list(zones.values())).convex_hull
            for wall in house.walls:
                if wall.z_min < door.height_m - 1e-9:
                    solid = box(wall.x_min, wall.y_min, wall.x_max, wall.y_max)
                    assert solid.intersection(opening).area < 1e-6, (door, wall)
    assert nx.is_connected(graph)
    assert sorted(tuple(sorted(e)) for e in graph.edges) == sorted(house.room_graph)


def check_walls(house):
    """Walls share no volume and stand exactly on the polygons' edges."""
    boxes = [box(w.x_min, w.y_min, w.x_max, w.y_max) for w in house.walls]
    for (a, wa), (b, wb) in itertools.combinations(zip(house.walls, boxes, strict=True), 2):
        if min(a.z_max, b.z_max) - max(a.z_min, b.z_min) > 1e-9:
            assert wa.intersection(wb).area < 1e-9, (a, b)
    lines = shapely.union_all([room_polygon(room).exterior for room in house.rooms])
    expected = lines.buffer(HALF_WALL_M, cap_style="square", join_style="mitre")
    low = [w for w, wall in zip(boxes, house.walls, strict=True) if wall.z_min == 0.0]
    gaps = [
        box(d.x - d.width_m / 2, d.y - 0.06, d.x + d.width_m / 2, d.y + 0.06)
        if d.yaw_deg == 0.0
        else box(d.x - 0.06, d.y - d.width_m / 2, d.x + 0.06, d.y + d.width_m / 2)
        for d in house.doors
        if d.open
    ]
    got = shapely.union_all([*low, *gaps])
    assert shapely.symmetric_difference(got, expected, grid_size=1e-9).area < 1e-6
    volume = sum(
        (w.x_max - w.x_min) * (w.y_max - w.y_min) * (w.z_max - w.z_min) for w in house.walls
    )
    ceiling = house.rooms[0].ceiling_m
    holes = sum(0.12 * d.width_m * d.height_m for d in house.doors if d.open)
    holes += sum(0.12 * w.width_m * w.height_m for w in house.windows)
    assert abs(volume - (expected.area * ceiling - holes)) < 1e-3


def check_carried(house, thing, own, below):
    """What stands on furniture lies within a top of it, and never on a rug."""
    assert house.assets[house.objects[thing.support].asset_id].blocks, thing
    tops = shapely.union_all([plan for plan, _, high in below if abs(high - thing.z) < 1e-3])
    plan = shapely.union_all([plan for plan, _, _ in own])
    assert tops.buffer(1e-3, join_style="mitre").covers(plan), thing


def check_things(house):
    parts = [parts_of(house, thing) for thing in house.objects]
    bounds = [shapely.union_all([plan for plan, _, _ in ps]).bounds for ps in parts]
    for k, thing in enumerate(house.objects):
        assert thing.object_id == k
        room = clear_polygon(house.rooms[thing.room])
        for plan, low, high in parts[k]:
            assert room.covers(plan), thing
            assert low >= -1e-9, thing
            assert high <= house.rooms[thing.room].ceiling_m + 1e-9, thing
        if thing.support >= 0:
            below = house.objects[thing.support]
            tops = [high for _, _, high in parts[thing.support]]
            assert below.room == thing.room
            assert any(abs(top - thing.z) < 1e-3 for top in tops), (thing, below)
            check_carried(house, thing, parts[k], parts[thing.support])
        elif not house.assets[thing.asset_id].blocks:
            assert max(high for _, _, high in parts[k]) <= 0.004, "a rug that things sink into"
    check_apart(house, parts, bounds)


def check_apart(house, parts, bounds):
    """No two things share volume, but for rugs, which are floor."""
    solid = [k for k, t in enumerate(house.objects) if house.assets[t.asset_id].blocks]
    for a, b in itertools.combinations(solid, 2):
        if house.objects[a].room != house.objects[b].room:
            continue
        ax, ay, bx, by = bounds[a]
        cx, cy, dx, dy = bounds[b]
        if ax > dx or cx > bx or ay > dy or cy > by:
            continue
        for (pa, la, ha), (pb, lb, hb) in itertools.product(parts[a], parts[b]):
            if min(ha, hb) - max(la, lb) > 1e-4:
                assert pa.intersection(pb).area < 1e-6, (house.objects[a], house.objects[b])


def widest_rectangle(polygon, least_area):
    """Largest short side of a rectangle of at least an area inside a rectilinear polygon."""
    xs = sorted({x for x, _ in polygon.exterior.coords})
    ys = sorted({y for _, y in polygon.exterior.coords})
    grown = polygon.buffer(1e-6, join_style="mitre")
    best = 0.0
    for x0, x1 in itertools.combinations(xs, 2):
        for y0, y1 in itertools.combinations(ys, 2):
            if (x1 - x0) * (y1 - y0) >= least_area and grown.covers(box(x0, y0, x1, y1)):
                best = max(best, min(x1 - x0, y1 - y0))
    return best


def check_realistic(house):
    """The stated minima of real homes, between wall faces."""
    for room in house.rooms:
        clear = clear_polygon(room)
        assert clear.geom_type == "Polygon", room
        assert 2.4 <= room.ceiling_m <= 3.2
        if room.type in HABITABLE:
            assert clear.area >= 6.5, room
            assert widest_rectangle(clear, 0.0) >= 2.13 - 1e-9, room
        if room.type == "hall":
            assert widest_rectangle(clear, 0.0) >= 0.91, room
            assert not clear.buffer(-0.455).is_empty, room
        beds = [t for t in house.objects if t.room == room.room_id and t.type == "Bed"]
        if room.type == "bedroom" and any(house.assets[t.asset_id].size[0] >= 1.3 for t in beds):
            assert clear.area >= 11.5, room
            assert widest_rectangle(clear, 0.0) >= 2.75 - 1e-9, room
    for door in house.doors:
        assert 0.77 <= door.width_m <= 0.96, door


def blocked_area(house):
    """Union of everything in the disc's way."""
    solids = [
        box(w.x_min, w.y_min, w.x_max, w.y_max)
        for w in house.walls
        if w.z_min < 1.8 and w.z_max > 0.02
    ]
    for thing in house.objects:
        if house.assets[thing.asset_id].blocks:
            solids += [
                plan for plan, low, high in parts_of(house, thing) if low < 1.8 and high > 0.02
            ]
    return shapely.union_all(solids)


def free_graph(house):
    """Nodes and edges where the disc keeps its distance, as a networkx graph."""
    blocked = blocked_area(house)
    shapely.prepare(blocked)
    x0, y0, x1, y1 = Polygon(house.outline).bounds
    nodes = [
        (i, j)
        for i in range(round(x0 / SPACING_M), round(x1 / SPACING_M) + 1)
        for j in range(round(y0 / SPACING_M), round(y1 / SPACING_M) + 1)
    ]
    xy = np.array(nodes) * SPACING_M
    near = shapely.dwithin(blocked, shapely.points(xy), RADIUS_M - 1e-6 - 1e-12)
    outline = Polygon(house.outline)
    inside = shapely.contains_xy(outline, xy[:, 0], xy[:, 1])
    graph = nx.Graph()
    graph.add_nodes_from(
        n for n, bad, good in zip(nodes, near, inside, strict=True) if good and not bad
    )
    for i, j in list(graph.nodes):
        for other in ((i + 1, j), (i, j + 1)):
            if other in graph:
                line = shapely.LineString(
                    [(i * SPACING_M, j * SPACING_M), (other[0] * SPACING_M, other[1] * SPACING_M)]
                )
                if not shapely.dwithin(blocked, line, RADIUS_M - 1e-6 - 1e-12):
                    graph.add_edge((i, j), other)
    return graph


def furniture_boxes(house):
    """Bounding boxes in plan of what blocks the way, (x0, y0, x1, y1)."""
    boxes = []
    for thing in house.objects:
        if house.assets[thing.asset_id].blocks:
            plans, low, high = zip(*parts_of(house, thing), strict=True)
            if min(low) < 1.8 and max(high) > 0.02:
                boxes.append(shapely.union_all(plans).bounds)
    return boxes


def check_reachable(house, share=0.8):
    graph, boxes = free_graph(house), furniture_boxes(house)
    main = max(nx.connected_components(graph), key=lambda c: (len(c), min(c)))
    for room in house.rooms:
        polygon = room_polygon(room)
        nodes = [n for n in graph if polygon.contains(Point(n[0] * SPACING_M, n[1] * SPACING_M))]
        joined = sum(n in main for n in nodes)
        assert joined > 0, room
        # Furnishing counts the nodes that squares of the disc's radius around bounding boxes leave;
        # of those that only the true shapes leave, a few may lie in a pocket.
        clear = [
            n
            for n in nodes
            if not any(
                x0 - RADIUS_M < n[0] * SPACING_M < x1 + RADIUS_M
                and y0 - RADIUS_M < n[1] * SPACING_M < y1 + RADIUS_M
                for x0, y0, x1, y1 in boxes
            )
        ]
        assert sum(n in main for n in clear) >= share * len(clear), (room.type, len(clear))
        assert joined >= share * len(nodes) - 2, (room.type, joined, len(nodes))
    for door in house.doors:
        if not door.open:
            continue
        zone = shapely.union_all([door_zone(door, -1), door_zone(door, 1)]).convex_hull
        low = [n for n in main if zone.contains(Point(n[0] * SPACING_M, n[1] * SPACING_M))]
        assert nx.is_connected(graph.subgraph(low)), door
        assert len(low) >= 4, door


def check_house(house, *, reachable=True):
    check_rooms(house)
    check_walls(house)
    check_doors(house)
    check_things(house)
    if reachable:
        check_reachable(house)
