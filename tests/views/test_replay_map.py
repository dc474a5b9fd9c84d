"""The map of a replay: what the agent's view takes in ends at walls."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from internav_data.views.replay_painters import visible_shares

REACH_M = 1.25
spots = st.floats(-2.0, 2.0).map(lambda v: round(v, 2))


@given(
    spots,
    spots,
    st.lists(st.tuples(spots, spots, st.integers(1, 150), st.integers(1, 150)), max_size=4),
)
def test_rays_end_where_shapely_says(x, y, boxes):
    walls = np.array([(a, b, a + w / 100, b + h / 100) for a, b, w, h in boxes]).reshape(-1, 4)
    turns = [math.radians(d) for d in range(0, 360, 15)]
    ends = np.array([(x + REACH_M * math.cos(t), y + REACH_M * math.sin(t)) for t in turns])
    ends = np.where(np.abs(ends - (x, y)) < 1e-12, (x, y), ends)
    shares = visible_shares(np.array((x, y)), ends, walls)
    for end, share in zip(ends, shares, strict=True):
        ray = shapely.LineString([(x, y), end])
        inside = [shapely.box(*wall).buffer(-1e-6) for wall in walls]
        met = [ray.intersection(box) for box in inside if ray.intersects(box)]
        outside = [
            ray.intersection(shapely.box(*w).buffer(1e-6, join_style="mitre")) for w in walls
        ]
        reached = min((m.distance(shapely.Point(x, y)) for m in met), default=REACH_M)
        least = min(
            (m.distance(shapely.Point(x, y)) for m in outside if not m.is_empty), default=REACH_M
        )
        # What only grazes a wall may count or not.
        assert least - 1e-4 <= share * REACH_M <= reached + 1e-4


def test_along_a_wall_nothing_is_hidden():
    wall = np.array([(0.0, 1.0, 3.0, 1.1)])
    along = visible_shares(np.array((0.5, 0.5)), np.array([(1.5, 0.5)]), wall)
    assert along == pytest.approx([1.0])
