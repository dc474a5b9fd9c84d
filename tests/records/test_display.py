"""What records show of themselves: one screen as text, and what rooms above register."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import builders
import pytest

from internav_data.records import Expert, Outcome
from internav_data.records.display import displayed, register_display


def test_an_episode_fits_a_screen(hand_house):
    outcome = Outcome("push_east", True, 0.3, 8, 2.0, True, 1.0, "")
    chair = replace(builders.obstacle(builders.chair(), 5.0, 2.0), outcomes=(outcome,) * 5)
    episode = builders.episode(
        hand_house, builders.start(12, 4), builders.goal(28, 4, 1), (chair,) * 18
    )
    lines = repr(episode).splitlines()
    assert len(lines) <= 25
    assert max(map(len, lines)) <= 160
    for words in (episode.episode_id, episode.mode, "Chair_0 at (5, 2)", "opened by push_east"):
        assert words in repr(episode)


def test_an_episode_without_expert_or_path_can_be_told(hand_episode):
    told = repr(replace(hand_episode, expert=None, obstructed_path_m=None, obstacles=()))
    assert "expert   none" in told
    assert "cut off" in told


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ((1, 0, 0), "1 action: 0 pushes, 0 picks"),
        ((36, 1, 1), "36 actions: 1 push, 1 pick"),
        ((9, 2, 3), "9 actions: 2 pushes, 3 picks"),
    ],
)
def test_an_expert_is_counted_in_words(hand_episode, counts, words):
    steps, pushes, picks = counts
    expert = Expert((11,), steps, pushes, picks, 2.0)
    assert expert.summary == words
    assert f"  expert   {words}, 2 m walked" in repr(replace(hand_episode, expert=expert))


def test_a_house_is_a_line(hand_house):
    assert repr(hand_house).count("\n") == 0
    for words in (hand_house.scene_id, "2 rooms", "bedroom", "4 objects"):
        assert words in repr(hand_house)


def test_a_record_is_drawn_by_what_is_registered(monkeypatch):
    class Shape:
        pass

    monkeypatch.setattr("internav_data.records.display._PAINTERS", {})
    assert displayed(Shape(), "png") is None
    register_display("Shape", "png", lambda shape: type(shape).__name__)
    assert displayed(Shape(), "png") == "Shape"
    assert displayed(Shape(), "html") is None

    def lacking(_):
        raise ModuleNotFoundError("cv2")

    register_display("Shape", "png", lacking)
    assert displayed(Shape(), "png") is None, "then its repr is shown"


@pytest.mark.parametrize("name", ["load_dataset", "generate_house"])
def test_the_first_public_name_registers_and_imports_nothing_that_draws(name):
    code = (
        f"from internav_data import {name}\nimport sys\n"
        "from internav_data.records.display import _PAINTERS\n"
        "print(sorted(_PAINTERS), 'cv2' in sys.modules)"
    )
    if name == "generate_house":
        code = code.replace("'cv2' in sys.modules", "False")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[('Episode', 'html'), ('House', 'png')] False"
