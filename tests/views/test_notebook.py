"""Houses, episodes and replays as notebooks show them."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from xml.etree import ElementTree as ET

import cv2
import numpy as np

from internav_data import load_dataset
from internav_data.views import Replay, draw_house


def test_a_house_is_its_picture(hand_house):
    data = np.frombuffer(hand_house._repr_png_(), np.uint8)
    shown = cv2.cvtColor(cv2.imdecode(data, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
    np.testing.assert_array_equal(shown, draw_house(hand_house, pixels=700))


def test_an_episode_is_a_map_and_a_table():
    for episode in load_dataset("mini", "val"):
        page = episode._repr_html_()
        tree = ET.fromstring(page)  # noqa: S314 - our own
        assert len(tree.findall(".//tr")) == 1 + len(episode.obstacles)
        svg = tree.find(".//{http://www.w3.org/2000/svg}svg")
        wide, high = float(svg.get("width")), float(svg.get("height"))
        circles = svg.findall(".//{http://www.w3.org/2000/svg}circle")
        assert len(circles) == 2 + len(episode.obstacles)
        assert all(0 < float(c.get("cx")) < wide and 0 < float(c.get("cy")) < high for c in circles)
        assert episode.episode_id in page


def test_names_cannot_break_the_page(hand_episode):
    chair = replace(hand_episode.obstacles[0], asset_id="<b>&")
    page = replace(hand_episode, obstacles=(chair,))._repr_html_()
    assert "<b>" not in page
    ET.fromstring(page)  # noqa: S314 - our own


def test_north_is_up(hand_episode):
    """The start (3, 1) lies south-west of the chair (5, 2)."""
    page = hand_episode._repr_html_()
    x, y = map(float, re.search(r'cx="([\d.]+)" cy="([\d.]+)" r="9" fill="#289454"', page).groups())
    cx, cy = map(float, re.search(r'cx="([\d.]+)" cy="([\d.]+)" r="11"', page).groups())
    assert cx - x == 2 * 48.0
    assert y - cy == 48.0


def test_a_replay_plays_in_the_page():
    data = load_dataset("mini", "val")
    episode = min(data, key=lambda episode: episode.expert.steps)
    replay = Replay.of(data.scene(episode.scene_id), episode, data.assets)
    page = replay._repr_html_()
    gif = base64.b64decode(re.search(r"base64,([^\"]+)", page)[1])
    assert gif.startswith(b"GIF89a")
    assert f"expert: {episode.expert.steps} actions" in page
    assert "reaches the goal" in repr(replay)
