"""Spans, faces and light: what the camera's pictures are made of."""

import math

import builders
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from internav_data import generate_house
from internav_data.catalog import catalogue, part_triangles
from internav_data.geometry import yaw_quaternion
from internav_data.navigation import Lattice
from internav_data.records import Pose
from internav_data.render.asset_mesh import flat_faces, model_of
from internav_data.render.camera import Camera, CameraView, StaticScene, camera_axes
from internav_data.render.rasterise import fill, scan
from internav_data.render.shading import light_of
from internav_data.render.wall_quads import house_tiles

SIZE = 24


def mask(points):
    """Pixels of a polygon whose corners run counter-clockwise as seen, y down."""
    px, py = (np.array([p[k] for p in points], float) for k in (0, 1))
    lefts, rights = np.zeros(SIZE, np.int32), np.zeros(SIZE, np.int32)
    top, bottom = scan(len(points), px, py, SIZE, SIZE, lefts, rights)
    out = np.zeros((SIZE, SIZE), int)
    for row in range(top, bottom):
        out[row, lefts[row] : max(lefts[row], rights[row])] = 1
    return out


def around(turns, radius, middle, snap):
    """A convex polygon around a point, counter-clockwise as seen; `snap` onto pixel centres."""
    points = [
        (middle[0] + radius * math.cos(-t), middle[1] + radius * math.sin(-t))
        for t in sorted(turns)
    ]
    if not snap:
        return points
    snapped = [(round(x) + 0.5, round(y) + 0.5) for x, y in points]
    # Not every polygon stays convex there.
    corners = zip(snapped, snapped[1:] + snapped[:1], snapped[2:] + snapped[:2], strict=True)
    assume(len(set(snapped)) == len(snapped))
    assume(all(turn(a, b, c) < 0 for a, b, c in corners))
    return snapped


def turn(a, b, c):
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


turns = st.lists(
    st.floats(0.0, 2 * math.pi - 1e-3), min_size=3, max_size=9, unique_by=lambda t: round(t, 1)
)


@settings(deadline=None)  # the first call compiles
@given(turns, st.floats(2.0, 30.0), st.floats(2.0, 22.0), st.floats(2.0, 22.0), st.booleans())
def test_faces_that_share_edges_share_no_pixel_and_leave_none_out(angles, radius, x, y, snap):
    polygon = around(angles, radius, (x, y), snap)
    whole = mask(polygon)
    fans = sum(mask([polygon[0], polygon[k], polygon[k + 1]]) for k in range(1, len(polygon) - 1))
    assert np.array_equal(whole, fans)


@settings(deadline=None)  # the first call compiles
@given(turns, st.floats(2.0, 30.0), st.floats(2.0, 22.0), st.floats(2.0, 22.0))
def test_a_pixel_is_covered_when_its_centre_is_inside(angles, radius, x, y):
    polygon = around(angles, radius, (x, y), snap=False)
    covered = mask(polygon)
    for row in range(SIZE):
        for column in range(SIZE):
            centre = (column + 0.5, row + 0.5)
            edges = zip(polygon, polygon[1:] + polygon[:1], strict=True)
            sides = [turn(a, b, centre) for a, b in edges]
            if max(sides) < -1e-6:
                assert covered[row, column] == 1
            elif max(sides) > 1e-6:
                assert covered[row, column] == 0


def test_the_nearer_face_wins_whichever_comes_first():
    square = np.array([0.0, 0.0, 8.0, 8.0]), np.array([0.0, 8.0, 8.0, 0.0])
    for order in ((0.5, 0.25), (0.25, 0.5)):
        depth = np.full((8, 8), 0.01, np.float32)
        faces = np.full((8, 8), -1, np.int32)
        spans = np.zeros((2, 8), np.int32)
        for k, inverse in enumerate(order):
            assert fill(4, *square, 0.0, 0.0, inverse, k, depth, faces, spans[0], spans[1])
        assert (depth == 0.5).all()
        assert (faces == order.index(0.5)).all()


@pytest.mark.parametrize(("shape", "faces"), [("box", 6), ("cylinder", 18)])
def test_flat_faces_are_joined(shape, faces):
    turned = builders.part(shape, (0.1, 0.2, 0.3), (0.4, 0.5, 0.6), yaw_quaternion(20.0))
    assert len(flat_faces(*part_triangles(turned))) == faces


def test_models_are_closed_and_as_large_as_their_meshes():
    for asset in catalogue().spawnable[::40]:
        model = model_of(asset)
        corner, face, vertex = 0, 0, 0
        for part, vertices, faces in zip(
            asset.parts, model.vertex_counts, model.face_counts, strict=True
        ):
            points = model.vertices[vertex : vertex + vertices]
            closed, volume = np.zeros(3), 0.0
            for k in range(face, face + faces):
                ring = points[model.corners[corner : corner + model.corner_counts[k]]]
                area = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0) / 2
                closed += area
                volume += float(area @ model.planes[k, :3]) * model.planes[k, 3] / 3
                assert np.abs(ring @ model.planes[k, :3] - model.planes[k, 3]).max() < 1e-5
                corner += model.corner_counts[k]
            corners, triangles = part_triangles(part)
            a, b, c = (corners[triangles[:, k]] for k in range(3))
            assert np.abs(closed).max() < 1e-9
            expected = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6
            assert volume == pytest.approx(expected, rel=1e-4)
            face, vertex = face + faces, vertex + vertices


def test_floors_and_ceilings_fill_the_rooms():
    house = generate_house(seed=11, scene=7)
    for room in house.rooms:
        for label in (-1, -2):
            sheets = [
                t.sheet for t in house_tiles(house) if (t.room, t.label) == (room.room_id, label)
            ]
            area = sum((s.high[0] - s.low[0]) * (s.high[1] - s.low[1]) for s in sheets)
            assert area == pytest.approx(room.area_m2, abs=1e-3)


@pytest.mark.parametrize("yaw", [0.0, 90.0, 180.0, 270.0, 33.0])
@pytest.mark.parametrize("horizon", [-30.0, 0.0, 30.0, 60.0])
def test_axes_are_right_handed_and_level(yaw, horizon):
    right, down, forward = axes = camera_axes(yaw, horizon)
    assert np.allclose(axes @ axes.T, np.eye(3))
    assert np.allclose(np.cross(right, down), forward)
    assert right[2] == 0.0
    assert forward[2] == pytest.approx(-math.sin(math.radians(horizon)))
    assert math.atan2(forward[1], forward[0]) % (2 * math.pi) == pytest.approx(math.radians(yaw))


def test_no_two_walls_of_a_corner_are_equally_bright():
    walls = [light_of(1.0, 0.0, 0.0), light_of(0.0, 1.0, 0.0)]
    walls += [light_of(-1.0, 0.0, 0.0), light_of(0.0, -1.0, 0.0)]
    for k in range(4):
        assert abs(walls[k] - walls[(k + 1) % 4]) > 0.02
    assert light_of(0.0, 0.0, 1.0) > max(walls)


def test_what_stands_on_the_floor_darkens_it_and_nothing_else():
    house = generate_house(seed=7, scene=4)
    scenery = StaticScene.of(house)
    free = np.argwhere(Lattice.of(house).free)
    i, j = next((i, j) for i, j in free.tolist() if [i + 4, j] in free.tolist())
    asset = catalogue().of_type("Box")[0]
    stands = Pose(0.25 * i + 1.0, 0.25 * j, 0.0, yaw_quaternion(0.0))
    hangs = Pose(stands.x, stands.y, 0.06, stands.quaternion)
    frames = Camera(96).render(
        [
            CameraView(scenery, scenery.props([(asset, pose)]), 0.25 * i, 0.25 * j, 0.0, 60.0)
            for pose in (stands, hangs)
        ]
    )
    box = len(house.objects) + 1
    shared = (frames.ids[0] != box) & (frames.ids[1] != box)
    assert np.array_equal(frames.depth[0][shared], frames.depth[1][shared])
    change = frames.rgb[1].astype(int) - frames.rgb[0].astype(int)
    assert (change[shared] >= 0).all()
    assert change[shared].max() > 20
    near = shared & (frames.ids[0] == -1)
    assert (change[near].max(axis=-1) > 10).sum() > 10
