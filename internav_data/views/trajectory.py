"""Trajectory of an agent from above with its interactions, as in the paper's figure 5."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from internav_data.records.agent import AGENT
from internav_data.views.captions import with_caption
from internav_data.views.episodes import (
    COLOURS,
    GOAL,
    NAMES,
    START,
    obstacle_kind,
    paint_goal,
    paint_number,
    paint_obstacle,
    paint_start,
)
from internav_data.views.plan import PAPER, house_canvas, paint_house, paint_labels
from internav_data.views.replay_painters import GHOST
from internav_data.views.replay_story import play
from internav_data.views.silhouettes import shaded, silhouettes
from internav_data.world import Action, HouseModel
from internav_data.world.actions import INTERACTION_KINDS
from internav_data.world.config import DEFAULT_WORLD

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.core.typing import Floats, Image
    from internav_data.records import RGB, Asset, Episode, House, Pose, Vec2
    from internav_data.views.canvas import Canvas
    from internav_data.views.replay_story import Story
    from internav_data.world.config import WorldConfig

EARLY: Final[RGB] = (240, 150, 190)
LATE: Final[RGB] = (160, 16, 92)
"""The path fades from `EARLY` to `LATE` over time."""
WORKED: Final[RGB] = (24, 150, 80)
FAILED: Final[RGB] = (214, 40, 28)
_AGENT_M: Final = AGENT.radius_m
_MARK_M: Final = 0.11


def draw_trajectory(
    house: House | HouseModel,
    episode: Episode,
    assets: Mapping[str, Asset],
    actions: Sequence[int] | None = None,
    *,
    pixels: int = 700,
    lines: Sequence[str] = (),
    config: WorldConfig = DEFAULT_WORLD,
) -> Image:
    """Draw an episode from above as it was played, north (y) up.

    Objects lie as at the start; dashed outlines are their poses at the end. Green dots and red
    crosses mark the agent's position at successful and failed interactions.

    Parameters
    ----------
    house
        The episode's house or its model.
    episode, assets
        The episode, and the assets of its obstacles by asset_id.
    actions
        Numbers of `Action`, -1 for a wait; the stored expert's by default.
    pixels
        Longer side of the plan; legend and caption are added below it.
    lines
        Lines of the caption.
    config
        Settings of the world: those of the episode's dataset.

    Returns
    -------
    (h, w, 3) uint8 RGB.

    Raises
    ------
    UsageError
        The house or an asset is another's, there is no expert, or no such action.
    """
    model = house if isinstance(house, HouseModel) else HouseModel.of(house)
    story = play(model, episode, assets, actions, config)
    canvas = house_canvas(model.house, pixels)
    on_path = episode.room_paths[0] if episode.room_paths else None
    paint_house(canvas, model.house, on_path)
    shapes = [silhouettes(assets[o.asset_id], o.pose) for o in episode.obstacles]
    for obstacle, parts in zip(episode.obstacles, shapes, strict=True):
        paint_obstacle(canvas, obstacle_kind(obstacle), parts)
    _paint_moved(canvas, story)
    taken = [part.plan for parts in shapes for part in parts]
    ends = [(episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y)]
    taken += [canvas.arc(at, 0.45, 0.0, 360.0) for at in ends]
    paint_labels(canvas, model.house, taken)
    paint_start(canvas, episode)
    paint_goal(canvas, episode)
    _paint_path(canvas, story)
    _paint_end(canvas, story)
    _paint_interactions(canvas, story)
    for number, (obstacle, parts) in enumerate(zip(episode.obstacles, shapes, strict=True), 1):
        paint_number(canvas, number, COLOURS[obstacle_kind(obstacle)], parts)
    return with_caption(canvas.finished(), list(lines), _legend(episode))


def _legend(episode: Episode) -> list[tuple[RGB, str]]:
    kinds = {obstacle_kind(o) for o in episode.obstacles}
    entries = [(START, "start"), (GOAL, "goal"), (LATE, "way (paler: earlier)")]
    entries += [(WORKED, "interaction"), (FAILED, "failed interaction")]
    return entries + [(COLOURS[k], f"{NAMES[k]} obstacle") for k in NAMES if k in kinds]


def _paint_path(canvas: Canvas, story: Story) -> None:
    points = [moment.world.position for moment in story.moments]
    legs = [(k, a, b) for k, (a, b) in enumerate(itertools.pairwise(points)) if a != b]
    for _, a, b in legs:
        canvas.line([a, b], PAPER, 5.0)
    for k, a, b in legs:
        share = k / max(1, len(points) - 1)
        red, green, blue = (round(x + share * (y - x)) for x, y in zip(EARLY, LATE, strict=True))
        canvas.line([a, b], (red, green, blue), 2.6)


def _paint_interactions(canvas: Canvas, story: Story) -> None:
    """Mark the agent's positions; marks at one place fan out, the first ones in the middle."""
    seen: dict[Vec2, int] = {}
    for moment in story.moments:
        result = moment.result
        if result is None or result.action.kind not in INTERACTION_KINDS:
            continue
        place = moment.world.position
        k = seen[place] = seen.get(place, -1) + 1
        turn, away = math.radians(137.5 * k), 0.055 * math.sqrt(k)
        at = (place[0] + away * math.cos(turn), place[1] + away * math.sin(turn))
        if result.success:
            canvas.disc(at, _MARK_M, PAPER)
            canvas.disc(at, 0.8 * _MARK_M, WORKED)
        else:
            _cross(canvas, at)


def _cross(canvas: Canvas, at: Vec2) -> None:
    arm = 0.7 * _MARK_M
    for colour, wide in ((PAPER, 4.6), (FAILED, 2.4)):
        for side in (-1.0, 1.0):
            ends = [(at[0] - arm, at[1] - side * arm), (at[0] + arm, at[1] + side * arm)]
            canvas.line(ends, colour, wide)


def _paint_end(canvas: Canvas, story: Story) -> None:
    world = story.moments[-1].world
    at = world.position
    canvas.disc(at, 0.7 * _AGENT_M, LATE)
    canvas.disc(at, 0.7 * _AGENT_M, PAPER, 1.4)
    turn = math.radians(90.0 * world.quarter)
    tip = (at[0] + 0.8 * _AGENT_M * math.cos(turn), at[1] + 0.8 * _AGENT_M * math.sin(turn))
    canvas.line([at, tip], PAPER, 2.0)
    if not story.success:
        gave_up = world.path_steps() is None
        words = "cut off" if gave_up else "not at the goal"
        last = story.moments[-1].result
        if last is None or last.action != Action.DONE:
            words = "out of steps"
        canvas.text((at[0], at[1] - 1.9 * _AGENT_M), words, 7.5, FAILED, halo=PAPER)


def _paint_moved(canvas: Canvas, story: Story) -> None:
    """Outline the end poses of objects that have moved."""
    first, last = story.moments[0].world, story.moments[-1].world
    for before, after in zip(first.items, last.items, strict=True):
        begin, end = before.pose, after.pose
        if begin is None or end is None or begin == end:
            continue
        ring = _ring(before.asset, end)
        canvas.dashes(np.vstack([ring, ring[:1]]), GHOST, 1.8, 0.07)
        _paint_arrow(canvas, (begin.x, begin.y), (end.x, end.y))


def _ring(asset: Asset, pose: Pose) -> Floats:
    corners = np.vstack([part.plan for part in silhouettes(asset, pose)]).astype(np.float32)
    return np.asarray(cv2.convexHull(corners), np.float64).reshape(-1, 2)


def _paint_arrow(canvas: Canvas, begin: Vec2, end: Vec2) -> None:
    length = math.dist(begin, end)
    if length < _AGENT_M:
        return
    tail, tip = np.array(begin), np.array(end)
    ahead = (tip - tail) / length
    aside = np.array((-ahead[1], ahead[0])) * 0.07
    back = tip - 0.16 * ahead
    canvas.line(np.array([tail, back]), GHOST, 1.6)
    canvas.fill(np.array([tip, back + aside, back - aside]), shaded(GHOST, 0.8))
