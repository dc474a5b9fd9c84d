"""Trajectories, bars, curves and pages: what a report is made of."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from internav_data.records.errors import UsageError
from internav_data.views.bars import Bars, bars_panel, draw_bars
from internav_data.views.curves import Curve, curves_svg
from internav_data.views.page import Page
from internav_data.views.replay import Replay
from internav_data.views.trajectory import FAILED, LATE, WORKED, draw_trajectory
from internav_data.world import HouseModel

AHEAD, RIGHT, PUSH, PICK, DONE = 0, 2, 5, 9, 11
TO_THE_DOOR = [*[AHEAD] * 4, RIGHT, *[AHEAD] * 4]


@pytest.fixture(scope="module")
def model(hand_house):
    return HouseModel.of(hand_house)


def count(picture, colour, tolerance=30):
    far = np.abs(picture.astype(int) - np.array(colour)).max(axis=2)
    return int((far <= tolerance).sum())


def test_what_worked_and_what_failed_is_marked(model, hand_episode):
    def draw(actions):
        return draw_trajectory(model, hand_episode, model.house.assets, actions, pixels=400)

    plain = draw(TO_THE_DOOR)
    failed, worked = draw([*TO_THE_DOOR, PICK]), draw([*TO_THE_DOOR, PUSH])
    assert plain.shape == failed.shape == worked.shape
    assert count(failed, FAILED) > count(plain, FAILED) + 20
    assert count(worked, WORKED) > count(plain, WORKED) + 20
    assert count(plain, LATE) > count(draw([AHEAD]), LATE)
    assert (draw(TO_THE_DOOR) == plain).all()


def test_the_way_lies_where_the_agent_walked(model, hand_episode):
    start, walked = (
        draw_trajectory(model, hand_episode, model.house.assets, actions, pixels=900)
        for actions in ([RIGHT], [AHEAD] * 4)
    )
    rows, columns = np.nonzero((start != walked).any(axis=2))
    scale = 900 / (9.0 + 1.5)
    x = columns / scale - 0.75
    house_rows = rows[rows < (4.0 + 1.5) * scale]
    y = 4.75 - house_rows / scale
    # From (3, 1) up to (3, 2): nothing changes farther than the disc and the words below it.
    assert 2.0 < x.min() < 3.0 < x[rows < 5.5 * scale].max() < 4.0
    assert 0.4 < y.min() < 1.1
    assert 2.0 < y.max() < 2.4


def test_a_trajectory_needs_its_own_house(model, hand_episode):
    from dataclasses import replace

    other = replace(hand_episode, scene_id="scene-000009")
    with pytest.raises(UsageError, match="belongs to"):
        draw_trajectory(model, other, model.house.assets, [DONE])


def test_bars_are_as_long_as_their_shares():
    def filled(share):
        picture = draw_bars([Bars("option", ("only",), (share,))], 400)
        return count(picture, (96, 132, 176), 6)

    none, half, whole = filled(0.0), filled(0.5), filled(1.0)
    assert none == 0
    assert half == pytest.approx(whole / 2, rel=0.03)
    assert filled(7.0) == whole
    assert filled(-1.0) == 0


def test_what_was_taken_has_another_colour():
    shares = Bars("intent", ("a", "b"), (0.5, 0.5), chosen=1)
    assert count(draw_bars([shares], 400), (196, 36, 112), 6) > 100


def test_bars_stand_beside_a_replay(model, hand_episode):
    replay = Replay.of(model, hand_episode, model.house.assets, [AHEAD, AHEAD])
    steps = [[Bars("option", ("a", "b"), (p, 1 - p))] for p in (0.1, 0.9)]
    frames = list(replay.frames(size=160, fps=4.0, panel=bars_panel(steps, 160)))
    bare = next(iter(replay.frames(size=160, fps=4.0)))
    assert frames[0].shape[1] > bare.shape[1] + 79
    sides = {frame[:, -90:].tobytes() for frame in frames}
    assert len(sides) >= 2
    panel = bars_panel(steps, 160)
    first, second, last = (panel(moment) for moment in replay.story.moments)
    assert (first != second).any(), "what leads to the next action"
    assert (second == last).all(), "nothing follows the last"
    assert bars_panel([], 160)(replay.story.moments[0]).shape == (160, 80, 3)
    with pytest.raises(UsageError, match="2 labels, 1 shares"):
        bars_panel([[Bars("x", ("a", "b"), (1.0,))]], 160)


def points(svg):
    tree = ET.fromstring(svg)  # noqa: S314 - our own words
    lines = [e.attrib["points"] for e in tree.iter() if e.tag.endswith("polyline")]
    return [[tuple(map(float, p.split(","))) for p in line.split()] for line in lines]


def test_curves_go_through_their_points():
    svg = curves_svg("SR <1>", "steps", [Curve("a", ((0, 0.0), (50, 1.0), (100, 0.5)))])
    ((first, middle, last),) = points(svg)
    assert first[0] < middle[0] < last[0]
    assert middle[0] - first[0] == pytest.approx(last[0] - middle[0], abs=0.2)
    assert first[1] > last[1] > middle[1], "up is more"
    assert last[1] == pytest.approx((first[1] + middle[1]) / 2, abs=0.2)
    assert "SR &lt;1&gt;" in svg


def test_curves_without_points_or_spread():
    assert curves_svg("x", "y", []) == ""
    assert curves_svg("x", "y", [Curve("a", ((0.0, float("nan")),))]) == ""
    ((only,),) = points(curves_svg("x", "y", [Curve("a", ((7.0, 3.0),))]))
    assert all(np.isfinite(only))
    many = Curve("a", tuple((k, float("inf") if k == 5 else k % 7) for k in range(5000)))
    (line,) = points(curves_svg("x", "y", [many, Curve("b", ())]))[:1]
    assert len(line) <= 400


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-3e-9, 5e-9), (0.0, 3e7), (97.0, 97.5)])
def test_axes_hold_all_values_at_round_numbers(low, high):
    svg = curves_svg("x", "y", [Curve("a", ((0, low), (1, high)))])
    ((a, b),) = points(svg)
    assert all(28 <= y <= 212 for _, y in (a, b))
    assert 3 <= len(re.findall(r'class="left"', svg)) <= 9


def test_a_page_holds_what_it_is_told(tmp_path):
    page = Page("<title>")
    page.heading("A & B")
    page.words("x < y")
    page.table([("all", 2)], ["", "SR", "FDT"], [("ours", ["me", "1", "2"]), ("", ["<i>", "", ""])])
    page.curves(["", "<svg></svg>"])
    page.pictures([(np.zeros((4, 6, 3), np.uint8), 'say "cheese"')])
    page.write(tmp_path / "sub" / "page.html")
    text = (tmp_path / "sub" / "page.html").read_text()
    assert text == page.text()
    for part in ("&lt;title&gt;", "A &amp; B", "x &lt; y", "&lt;i&gt;", "say &quot;cheese&quot;"):
        assert part in text
    assert '<th colspan="2">all</th>' in text
    assert '<tr class="ours"><td>me</td>' in text
    assert text.count("<svg>") == 1
    assert [p.name for p in (tmp_path / "sub").iterdir()] == ["page.html"]
