from __future__ import annotations

import numpy as np
import pytest
from builders import bounds_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from internav_data.catalog import ASSET_TYPES, asset_mesh, catalogue, part_triangles
from internav_data.catalog.shapes import Paint, Sketch
from internav_data.geometry import part_corners

PAINT = Paint((1, 2, 3), "wood")


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("type_", ASSET_TYPES)
def test_parts_are_solid_convex_and_wound_outwards(type_):
    for asset in catalogue().of_type(type_)[:8]:
        low, high = bounds_of(asset)
        for part in asset.parts:
            vertices, faces = part_triangles(part)
            hull = ConvexHull(part_corners(part))
            assert hull.volume > 1e-9
            assert volume(vertices, faces) == pytest.approx(hull.volume, rel=1e-6)
            assert (vertices >= low - 1e-9).all()
            assert (vertices <= high + 1e-9).all()
            assert len(part.corners) <= 32


def test_topologies():
    sketch = Sketch()
    sketch.box((0, 1), (0, 1), (0, 1), PAINT)
    sketch.cylinder((0, 1), (0, 1), (0, 1), PAINT, "x")
    sketch.ball((0, 1), (0, 1), (0, 1), PAINT)
    box, cylinder, ball = sketch.fitted((0.4, 0.6, 0.8))
    assert [len(part_triangles(p)[1]) for p in (box, cylinder, ball)] == [12, 60, 96]
    for part in (box, cylinder, ball):
        np.testing.assert_allclose(np.ptp(part_corners(part), axis=0), (0.4, 0.6, 0.8), atol=1e-9)


@pytest.mark.parametrize("asset_id", ["Chair_01", "Pot_05", "Apple_02", "Bed_03", "Pillow_09"])
def test_mesh_is_watertight_and_coloured(asset_id):
    asset = catalogue().assets[asset_id]
    mesh = asset_mesh(asset)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0.0
    np.testing.assert_allclose(mesh.extents, asset.size, atol=1e-6)
    assert tuple(mesh.visual.face_colors[0][:3]) == asset.parts[0].colour


span = st.tuples(st.floats(-1, 1), st.floats(0.01, 1)).map(lambda s: (s[0], s[0] + s[1]))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(span, span, span), min_size=1, max_size=5), st.data())
def test_any_drawing_fills_its_box(boxes, data):
    sketch = Sketch()
    for x, y, z in boxes:
        kind = data.draw(st.sampled_from(["box", "ball", "x", "y", "z", "cushion"]))
        if kind == "box":
            sketch.box(x, y, z, PAINT)
        elif kind == "ball":
            sketch.ball(x, y, z, PAINT)
        elif kind == "cushion":
            sketch.cushion(x, y, z, PAINT)
        else:
            sketch.cylinder(x, y, z, PAINT, kind)
    size = tuple(data.draw(st.integers(50, 1500)) * 0.002 for _ in range(3))
    parts = sketch.fitted(size)
    corners = np.vstack([part_corners(p) for p in parts])
    w, d, h = size
    np.testing.assert_allclose(corners.min(axis=0), (-w / 2, -d / 2, 0), atol=1e-6)
    np.testing.assert_allclose(corners.max(axis=0), (w / 2, d / 2, h), atol=1e-6)
