"""Rules of a home that works, counted over houses by plain code of its own.

Each rule takes a house and returns (kept, of): how many of the rooms or things it is about keep it.
They are for houses whose rooms are drawn: a user's programme or floor plan may break any of them.
"""

from __future__ import annotations

import itertools
from collections import Counter
from typing import TYPE_CHECKING

import networkx as nx
import numpy as np
import shapely
from shapely.geometry import MultiPoint, Polygon, box

from internav_data.geometry import asset_corners, transform

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from internav_data.records import House, SceneObject

Count = tuple[int, int]
"""Number of rooms or things that keep a rule, and of those it is about."""
PUBLIC = {"living", "studio", "hall", "dining"}
"""Rooms that everybody in a house may use."""
DAYLIGHT_M = 1.3
"""Length of an outer wall that can hold a window."""
RUG_M = 0.004
"""Height of a rug that nothing on it seems sunk into."""
SEEN_M2 = 1e-4
"""Area of an overhang that counts."""
LONGEST_BEDROOM = 2.2
"""Largest ratio of a bedroom's sides, between wall faces."""
WALL_M = 0.12
"""Thickness of walls."""
SEATS = {"ArmChair", "Bed", "Bench", "Chair", "OfficeChair", "Sofa"}
"""Furniture from which somebody watches."""
WATCHED_M, WATCHED_DEG = 6.0, 50.0
"""Largest distance of a watched television, and angle of it and of the seat to the line between."""


def _count(answers: Iterable[bool]) -> Count:
    found = list(answers)
    return sum(found), len(found)


def _types(house: House, room: int | None = None) -> Counter[str]:
    """Types of the things in a house or in one room."""
    return Counter(t.type for t in house.objects if room in {None, t.room})


def _rooms(house: House, *types: str) -> list[int]:
    return [room.room_id for room in house.rooms if room.type in types]


def _has(thing: str) -> Callable[[House], Count]:
    """Return the rule that houses of two rooms and more have a thing."""

    def rule(house: House) -> Count:
        return _count([thing in _types(house)] if len(house.rooms) > 1 else [])

    return rule


def _every(room: str, *wanted: str) -> Callable[[House], Count]:
    """Return the rule that rooms of a type have things of some types."""

    def rule(house: House) -> Count:
        return _count({*wanted} <= _types(house, k).keys() for k in _rooms(house, room))

    return rule


def kitchenette(house: House) -> Count:
    """Studios without a kitchen beside them have stove, sink, counter and fridge."""
    studios = [] if _rooms(house, "kitchen") else _rooms(house, "studio")
    wanted = {"Stove", "Sink", "CounterTop", "Fridge"}
    return _count(wanted <= _types(house, k).keys() for k in studios)


def clothes_in_a_studio(house: House) -> Count:
    """Studios have a wardrobe or a dresser."""
    return _count(
        bool({"Wardrobe", "Dresser"} & _types(house, k).keys()) for k in _rooms(house, "studio")
    )


def public_rooms_together(house: House) -> Count:
    """Kitchen, living room, dining room and hall are joined without a private room between."""
    public = _rooms(house, *PUBLIC, "kitchen")
    graph = nx.Graph()
    graph.add_nodes_from(public)
    graph.add_edges_from(edge for edge in house.room_graph if {*edge} <= {*public})
    return _count([nx.is_connected(graph)] if len(public) > 1 else [])


def chairs_at_tables(house: House) -> Count:
    """Dining tables have two chairs or more."""
    chairs = Counter(t.group for t in house.objects if t.type == "Chair" and t.group >= 0)
    return _count(chairs[t.group] > 1 for t in house.objects if t.type == "DiningTable")


def _front(thing: SceneObject) -> tuple[float, float]:
    """Return the unit vector of the direction in which a thing faces: its own -y."""
    z, w = thing.quaternion[2:]
    return 2.0 * z * w, z * z - w * w


def _angle_deg(first: tuple[float, float], second: tuple[float, float]) -> float:
    lengths = np.hypot(*first) * np.hypot(*second)
    return float(np.degrees(np.arccos(np.clip(np.dot(first, second) / lengths, -1.0, 1.0))))


def televisions_are_watched(house: House) -> Count:
    """Televisions are faced by a seat or a bed, and face it."""

    def watches(seat: SceneObject, screen: SceneObject) -> bool:
        line = screen.x - seat.x, screen.y - seat.y
        back = -line[0], -line[1]
        return (
            float(np.hypot(*line)) < WATCHED_M
            and _angle_deg(_front(seat), line) < WATCHED_DEG
            and _angle_deg(_front(screen), back) < WATCHED_DEG
        )

    return _count(
        any(t.room == screen.room and t.type in SEATS and watches(t, screen) for t in house.objects)
        for screen in house.objects
        if screen.type == "Television"
    )


def bedrooms_are_no_corridors(house: House) -> Count:
    """Bedrooms are at most `LONGEST_BEDROOM` times as long as wide."""
    answers = []
    for room in _rooms(house, "bedroom"):
        x0, y0, x1, y1 = Polygon(house.rooms[room].polygon).bounds
        short, long = sorted((x1 - x0 - WALL_M, y1 - y0 - WALL_M))
        answers.append(long <= LONGEST_BEDROOM * short)
    return _count(answers)


def _reaches(house: House, bath: int, without: set[str]) -> bool:
    """Whether a public room can be reached from a bathroom without passing rooms of some types."""
    graph = nx.Graph(house.room_graph)
    graph.add_nodes_from(room.room_id for room in house.rooms)
    graph.remove_nodes_from([k for k in _rooms(house, *without) if k != bath])
    near = nx.node_connected_component(graph, bath)
    return bool(near & set(_rooms(house, *PUBLIC)))


def bathroom_beside_the_kitchen(house: House) -> Count:
    """No bathroom is reached through the kitchen alone."""
    return _count(_reaches(house, k, {"kitchen"}) for k in _rooms(house, "bathroom"))


def bathroom_for_all(house: House) -> Count:
    """Count the houses with a bathroom that is reached without passing a private room."""
    baths = _rooms(house, "bathroom")
    private = {room.type for room in house.rooms} - PUBLIC - {"kitchen"}
    return _count([any(_reaches(house, k, private) for k in baths)] if baths else [])


def _outer_wall_m(house: House, room: int) -> float:
    outer = Polygon(house.outline).exterior
    shared = shapely.intersection(Polygon(house.rooms[room].polygon).exterior, outer)
    lines = shapely.get_parts(shapely.line_merge(shared))
    return max((line.length for line in lines), default=0.0)


def living_rooms_have_windows(house: House) -> Count:
    """Living rooms and studios with an outer wall have a window."""
    lit = {window.room for window in house.windows}
    rooms = [k for k in _rooms(house, "living", "studio") if _outer_wall_m(house, k) >= DAYLIGHT_M]
    return _count(k in lit for k in rooms)


def _lit(*types: str) -> Callable[[House], Count]:
    """Return the rule that rooms of some types have a window."""

    def rule(house: House) -> Count:
        lit = {window.room for window in house.windows}
        return _count(k in lit for k in _rooms(house, *types))

    return rule


def one_dining_table(house: House) -> Count:
    """Count the houses with one dining table at most, or one for each dining room."""
    return _count([_types(house)["DiningTable"] <= max(1, len(_rooms(house, "dining")))])


def one_shower(house: House) -> Count:
    """No bathroom has two showers."""
    return _count(_types(house, k)["Shower"] < 2 for k in _rooms(house, "bathroom"))


def _plans(house: House, thing: SceneObject) -> list[tuple[Polygon, float, float]]:
    """Plan, bottom and top of each part of a thing."""
    corners, starts = asset_corners(house.assets[thing.asset_id])
    moved = transform(corners, thing.pose)
    parts = [moved[a:b] for a, b in itertools.pairwise(starts)]
    return [(MultiPoint(p[:, :2]).convex_hull, p[:, 2].min(), p[:, 2].max()) for p in parts]


def no_overhang(house: House) -> Count:
    """Things on furniture lie within the top that carries them."""
    answers = []
    for thing in house.objects:
        if thing.support < 0:
            continue
        tops = [
            plan
            for plan, _, high in _plans(house, house.objects[thing.support])
            if abs(high - thing.z) < 0.002
        ]
        own = shapely.union_all([plan for plan, _, _ in _plans(house, thing)])
        beyond = shapely.difference(own, shapely.buffer(shapely.union_all(tops), 0.001))
        answers.append(beyond.area < SEEN_M2)
    return _count(answers)


def pictures_are_seen(house: House) -> Count:
    """No television stands before a picture or mirror on the wall."""
    screens = [t for t in house.objects if t.type == "Television"]
    return _count(
        not any(s.room == t.room and _before(house, s, t) for s in screens)
        for t in house.objects
        if t.type in {"Painting", "Mirror"}
    )


def _before(house: House, screen: SceneObject, picture: SceneObject) -> bool:
    """Whether a screen covers part of a picture, seen at a right angle to the picture's wall."""
    one, two = (house.assets[t.asset_id] for t in (screen, picture))
    if screen.z + one.size[2] <= picture.z or picture.z + two.size[2] <= screen.z:
        return False
    # The bounding box of the picture, drawn out by 0.6 m on its thin side.
    x0, y0, x1, y1 = shapely.union_all([p for p, _, _ in _plans(house, picture)]).bounds
    deep = 0.6
    reach = (
        box(x0 - deep, y0, x1 + deep, y1)
        if x1 - x0 < y1 - y0
        else box(x0, y0 - deep, x1, y1 + deep)
    )
    return any(reach.intersection(plan).area > SEEN_M2 for plan, _, _ in _plans(house, screen))


def thin_rugs(house: House) -> Count:
    """Rugs are so thin that nothing on them seems sunk."""
    rugs = [t for t in house.objects if not house.assets[t.asset_id].blocks and t.z == 0.0]
    return _count(house.assets[t.asset_id].size[2] <= RUG_M for t in rugs)


RULES: dict[str, Callable[[House], Count]] = {
    "toilet": _has("Toilet"),
    "stove": _has("Stove"),
    "counter": _has("CounterTop"),
    "fridge": _has("Fridge"),
    "kitchenette in a studio": kitchenette,
    "wardrobe or dresser in a studio": clothes_in_a_studio,
    "kitchen and living room not behind a private room": public_rooms_together,
    "two chairs at a dining table": chairs_at_tables,
    "television that somebody faces": televisions_are_watched,
    "bedroom no longer than 2.2 to 1": bedrooms_are_no_corridors,
    "bathroom not only through the kitchen": bathroom_beside_the_kitchen,
    "a bathroom not behind a private room": bathroom_for_all,
    "window in a living room with an outer wall": living_rooms_have_windows,
    "window in a bedroom": _lit("bedroom"),
    "window in a kitchen": _lit("kitchen"),
    "one dining table": one_dining_table,
    "one shower in a bathroom": one_shower,
    "toilet in a bathroom": _every("bathroom", "Toilet"),
    "basin in a bathroom": _every("bathroom", "Sink"),
    "wardrobe in a bedroom": _every("bedroom", "Wardrobe"),
    "bed in a bedroom": _every("bedroom", "Bed"),
    "stove in a kitchen": _every("kitchen", "Stove"),
    "things within the top they stand on": no_overhang,
    "no television before a picture": pictures_are_seen,
    "rugs of 4 mm at most": thin_rugs,
}
"""Rules by name."""


def plan_of(house: House) -> tuple[object, ...]:
    """Return the plan of a house as it can be compared: types and polygons of its rooms."""
    return tuple((room.type, room.polygon) for room in house.rooms)


def repeated_plans(houses: Sequence[House]) -> int:
    """Count the houses whose plan an earlier one has."""
    return len(houses) - len({plan_of(house) for house in houses})


def area_spread(areas: Sequence[float]) -> float:
    """Return how many times the 95 % quantile of some areas is the 5 % quantile."""
    low, high = np.quantile(areas, [0.05, 0.95])
    return float(high / low)


def kept_rules(houses: Iterable[House]) -> dict[str, Count]:
    """Return (kept, of) by rule over some houses."""
    total = {name: [0, 0] for name in RULES}
    for house in houses:
        for name, rule in RULES.items():
            kept, of = rule(house)
            total[name][0] += kept
            total[name][1] += of
    return {name: (kept, of) for name, (kept, of) in total.items()}
