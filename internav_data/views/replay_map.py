"""The map of a replay: what stays drawn once, what moves drawn on a copy of it."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from internav_data.views.canvas import Canvas
from internav_data.views.plan import INK, PAPER, paint_house, paint_labels
from internav_data.views.silhouettes import Outline, outlines, paint, shaded
from internav_data.views.tasks import (
    COLOURS,
    obstacle_kind,
    paint_goal,
    paint_number,
    paint_obstacle,
    paint_start,
)
from internav_data.world.sight import CAMERA_M, REACH_M

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from internav_data.records import RGB, House, Pose, Vec2
    from internav_data.views.replay_shots import Shot
    from internav_data.views.replay_story import Story

    Image = NDArray[np.uint8]
    Floats = NDArray[np.float64]

AGENT: Final[RGB] = (196, 36, 112)
"""Of the agent and its trail."""
_EDGE: Final[RGB] = (206, 204, 198)
_GHOST: Final[RGB] = (120, 84, 10)
_TARGET: Final[RGB] = (235, 60, 30)
_MARGIN_M: Final = 0.7
"""Shown around a house, and (`_ROOM_M`) around what happens where not all of it is shown."""
_ROOM_M: Final = 1.8
_MOST: Final = 0.55
"""A house is shown whole where this share of it would be."""
_RADIUS_M: Final = 0.2
_NARROWEST, _WIDEST = 0.75, 1.6
"""Of a map, as a share of its height."""
_SMALLEST_PX: Final = 7.0
"""Radius of the agent on the map of a large house."""


def _box(story: Story) -> tuple[Vec2, Vec2]:
    """Corners of the part of the house that matters: all that happens in it, with some room."""
    outline, episode = story.stage.house.outline, story.episode
    points = [m.world.position for m in story.moments] + [(episode.goal.x, episode.goal.y)]
    for moment in story.moments:
        poses = (moment.pose(k) for k in (*story.moved, *moment.world.obstacles))
        points += [(p.x, p.y) for p in poses if p is not None]
    inside, house = np.array(points), np.array(outline)
    first, last = house.min(axis=0) - _MARGIN_M, house.max(axis=0) + _MARGIN_M
    low = np.maximum(inside.min(axis=0) - _ROOM_M, first)
    high = np.minimum(inside.max(axis=0) + _ROOM_M, last)
    if float(np.prod(high - low)) > _MOST * float(np.prod(last - first)):
        low, high = first, last
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))


class MapPainter:
    """Draws a story's map, `height` pixels high and as wide as the house asks for.

    Parameters
    ----------
    story
        What happens.
    height
        Pixels.
    """

    def __init__(self, story: Story, height: int) -> None:
        self._story = story
        (x0, y0), (x1, y1) = _box(story)
        share = min(max((x1 - x0) / (y1 - y0), _NARROWEST), _WIDEST)
        self.size = (2 * round(height * share / 2.0), height)
        """Width and height, pixels."""
        wide = max(x1 - x0, (y1 - y0) * self.size[0] / height)
        high = wide * height / self.size[0]
        x, y = (x0 + x1 - wide) / 2.0, (y0 + y1 - high) / 2.0
        self._low = (x, y)
        self._canvas = Canvas((x, y), (x + wide, y + high), max(self.size), PAPER)
        self._outlines: dict[tuple[int, Pose], list[Outline]] = {}
        self._first = {k: story.moments[0].pose(k) for k in self._moving()}
        self._walls = np.array([
            (w.x_min, w.y_min, w.x_max, w.y_max)
            for w in story.stage.house.walls
            if w.z_min < CAMERA_M < w.z_max
        ]).reshape(-1, 4)  # fmt: skip
        self._still = self._drawn_once()
        self._furnished: tuple[object, Image] = (None, self._still)
        """The latest picture with things on it: most actions move none."""

    def _moving(self) -> Iterable[int]:
        return (*self._story.moved, *self._story.moments[0].world.obstacles)

    def _drawn_once(self) -> Image:
        story, canvas = self._story, self._canvas
        house, episode = story.stage.house, story.episode
        gone = {story.stage.thing_ids[k] for k in story.moved}
        still = replace(house, things=tuple(t for t in house.things if t.thing_id not in gone))
        margin = 10.0 / canvas.scale
        corner = (self._low[0] + margin, self._low[1] + margin)
        on_way = episode.room_paths[0] if episode.room_paths else None
        paint_house(canvas, still, on_way, scale_at=corner)
        shapes = [part.plan for k, pose in self._first.items() for part in self._parts(k, pose)]
        ends = ((episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y))
        shapes += [canvas.arc(end, 0.45, 0.0, 360.0) for end in ends]
        # The trail and what is laid aside come later, over the names.
        shapes += [canvas.arc(m.world.position, 0.3, 0.0, 360.0) for m in story.moments]
        last = story.moments[-1]
        shapes += [part.plan for k in self._moving() for part in self._parts(k, last.pose(k))]
        paint_labels(canvas, _seen(still, canvas), shapes)
        paint_start(canvas, episode)
        paint_goal(canvas, episode)
        return canvas.image.copy()

    def draw(self, shot: Shot) -> Image:
        """Return the map at a shot, (h, w, 3) uint8 RGB."""
        canvas = self._canvas
        key = (tuple(shot.poses.items()), shot.target)
        if key == self._furnished[0]:
            canvas.image[:] = self._furnished[1]
        else:
            canvas.image[:] = self._still
            self._paint_ghosts(shot.poses)
            self._paint_things(shot)
            self._paint_arrows(shot.poses)
            self._furnished = (key, canvas.image.copy())
        self._paint_cone(shot)
        self._paint_trail(shot)
        self._paint_agent(shot)
        picture = canvas.finished()
        picture[:1] = picture[-1:] = picture[:, :1] = picture[:, -1:] = _EDGE
        return picture

    def _parts(self, item: int, pose: Pose | None) -> list[Outline]:
        if pose is None:
            return []
        found = self._outlines.get((item, pose))
        if found is None:
            asset = self._story.moments[0].world.items[item].asset
            found = self._outlines[item, pose] = outlines(asset, pose)
        return found

    def _paint_things(self, shot: Shot) -> None:
        canvas, first = self._canvas, len(self._story.stage.items)
        for item, pose in shot.poses.items():
            parts = self._parts(item, pose)
            if not parts:
                continue
            if item == shot.target:
                canvas.line(_hull(parts), _TARGET, 6.0, closed=True)
            if item >= first:
                obstacle = self._story.episode.obstacles[item - first]
                paint_obstacle(canvas, obstacle_kind(obstacle), parts)
            else:
                for part in parts:
                    canvas.line(part.plan, shaded(AGENT, 0.8), 2.6, closed=True)
                paint(canvas, parts, line_px=0.8, colour=None)
        for item, pose in shot.poses.items():
            if item >= first and pose is not None:
                obstacle = self._story.episode.obstacles[item - first]
                colour = COLOURS[obstacle_kind(obstacle)]
                paint_number(canvas, item - first + 1, colour, self._parts(item, pose))

    def _paint_ghosts(self, poses: Mapping[int, Pose | None]) -> None:
        """Outline where things stood that lie elsewhere, or are held, now."""
        for item, pose in poses.items():
            if pose != self._first[item]:
                ring = _hull(self._parts(item, self._first[item]))
                self._canvas.dashes(np.vstack([ring, ring[:1]]), _GHOST, 1.6, 0.07)

    def _paint_arrows(self, poses: Mapping[int, Pose | None]) -> None:
        """Point from where things stood to where they are."""
        for item, pose in poses.items():
            begin = self._first[item]
            if (
                begin is None
                or pose is None
                or math.dist((begin.x, begin.y), (pose.x, pose.y)) < 0.1
            ):
                continue
            tail, tip = np.array((begin.x, begin.y)), np.array((pose.x, pose.y))
            ahead = (tip - tail) / float(np.linalg.norm(tip - tail))
            aside = np.array((-ahead[1], ahead[0])) * 0.07
            self._canvas.line(np.array([tail, tip - 0.1 * ahead]), _GHOST, 1.8)
            back = tip - 0.16 * ahead
            self._canvas.fill(np.array([tip, back + aside, back - aside]), _GHOST)

    def _paint_trail(self, shot: Shot) -> None:
        if len(shot.trail) > 1:
            self._canvas.line(shot.trail, PAPER, 5.0)
            self._canvas.line(shot.trail, AGENT, 2.6)

    def _paint_cone(self, shot: Shot) -> None:
        """Tint what the camera's field of view takes in, as far as the agent reaches."""
        at = np.array((shot.x, shot.y))
        arc = self._canvas.arc((shot.x, shot.y), REACH_M, shot.yaw_deg - 45.0, shot.yaw_deg + 45.0)
        cone = np.vstack([at, at + (arc - at) * _open_shares(at, arc, self._walls)[:, None]])
        window = self._canvas.window(
            (float(cone[:, 0].min()), float(cone[:, 1].min())),
            (float(cone[:, 0].max()), float(cone[:, 1].max())),
        )
        part = self._canvas.image[window].copy()
        self._canvas.fill(cone, AGENT)
        tinted = self._canvas.image[window]
        tinted[:] = cv2.addWeighted(part, 0.74, tinted, 0.26, 0.0)

    def _paint_agent(self, shot: Shot) -> None:
        canvas, at = self._canvas, np.array((shot.x, shot.y))
        radius = max(_RADIUS_M, _SMALLEST_PX / canvas.scale)
        turn = math.radians(shot.yaw_deg)
        ahead = np.array([math.cos(turn), math.sin(turn)]) * radius
        left = np.array([-ahead[1], ahead[0]])
        centre = (shot.x, shot.y)
        canvas.disc(centre, radius, AGENT)
        canvas.disc(centre, radius, PAPER, 1.6)
        arrow = [at + 0.8 * ahead, at - 0.5 * ahead + 0.55 * left, at - 0.2 * ahead]
        canvas.fill(np.array([*arrow, at - 0.5 * ahead - 0.55 * left]), PAPER)
        canvas.disc(centre, radius * 1.12, INK, 0.8)


def _hull(parts: list[Outline]) -> Floats:
    """Convex outline (n, 2) around all parts."""
    corners = np.vstack([part.plan for part in parts]).astype(np.float32)
    return np.asarray(cv2.convexHull(corners), np.float64).reshape(-1, 2)


def _open_shares(at: Floats, ends: Floats, walls: Floats) -> Floats:
    """Return which share of the way to each end (n, 2) is before the first wall (m, 4), (n,)."""
    ahead = (ends - at)[:, None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (walls[:, :2] - at) / ahead, (walls[:, 2:] - at) / ahead
    # Along a wall's side 0 / 0 says nothing; the other direction decides.
    enter = np.nan_to_num(np.minimum(first, second), nan=-np.inf).max(axis=2)
    leave = np.nan_to_num(np.maximum(first, second), nan=np.inf).min(axis=2)
    hits = np.where((enter <= leave) & (leave > 0.0), np.maximum(enter, 0.0), 1.0)
    shares: Floats = np.minimum(hits.min(axis=1, initial=1.0), 1.0)
    return shares


def _seen(house: House, canvas: Canvas) -> House:
    """Return a house of only those rooms of which half is on the canvas: the others get no name."""
    kept = []
    for room in house.rooms:
        xs, ys = [p[0] for p in room.polygon], [p[1] for p in room.polygon]
        rows, columns = canvas.window((min(xs), min(ys)), (max(xs), max(ys)))
        area = (rows.stop - rows.start) * (columns.stop - columns.start)
        whole = (max(xs) - min(xs)) * (max(ys) - min(ys)) * (2.0 * canvas.scale) ** 2
        if area > 0.5 * whole:
            kept.append(room)
    return replace(house, rooms=tuple(kept))
