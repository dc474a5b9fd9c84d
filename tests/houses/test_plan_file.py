"""Floor plans of a user's own: read, kept, and refused in one line that names room and file."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from internav_data.houses import load_floor_plan
from internav_data.houses.plan_shapes import FloorPlanError, lay_out, read_polygon
from internav_data.records.errors import UsageError

LIVING = {"type": "living", "polygon": [[0, 0], [5, 0], [5, 4], [0, 4]]}
BEDROOM = {"type": "bedroom", "polygon": [[5, 0], [9, 0], [9, 4], [5, 4]]}
DOOR = {"between": ["living", "bedroom"], "at": [5, 2], "width": 1.0}


def written(tmp_path, rooms=(LIVING, BEDROOM), doors=(DOOR,), **more):
    path = tmp_path / "flat.json"
    path.write_text(json.dumps({"rooms": list(rooms), "doors": list(doors), **more}))
    return path


def test_a_good_plan_is_read_and_moved_to_the_origin(tmp_path):
    found = load_floor_plan(written(tmp_path))
    assert found.types == ("living", "bedroom")
    assert found.grid.polygon(frozenset({0})) == ((-6, -6), (494, -6), (494, 394), (-6, 394))
    (door,) = found.doors
    assert (door.along_x, door.at, door.low, door.high) == (False, 494, 144, 244)
    assert door.rooms == (0, 1)
    assert found.windows is None


def test_corners_may_run_either_way_and_repeat_the_first(tmp_path):
    turned = {**LIVING, "polygon": [[0, 0], [0, 4], [2, 4], [2, 4], [5, 4], [5, 0], [0, 0]]}
    plain = load_floor_plan(written(tmp_path)).grid
    again = load_floor_plan(written(tmp_path, (turned, BEDROOM))).grid
    assert again.polygon(frozenset({0})) == plain.polygon(frozenset({0}))


def test_toml_and_json_say_the_same(tmp_path):
    path = tmp_path / "flat.toml"
    path.write_text(
        '[[rooms]]\ntype = "living"\npolygon = [[0, 0], [5, 0], [5, 4], [0, 4]]\n'
        '[[rooms]]\ntype = "bedroom"\npolygon = [[5, 0], [9, 0], [9, 4], [5, 4]]\n'
        '[[doors]]\nbetween = ["living", "bedroom"]\nat = [5, 2]\nwidth = 1.0\n'
    )
    assert load_floor_plan(path) == load_floor_plan(written(tmp_path))


def room(name, x0, y0, x1, y1):
    return {"name": name, "type": "office", "polygon": [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]}


BAD_PLANS = {
    "overlap": ((LIVING, room("den", 4, 0, 9, 4)), "'den': overlaps room 'living'"),
    "apart": ((LIVING, room("den", 6, 0, 9, 4)), "'den': shares no wall"),
    "corner only": ((LIVING, room("den", 5, 4, 9, 8)), "'den': shares no wall"),
    "slanted": (
        (LIVING, {**BEDROOM, "polygon": [[5, 0], [9, 0], [9, 4], [5.5, 4]]}),
        "'bedroom'.*rectilinear",
    ),
    "crossing itself": (
        (
            LIVING,
            {
                **BEDROOM,
                "polygon": [[5, 0], [9, 0], [9, 3], [7, 3], [7, -1], [8, -1], [8, 4], [5, 4]],
            },
        ),
        "'bedroom'.*crosses itself",
    ),
    "going back": (
        (LIVING, {**BEDROOM, "polygon": [[5, 0], [9, 0], [9, 4], [9, 2], [5, 2], [5, 0]]}),
        "'bedroom'.*crosses itself",
    ),
    "three corners": ((LIVING, {**BEDROOM, "polygon": [[5, 0], [9, 0], [9, 4]]}), "four or more"),
    "no number": (
        (LIVING, {**BEDROOM, "polygon": [[5, 0], [9, 0], [9, "4"], [5, 4]]}),
        "'bedroom': corner",
    ),
    "not finite": (
        (LIVING, {**BEDROOM, "polygon": [[5, 0], [9, 0], [9, float("nan")], [5, 4]]}),
        r"rooms\[1\]\.polygon\[2\]\[1\]: nan is no finite number",
    ),
    "narrow": ((LIVING, room("den", 5, 0, 5.6, 4)), "'den'.*narrower"),
    "unknown type": ((LIVING, {**BEDROOM, "type": "ballroom"}), "'ballroom'.*choose"),
    "far away": (
        (LIVING, {**BEDROOM, "polygon": [[5, 0], [9, 0], [9, 1e308], [5, 4]]}),
        "1e[+]308 is out of range",
    ),
    "many corners": ((LIVING, {**BEDROOM, "polygon": [[5, 0], [9, 0]] * 60}), "at most 100"),
    "type is a list": ((LIVING, {**BEDROOM, "type": ["living"]}), "type is .'living'.*choose"),
    "name twice": ((LIVING, {**BEDROOM, "name": "living"}), "'living'.*taken"),
    "no rooms": ((), "0 rooms"),
    "unknown key": ((LIVING, {**BEDROOM, "colour": "red"}), "unknown key 'colour'"),
    "key of two lines": ((LIVING, {**BEDROOM, "a\nb": "red"}), r"unknown key 'a\\nb'"),
    "name of two lines": ((LIVING, {**BEDROOM, "name": "a\nb", "polygon": []}), r"room 'a\\nb'"),
}


@pytest.mark.parametrize("case", BAD_PLANS)
def test_bad_rooms_are_named_with_their_file(tmp_path, case):
    rooms, message = BAD_PLANS[case]
    path = written(tmp_path, rooms)
    with pytest.raises(UsageError, match=message) as caught:
        load_floor_plan(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_gap_between_rooms_is_named(tmp_path):
    rooms = (
        room("south", 0, 0, 9, 3),
        room("north", 0, 6, 9, 9),
        room("west", 0, 3, 3, 6),
        room("east", 6, 3, 9, 6),
    )
    with pytest.raises(UsageError, match="enclose a gap"):
        load_floor_plan(written(tmp_path, rooms))


BAD_DOORS = {
    "not on the wall": ({**DOOR, "at": [4, 2]}, "door 1 between 'living' and 'bedroom'.*wall"),
    "in the corner": ({**DOOR, "at": [5, 0.4]}, "from its ends"),
    "too wide": ({**DOOR, "width": 4.0}, "from its ends"),
    "too narrow": ({**DOOR, "width": 0.5}, "too narrow"),
    "no such room": ({**DOOR, "between": ["living", "attic"]}, "no room 'attic'"),
    "itself": ({**DOOR, "between": ["living", "living"]}, "two different"),
    "one room": ({**DOOR, "between": ["living"]}, "two names"),
    "kind": ({**DOOR, "kind": "gate"}, "choose one of"),
    "text": ({**DOOR, "at": "here"}, "expected \\[x, y\\]"),
}


@pytest.mark.parametrize("case", BAD_DOORS)
def test_bad_doors_are_named(tmp_path, case):
    door, message = BAD_DOORS[case]
    with pytest.raises(UsageError, match=message):
        load_floor_plan(written(tmp_path, doors=(door,)))


def test_rooms_without_a_way_are_named(tmp_path):
    with pytest.raises(UsageError, match="'bedroom': no way leads there"):
        load_floor_plan(written(tmp_path, doors=()))


def test_overlapping_doors_are_refused(tmp_path):
    with pytest.raises(UsageError, match="overlap"):
        load_floor_plan(written(tmp_path, doors=(DOOR, {**DOOR, "at": [5, 2.4]})))


def test_windows_of_a_users_own_are_kept(tmp_path):
    window = {"room": "living", "at": [2, 0], "width": 1.2}
    (found,) = load_floor_plan(written(tmp_path, windows=[window])).windows
    assert (found.along_x, found.at, found.low, found.high) == (True, -6, 134, 254)
    inner = {"room": "living", "at": [5, 2], "width": 1.2}
    with pytest.raises(UsageError, match="outer wall"):
        load_floor_plan(written(tmp_path, windows=[inner]))


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "3"])
def test_what_is_no_plan_is_refused(tmp_path, text):
    path = tmp_path / "plan.json"
    path.write_text(text)
    with pytest.raises(UsageError, match=r"plan\.json"):
        load_floor_plan(path)


def test_a_missing_or_binary_file_is_named(tmp_path):
    with pytest.raises(UsageError, match=r"gone\.toml.*No such file"):
        load_floor_plan(tmp_path / "gone.toml")
    path = tmp_path / "plan.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match=r"plan\.toml"):
        load_floor_plan(path)


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_any_staircase_of_rectangles_is_laid_out_exactly(data):
    """Two rooms that split a random staircase keep their areas."""
    steps = data.draw(
        st.lists(st.tuples(st.integers(2, 5), st.integers(2, 9)), min_size=1, max_size=4)
    )
    corners, x = [(0.0, 0.0)], 0.0
    top = []
    for width, height in steps:
        top += [(x, float(height)), (x + width, float(height))]
        x += width
    corners = [(0.0, 0.0), (x, 0.0), *reversed(top)]
    below = [(0.0, 0.0), (x, 0.0), (x, -3.0), (0.0, -3.0)]
    polygons = [
        read_polygon([list(c) for c in shape], name)
        for shape, name in ((corners, "stairs"), (below, "hall"))
    ]
    grid, _ = lay_out(polygons, ["stairs", "hall"])
    assert grid.area_cm2(0) == sum(w * h for w, h in steps) * 10_000
    assert grid.area_cm2(1) == x * 3 * 10_000
    assert len(grid.polygon(frozenset({1}))) == 4


places = st.lists(st.tuples(st.integers(-3, 3), st.integers(-3, 3)), max_size=9)


@given(places)
def test_any_corners_are_a_polygon_or_a_complaint(corners):
    with contextlib.suppress(FloorPlanError):
        assert len(read_polygon([[float(x), float(y)] for x, y in corners], "room")) >= 4


@given(places.filter(lambda turns: len(turns) > 1))
def test_rectilinear_corners_are_read_where_shapely_finds_a_polygon(turns):
    from shapely.geometry import Polygon

    # From each place along x below the next one, then along y to it.
    nexts = [*turns[1:], turns[0]]
    corners = [
        [float(x), float(y)]
        for (_, y0), (x, y1) in zip(turns, nexts, strict=True)
        for y in (y0, y1)
    ]
    expected = Polygon(corners)
    if expected.is_valid and expected.area:
        found = Polygon(read_polygon(corners, "room"))
        assert found.is_valid
        assert found.area == 10_000 * expected.area
    else:
        with pytest.raises(FloorPlanError):
            read_polygon(corners, "room")
