"""The validator's own geometry against closed forms, brute force and the generator's."""

import ast
import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from builders import UPRIGHT, part, scene_object
from hypothesis import given, settings
from hypothesis import strategies as st
from scenery import ASSETS, Grid, brute_steps, obstacle, taut
from shapely import box

import internav_data.verification
from internav_data import geometry, navigation
from internav_data.records import Pose
from internav_data.verification.checked_lattice import KEEP_M, CheckedLattice
from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.findings import MAX_FINDINGS, FindingCollector, join
from internav_data.verification.overlaps import GRID_M, hulls_overlap, plans_overlap
from internav_data.verification.portals import Portals
from internav_data.verification.shapes import Shapes, slice_of, solid_of
from internav_data.verification.visibility_graph import (
    FINE,
    VisibilityGraph,
    connected,
    inflate,
    path_ellipse,
)

HERE = Path(internav_data.verification.__file__).parent
FORBIDDEN = (
    "camp", "catalog", "envs", "episodes", "evaluation", "generation", "geometry", "houses",
    "navigation", "physics", "planner", "records.agent", "render", "views", "world",
)  # fmt: skip
SHARED = ("physics", "world")
"""Rooms that `replay` alone may import: physics is a pure function, and the world asks it."""


def imported(path):
    """Names that a file imports by any statement; ours in strings that are a name or an import."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from re.findall(r"(?:^|import |from )(internav_data(?:\.\w+)+)", node.value)


def within(name, rooms):
    return any(f"{name}.".startswith(f"internav_data.{room}.") for room in rooms)


@pytest.mark.parametrize("path", sorted(HERE.rglob("*.py")), ids=lambda path: path.stem)
def test_nothing_of_the_generator_is_imported(path):
    rooms = set(FORBIDDEN) - set(SHARED if path.parent.name == "replay" else ())
    names = set(imported(path))
    assert names, "each has an import of ours"
    assert [name for name in names if within(name, rooms)] == []


def test_contracts_name_every_module_and_every_room():
    project = tomllib.loads((HERE.parents[1] / "pyproject.toml").read_text())
    contracts = {c["name"].split(":")[0]: c for c in project["tool"]["importlinter"]["contracts"]}
    proof = contracts["Proof by other means"]
    replay = contracts["Replay asks physics and the world again, and nothing else"]
    own = {f"internav_data.verification.{p.stem}" for p in HERE.glob("*.py")}
    assert set(proof["source_modules"]) == own - {"internav_data.verification.__init__"}
    above = {"internav_data.camp", "internav_data.evaluation"}  # forbidden by the layers
    rooms = {f"internav_data.{room}" for room in FORBIDDEN} - above
    assert set(proof["forbidden_modules"]) == rooms
    assert set(replay["forbidden_modules"]) == rooms - {f"internav_data.{r}" for r in SHARED}


# shapes

angles = st.floats(-1.0, 1.0)
quaternions = st.tuples(angles, angles, angles, angles).filter(lambda q: math.hypot(*q) > 0.1)
lengths = st.floats(0.05, 1.5).map(lambda v: round(v, 3))


@st.composite
def parts(draw):
    shape = draw(st.sampled_from(["box", "cylinder", "sphere", "hull"]))
    size = draw(st.tuples(lengths, lengths, lengths))
    corners = ()
    if shape == "hull":
        corner = st.tuples(*[st.floats(-0.7, 0.7).map(lambda v: round(v, 3))] * 3)
        corners = tuple(draw(st.lists(corner, min_size=4, max_size=12, unique=True)))
    centre = draw(st.tuples(*[st.floats(-0.5, 0.5)] * 3))
    return part(shape, centre, size, draw(quaternions), corners=corners)


@settings(deadline=None, max_examples=60)
@given(st.lists(parts(), min_size=1, max_size=3), quaternions, st.floats(-0.5, 2.0))
def test_footprints_are_those_of_the_generator(pieces, quaternion, z):
    asset = replace(ASSETS["Box_1"], asset_id="Odd_1", parts=tuple(pieces))
    pose = Pose(1.0, -2.0, z, quaternion)
    mine = Shapes({"Odd_1": asset}).footprint("Odd_1", pose)
    theirs = [shapely.convex_hull(shapely.multipoints(p)) for p in geometry.footprint(asset, pose)]
    a, b = shapely.union_all(mine), shapely.union_all(theirs)
    assert a.is_empty == b.is_empty
    if not a.is_empty:
        assert shapely.hausdorff_distance(a, b) < 1e-6
        assert shapely.symmetric_difference(a, b, grid_size=GRID_M).area < 1e-6


def test_clipped_cone_by_hand():
    # A pyramid 2 m high on a base of 2 x 2 m: at z = 1.8 it is 0.2 m wide, at z = 0.02 1.98 m.
    corners = (
        (-1.0, -1.0, 0.0),
        (1.0, -1.0, 0.0),
        (1.0, 1.0, 0.0),
        (-1.0, 1.0, 0.0),
        (0.0, 0.0, 2.0),
    )
    solid = solid_of(part("hull", (0.0,) * 3, (2.0,) * 3, corners=corners))

    def bounds(low, high):
        points = slice_of(solid.corners, solid.edges, low, high)
        return (*points.min(axis=0), *points.max(axis=0))

    assert bounds(0.02, 1.8) == pytest.approx((-0.99, -0.99, 0.99, 0.99))
    assert bounds(1.8, 2.5) == pytest.approx((-0.1, -0.1, 0.1, 0.1))
    assert len(slice_of(solid.corners, solid.edges, 2.1, 2.5)) == 0


def test_what_does_not_block_has_no_footprint():
    rug = replace(ASSETS["Box_1"], blocks=False)
    assert Shapes({"Box_1": rug}).footprint("Box_1", Pose(0.0, 0.0, 0.0, UPRIGHT)) == []


# lattice


def furnished(*objects):
    return Grid(2, 1).house(3, objects)


def test_steps_are_those_of_a_brute_force():
    house = furnished(
        scene_object(0, "Table_1", 0, 1.5, 2.5, yaw_deg=30.0),
        scene_object(1, "Drum_1", 1, 6.0, 2.0),
    )
    layout = CheckedLayout(house, Shapes(ASSETS))
    for x, y, yaw in ((2.5, 2.0, 90.0), (3.3, 2.2, 75.0), (5.0, 1.5, 15.0)):
        bar = obstacle("Bar_1", x, y, yaw_deg=yaw)
        free = layout.lattice.with_obstacles(layout.shapes.footprint("Bar_1", bar.pose))
        goal = layout.lattice.node(28, 6)
        found = layout.lattice.distances(goal, free)[layout.lattice.node(4, 6)]
        brute = brute_steps(house, (4, 6), (28, 6), [bar])
        assert found == (math.inf if brute is None else brute)


def test_exact_ties_are_free():
    # Walls 0.2 m from the node row y = 1: the row is free, 1 µm more and it is not.
    outline = box(0.0, 0.0, 5.0, 2.0)
    walls = [box(0.0, 0.0, 5.0, 0.8), box(0.0, 1.2, 5.0, 2.0)]
    assert CheckedLattice(walls, outline).free.nodes.sum() == 21
    tight = [box(0.0, 0.0, 5.0, 0.800002), walls[1]]
    assert CheckedLattice(tight, outline).free.nodes.sum() == 0


@settings(deadline=None, max_examples=25)
@given(
    st.lists(st.tuples(st.floats(0.3, 7.5), st.floats(0.3, 3.5), st.integers(0, 23)), max_size=5)
)
def test_lattice_is_that_of_the_generator(spots):
    house = furnished(
        *(
            scene_object(k, "Bar_1", 0, round(x, 4), round(y, 4), yaw_deg=15.0 * turn)
            for k, (x, y, turn) in enumerate(spots)
        )
    )
    mine = CheckedLayout(house, Shapes(ASSETS)).lattice
    theirs = navigation.Lattice.of(house)
    assert mine.shape == theirs.shape
    assert (mine.free.nodes.reshape(mine.shape) == theirs.free).all()
    goals = np.argwhere(theirs.free)
    i, j = goals[len(goals) // 2]
    steps = mine.distances(mine.node(int(i), int(j)), mine.free).reshape(mine.shape)
    assert (np.where(np.isfinite(steps), steps, -1) == theirs.distances(int(i), int(j))).all()


# ways


def test_way_round_a_box_is_a_taut_string():
    graph = VisibilityGraph(inflate([box(1.0, -1.0, 2.0, 0.3)], FINE))
    exact = taut((0.0, 0.0), [((1.0, 0.3), -1), ((2.0, 0.3), -1)], (3.0, 0.0), KEEP_M)
    assert graph.length((0.0, 0.0), (3.0, 0.0), 9.0) == pytest.approx(exact, abs=1e-4)
    assert graph.length((0.0, 0.0), (3.0, 0.0), 3.0) == math.inf
    assert graph.length((0.0, 2.0), (3.0, 2.0), 9.0) == 3.0


def test_way_between_two_boxes_bends_both_ways():
    boxes = [box(1.0, -5.0, 1.5, 1.0), box(2.5, 0.0, 3.0, 5.0)]
    chain = [((1.0, 1.0), -1), ((1.5, 1.0), -1), ((2.5, 0.0), 1), ((3.0, 0.0), 1)]
    exact = taut((0.0, 0.0), chain, (4.0, 1.0), KEEP_M)
    assert VisibilityGraph(inflate(boxes, FINE)).length(
        (0.0, 0.0), (4.0, 1.0), 20.0
    ) == pytest.approx(exact, abs=4e-4)


def test_gap_as_wide_as_the_disc_is_open():
    outline = box(-1.0, -1.0, 3.0, 3.0)
    for gap, opened in ((0.4, True), (0.3999, False), (0.41, True)):
        boxes = [box(1.0, -3.0, 1.5, 1.0), box(1.0, 1.0 + gap, 1.5, 5.0)]
        length = VisibilityGraph(inflate(boxes)).length((0.0, 1.2), (2.5, 1.2), 5.0)
        assert math.isfinite(length) == opened
        footprints = shapely.union_all(shapely.buffer(np.array(boxes), KEEP_M, quad_segs=FINE))
        assert connected((0.0, 1.2), (2.5, 1.2), outline, footprints) == opened


@settings(deadline=None, max_examples=30)
@given(
    st.lists(
        st.tuples(st.floats(0.5, 7.0), st.floats(0.5, 3.4), st.integers(0, 23)),
        min_size=1,
        max_size=4,
    )
)
def test_ways_are_those_of_the_generator(spots):
    house = furnished(scene_object(0, "Table_1", 0, 1.5, 2.5, yaw_deg=30.0))
    layout = CheckedLayout(house, Shapes(ASSETS))
    placed = [
        obstacle("Bar_1", round(x, 4), round(y, 4), yaw_deg=15.0 * turn) for x, y, turn in spots
    ]
    footprints = [p for o in placed for p in layout.shapes.footprint(o.asset_id, o.pose)]
    there = geometry.Polygons.joined(geometry.footprint(ASSETS["Bar_1"], o.pose) for o in placed)
    start, goal = (0.5, 0.5), (7.25, 3.25)
    theirs = navigation.TangentGraph.of(house).distance(start, goal, there)
    graph = VisibilityGraph(
        layout.visibility_graph.base, inflate(footprints), layout.visibility_graph
    )
    mine = graph.length(start, goal, 100.0)
    near = [o for o in footprints if shapely.dwithin(o, shapely.points([start, goal]), 0.21).any()]
    if theirs is None or near:
        cut = shapely.union_all(shapely.buffer(np.array(footprints), KEEP_M, quad_segs=FINE))
        assert theirs is not None or near or not connected(start, goal, layout.free_area, cut)
    else:
        assert mine == pytest.approx(theirs, rel=0.001, abs=0.001)


@settings(deadline=None, max_examples=30)
@given(st.tuples(st.integers(1, 31), st.integers(1, 31), st.integers(1, 31), st.integers(1, 31)))
def test_portals_bound_from_below(nodes):
    house = Grid(2, 2).house(
        3, (scene_object(0, "Table_1", 0, 1.5, 2.5), scene_object(1, "Bar_1", 3, 6.0, 6.0))
    )
    layout = CheckedLayout(house, Shapes(ASSETS))
    a, b = (0.25 * nodes[0], 0.25 * nodes[1]), (0.25 * nodes[2], 0.25 * nodes[3])
    if not (
        layout.free_area.covers(shapely.Point(a)) and layout.free_area.covers(shapely.Point(b))
    ):
        return
    plain = VisibilityGraph(inflate(layout.blockers)).length(a, b, 100.0)
    portals = Portals(house)
    lower = portals.lower_bound(portals.located(np.array([a])), np.array(b))[0]
    assert lower <= plain + 1e-9
    assert layout.visibility_graph.length(a, b, 100.0) == pytest.approx(plain, abs=1e-9)


def test_ellipse_holds_its_points():
    shape = path_ellipse((1.0, 1.0), (3.0, 2.0), 4.0)
    rng = np.random.default_rng(0)
    points = rng.uniform(-2.0, 6.0, (500, 2))
    inside = [p for p in points if math.dist(p, (1.0, 1.0)) + math.dist(p, (3.0, 2.0)) <= 4.0]
    assert len(inside) > 50
    assert all(shape.covers(shapely.Point(p)) for p in inside)
    assert shape.area < 1.03 * math.pi * 2.0 * math.sqrt(16.0 - 5.0) / 2.0


# overlaps


def cube(x, y, z, side=1.0):
    return np.array(
        [(x + a * side, y + b * side, z + c * side) for a in (0, 1) for b in (0, 1) for c in (0, 1)]
    )


def test_solids_overlap_only_when_all_three_axes_do():
    assert hulls_overlap(cube(0, 0, 0), cube(0.9, 0.9, 0.9))
    assert not hulls_overlap(cube(0, 0, 0), cube(1.0, 0, 0))
    assert not hulls_overlap(cube(0, 0, 0), cube(0.9995, 0, 0))
    assert not hulls_overlap(cube(0, 0, 0), cube(0.0, 0.5, 1.2))
    assert not hulls_overlap(cube(0, 0, 0), cube(0, 0, 0)[:4])  # flat: no inside


def test_plans_that_touch_do_not_overlap():
    assert not plans_overlap(box(0, 0, 1, 1), box(1, 0, 2, 1))
    assert not plans_overlap(box(0, 0, 1, 1), box(0.9995, 0, 2, 1))
    assert plans_overlap(box(0, 0, 1, 1), box(0.99, 0, 2, 1))


def test_plans_that_differ_in_the_last_digits_overlap():
    """GEOS's overlay without a grid finds nothing shared by these two."""
    one = shapely.Polygon([
        (-0.48523809500000004, -0.16261904800000002), (-0.48333333300000003, -0.17166666700000002),
        (-0.47250000000000003, -0.17500000000000002), (-0.098505747, -0.096264368),
        (0.11909090900000001, -0.050454545), (0.42523809500000004, 0.102619048),
        (0.42333333300000003, 0.11166666700000001), (0.20047619000000003, 0.18023809500000001),
    ])  # fmt: skip
    other = shapely.Polygon([
        (-0.4725, -0.175), (-0.483333333, -0.171666667), (-0.485238095, -0.162619048),
        (0.20047619, 0.180238095), (0.423333333, 0.111666667), (0.425238095, 0.102619048),
        (0.119090909, -0.050454545), (-0.098505747, -0.096264368),
    ])  # fmt: skip
    assert plans_overlap(one, other)
    assert plans_overlap(other, one)


# findings


def test_findings_are_counted_beyond_what_is_kept():
    reports = []
    for number in range(3):
        report = FindingCollector("file", f"scene-{number}")
        for k in range(MAX_FINDINGS):
            report.expect(False, "some.predicate", 0, k)
        reports.append(report)
    findings = join(reports[::-1]).findings("geometry")
    assert findings.total == 3 * MAX_FINDINGS
    assert len(findings.found) == MAX_FINDINGS
    assert findings.by_predicate == {"some.predicate": 3 * MAX_FINDINGS}
    assert findings.found == tuple(sorted(findings.found))
    assert not findings.ok
    assert "3000 findings" in findings.summary()


def test_differences_that_are_findings_are_counted_beyond_what_is_kept():
    reports = []
    for number in range(3):
        report = FindingCollector("file", f"scene-{number}")
        for k in range(MAX_FINDINGS):
            report.differ("some.predicate", 0, k, f"episode-{k}")
        reports.append(report)
    whole = join(reports)
    whole.judge_differences("another processor")
    findings = whole.findings("physics")
    assert len(findings.found) == MAX_FINDINGS
    assert findings.by_predicate == {"some.predicate": 3 * MAX_FINDINGS}
    assert findings.total == 3 * MAX_FINDINGS
