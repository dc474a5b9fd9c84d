"""Parts of a replay's frame: the map, the agent's camera, a header, a footer and a title card.

The map draws all that stays once, and moving objects on a copy of it. The camera's picture
highlights the object that is about to be pushed or picked up.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import cv2
import numpy as np

from internav_data.records.agent import AGENT
from internav_data.render.camera import Camera, CameraView, StaticScene
from internav_data.views.asset_sheet import draw_assets
from internav_data.views.canvas import Canvas
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
from internav_data.views.plan import INK, PAPER, paint_house, paint_labels
from internav_data.views.silhouettes import Silhouette, paint, shaded, silhouettes
from internav_data.world import Action
from internav_data.world.actions import INTERACTION_KINDS
from internav_data.world.visibility import CAMERA_M, REACH_M

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Image
    from internav_data.records import RGB, Asset, House, Pose, Vec2
    from internav_data.views.replay_story import Shot, Story
    from internav_data.world import StepResult

AGENT_COLOUR: Final[RGB] = (196, 36, 112)
"""Colour of the agent and its trail."""
_EDGE: Final[RGB] = (206, 204, 198)
GHOST: Final[RGB] = (120, 84, 10)
_TARGET: Final[RGB] = (235, 60, 30)
_MARGIN_M: Final = 0.7
"""Margin around a house on its map."""
_ROOM_M: Final = 1.8
"""Margin around all action, on a map of a part of the house."""
_WHOLE_SHARE: Final = 0.55
"""A map shows the entire house if it would show more than this share of it."""
_RADIUS_M: Final = AGENT.radius_m
_HALF_VIEW_DEG: Final = AGENT.field_of_view_deg / 2.0
_MIN_ASPECT, _MAX_ASPECT = 0.75, 1.6
"""Bounds of a map's width as a share of its height."""
_MIN_RADIUS_PX: Final = 7.0
"""Minimum radius of the agent, for maps of large houses."""


def _box(story: Story) -> tuple[Vec2, Vec2]:
    """Return two corners of the mapped part of the house: all action, with a margin."""
    outline, episode = story.model.house.outline, story.episode
    points = [m.world.position for m in story.moments] + [(episode.goal.x, episode.goal.y)]
    for moment in story.moments:
        poses = (moment.pose(k) for k in (*story.moved, *moment.world.obstacles))
        points += [(p.x, p.y) for p in poses if p is not None]
    inside, house = np.array(points), np.array(outline)
    first, last = house.min(axis=0) - _MARGIN_M, house.max(axis=0) + _MARGIN_M
    low = np.maximum(inside.min(axis=0) - _ROOM_M, first)
    high = np.minimum(inside.max(axis=0) + _ROOM_M, last)
    if float(np.prod(high - low)) > _WHOLE_SHARE * float(np.prod(last - first)):
        low, high = first, last
    return (float(low[0]), float(low[1])), (float(high[0]), float(high[1]))


class MapPainter:
    """Painter of a story's map; its width follows from the house's shape.

    Parameters
    ----------
    story
        The played episode.
    height
        Height of the map, pixels.
    """

    def __init__(self, story: Story, height: int) -> None:
        self._story = story
        (x0, y0), (x1, y1) = _box(story)
        share = min(max((x1 - x0) / (y1 - y0), _MIN_ASPECT), _MAX_ASPECT)
        self.size = (2 * round(height * share / 2.0), height)
        """Width and height, pixels."""
        wide = max(x1 - x0, (y1 - y0) * self.size[0] / height)
        high = wide * height / self.size[0]
        x, y = (x0 + x1 - wide) / 2.0, (y0 + y1 - high) / 2.0
        self._low = (x, y)
        self.canvas = Canvas((x, y), (x + wide, y + high), max(self.size), PAPER)
        """Canvas of the map: where a metre of the floor is drawn."""
        self._silhouettes: dict[tuple[int, Pose], list[Silhouette]] = {}
        self._first = {k: story.moments[0].pose(k) for k in self._moving()}
        self._walls = np.array([
            (w.x_min, w.y_min, w.x_max, w.y_max)
            for w in story.model.house.walls
            if w.z_min < CAMERA_M < w.z_max
        ]).reshape(-1, 4)  # fmt: skip
        self._still = self._static_map()
        self._furnished: tuple[object, Image] = (None, self._still)
        """Latest map with objects, with its key: most actions move none."""

    def _moving(self) -> Iterable[int]:
        return (*self._story.moved, *self._story.moments[0].world.obstacles)

    def _static_map(self) -> Image:
        story, canvas = self._story, self.canvas
        house, episode = story.model.house, story.episode
        gone = {story.model.object_ids[k] for k in story.moved}
        still = replace(house, objects=tuple(t for t in house.objects if t.object_id not in gone))
        margin = 10.0 / canvas.scale
        corner = (self._low[0] + margin, self._low[1] + margin)
        on_path = episode.room_paths[0] if episode.room_paths else None
        paint_house(canvas, still, on_path, scale_at=corner)
        shapes = [part.plan for k, pose in self._first.items() for part in self._parts(k, pose)]
        ends = ((episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y))
        shapes += [canvas.arc(end, 0.45, 0.0, 360.0) for end in ends]
        # Names keep clear of the trail and of end poses, which are drawn later.
        shapes += [canvas.arc(m.world.position, 0.3, 0.0, 360.0) for m in story.moments]
        last = story.moments[-1]
        shapes += [part.plan for k in self._moving() for part in self._parts(k, last.pose(k))]
        paint_labels(canvas, _rooms_on_canvas(still, canvas), shapes)
        paint_start(canvas, episode)
        paint_goal(canvas, episode)
        return canvas.image.copy()

    def draw(self, shot: Shot) -> Image:
        """Return the map at a shot, (h, w, 3) uint8 RGB."""
        canvas = self.canvas
        key = (tuple(shot.poses.items()), shot.target)
        if key == self._furnished[0]:
            canvas.image[:] = self._furnished[1]
        else:
            canvas.image[:] = self._still
            self._paint_ghosts(shot.poses)
            self._paint_objects(shot)
            self._paint_arrows(shot.poses)
            self._furnished = (key, canvas.image.copy())
        self._paint_cone(shot)
        self._paint_trail(shot)
        self._paint_agent(shot)
        picture = canvas.finished()
        picture[:1] = picture[-1:] = picture[:, :1] = picture[:, -1:] = _EDGE
        return picture

    def _parts(self, item: int, pose: Pose | None) -> list[Silhouette]:
        if pose is None:
            return []
        found = self._silhouettes.get((item, pose))
        if found is None:
            asset = self._story.moments[0].world.items[item].asset
            found = self._silhouettes[item, pose] = silhouettes(asset, pose)
        return found

    def _paint_objects(self, shot: Shot) -> None:
        canvas, first = self.canvas, len(self._story.model.items)
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
                    canvas.line(part.plan, shaded(AGENT_COLOUR, 0.8), 2.6, closed=True)
                paint(canvas, parts, line_px=0.8, colour=None)
        for item, pose in shot.poses.items():
            if item >= first and pose is not None:
                obstacle = self._story.episode.obstacles[item - first]
                colour = COLOURS[obstacle_kind(obstacle)]
                paint_number(canvas, item - first + 1, colour, self._parts(item, pose))

    def _paint_ghosts(self, poses: Mapping[int, Pose | None]) -> None:
        """Outline the first poses of objects that have moved or are held."""
        for item, pose in poses.items():
            if pose != self._first[item]:
                ring = _hull(self._parts(item, self._first[item]))
                self.canvas.dashes(np.vstack([ring, ring[:1]]), GHOST, 1.6, 0.07)

    def _paint_arrows(self, poses: Mapping[int, Pose | None]) -> None:
        """Draw arrows from the first poses of objects to their present ones."""
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
            self.canvas.line(np.array([tail, tip - 0.1 * ahead]), GHOST, 1.8)
            back = tip - 0.16 * ahead
            self.canvas.fill(np.array([tip, back + aside, back - aside]), GHOST)

    def _paint_trail(self, shot: Shot) -> None:
        if len(shot.trail) > 1:
            self.canvas.line(shot.trail, PAPER, 5.0)
            self.canvas.line(shot.trail, AGENT_COLOUR, 2.6)

    def _paint_cone(self, shot: Shot) -> None:
        """Tint the camera's field of view up to the agent's reach."""
        at = np.array((shot.x, shot.y))
        left, right = shot.yaw_deg - _HALF_VIEW_DEG, shot.yaw_deg + _HALF_VIEW_DEG
        arc = self.canvas.arc((shot.x, shot.y), REACH_M, left, right)
        cone = np.vstack([at, at + (arc - at) * visible_shares(at, arc, self._walls)[:, None]])
        window = self.canvas.window(
            (float(cone[:, 0].min()), float(cone[:, 1].min())),
            (float(cone[:, 0].max()), float(cone[:, 1].max())),
        )
        part = self.canvas.image[window].copy()
        self.canvas.fill(cone, AGENT_COLOUR)
        tinted = self.canvas.image[window]
        tinted[:] = cv2.addWeighted(part, 0.74, tinted, 0.26, 0.0)

    def _paint_agent(self, shot: Shot) -> None:
        canvas, at = self.canvas, np.array((shot.x, shot.y))
        radius = max(_RADIUS_M, _MIN_RADIUS_PX / canvas.scale)
        turn = math.radians(shot.yaw_deg)
        ahead = np.array([math.cos(turn), math.sin(turn)]) * radius
        left = np.array([-ahead[1], ahead[0]])
        centre = (shot.x, shot.y)
        canvas.disc(centre, radius, AGENT_COLOUR)
        canvas.disc(centre, radius, PAPER, 1.6)
        arrow = [at + 0.8 * ahead, at - 0.5 * ahead + 0.55 * left, at - 0.2 * ahead]
        canvas.fill(np.array([*arrow, at - 0.5 * ahead - 0.55 * left]), PAPER)
        canvas.disc(centre, radius * 1.12, INK, 0.8)


def _hull(parts: list[Silhouette]) -> Floats:
    """Return the convex outline (n, 2) around all parts."""
    corners = np.vstack([part.plan for part in parts]).astype(np.float32)
    return np.asarray(cv2.convexHull(corners), np.float64).reshape(-1, 2)


def visible_shares(at: Floats, ends: Floats, walls: Floats) -> Floats:
    """Return the shares (n,) of segments from a point (2,) to ends (n, 2) before a wall (m, 4).

    Walls are axis-parallel boxes, intersected by the slab method (Kay and Kajiya 1986).
    """
    ahead = (ends - at)[:, None, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (walls[:, :2] - at) / ahead, (walls[:, 2:] - at) / ahead
    # Along a wall's side 0 / 0 is undefined; the other axis decides.
    enter = np.nan_to_num(np.minimum(first, second), nan=-np.inf).max(axis=2)
    leave = np.nan_to_num(np.maximum(first, second), nan=np.inf).min(axis=2)
    hits = np.where((enter <= leave) & (leave > 0.0), np.maximum(enter, 0.0), 1.0)
    shares: Floats = np.minimum(hits.min(axis=1, initial=1.0), 1.0)
    return shares


def _rooms_on_canvas(house: House, canvas: Canvas) -> House:
    """Return a house of only those rooms of which half is on the canvas: others get no name."""
    kept = []
    for room in house.rooms:
        xs, ys = [p[0] for p in room.polygon], [p[1] for p in room.polygon]
        rows, columns = canvas.window((min(xs), min(ys)), (max(xs), max(ys)))
        area = (rows.stop - rows.start) * (columns.stop - columns.start)
        whole = (max(xs) - min(xs)) * (max(ys) - min(ys)) * (2.0 * canvas.scale) ** 2
        if area > 0.5 * whole:
            kept.append(room)
    return replace(house, rooms=tuple(kept))


_HIGHLIGHT: Final[RGB] = (255, 214, 40)
_RIM: Final[RGB] = (60, 44, 8)
_FAILED: Final[RGB] = (214, 44, 32)
_PAPER: Final[RGB] = (250, 249, 246)
_STRIP_INK: Final[RGB] = (52, 54, 62)


class CameraPainter:
    """Painter of the agent's camera pictures, `size` pixels a side."""

    def __init__(self, story: Story, size: int) -> None:
        self._story, self._size = story, size
        house, first = story.model.house, story.moments[0]
        world = first.world
        self._scene = StaticScene.of(house)
        objects = [(world.items[k].asset, world.items[k].pose) for k in world.obstacles]
        self._props = self._scene.props([(a, p) for a, p in objects if p is not None])
        rows = {object_.object_id: row for row, object_ in enumerate(house.objects)}
        self._instances = [rows[t] for t in story.model.object_ids]
        self._instances += [len(house.objects) + k for k in range(len(objects))]
        self._camera = Camera(size)
        self._icons: dict[int, Image] = {}

    def draw(self, shot: Shot) -> Image:
        """Return the picture at a shot, (size, size, 3) uint8 RGB."""
        held = -1
        for item, pose in shot.poses.items():
            if pose is None:
                self._props.hide(self._instances[item])
                held = item
            else:
                self._props.move(self._instances[item], pose)
                self._props.show(self._instances[item])
        view = CameraView(self._scene, self._props, shot.x, shot.y, shot.yaw_deg, shot.horizon_deg)
        frames = self._camera.render([view])
        picture: Image = frames.rgb[0]
        if shot.target >= 0:
            highlight(picture, frames.ids[0] == 1 + self._instances[shot.target])
        if held >= 0:
            self._in_hand(picture, held)
        if shot.mood == "bad":
            wide = max(2, self._size // 80)
            cv2.rectangle(picture, (0, 0), (self._size - 1, self._size - 1), _FAILED, 2 * wide)
        return picture

    def _in_hand(self, picture: Image, item: int) -> None:
        """Show the held object in a corner."""
        side, gap = self._size // 4, self._size // 50
        icon = self._icons.get(item)
        if icon is None:
            asset = self._story.moments[0].world.items[item].asset
            icon = self._icons[item] = _icon(asset, side)
        picture[-side - gap : -gap, -side - gap : -gap] = icon


def highlight(picture: Image, mask: NDArray[np.bool_]) -> None:
    """Draw a line around a mask (h, w) into a picture (h, w, 3) uint8."""
    thick = max(1, len(picture) // 200)
    inside = mask.astype(np.uint8)
    for reach, colour in ((2 * thick + 1, _RIM), (thick + 1, _HIGHLIGHT)):
        kernel = np.ones((2 * reach + 1, 2 * reach + 1), np.uint8)
        picture[(cv2.dilate(inside, kernel) > 0) & ~mask] = colour


def _icon(asset: Asset, side: int) -> Image:
    """Return a picture of an asset with a label above it, (side, side, 3)."""
    label = side // 6
    canvas = Canvas((0.0, 0.0), (float(side), float(side)), side, _PAPER)
    canvas.text((side / 2.0, side - 0.58 * label), "in hand", 0.42 * label, _LETTERS)
    icon = canvas.finished()
    icon[label:] = draw_assets([asset], side, side - label)
    edge = max(1, side // 40)
    icon[:edge] = icon[-edge:] = _HIGHLIGHT
    icon[:, :edge] = icon[:, -edge:] = _HIGHLIGHT
    return icon


_LETTERS: Final[RGB] = (40, 42, 50)
_FAINT: Final[RGB] = (104, 106, 114)
_STRIP_BAD: Final[RGB] = (200, 36, 24)
_GOOD: Final[RGB] = (24, 128, 66)
_MOODS: Final = {"plain": _STRIP_INK, "good": _GOOD, "bad": _STRIP_BAD}
_MOVE: Final[RGB] = (96, 132, 176)
_TURN: Final[RGB] = (172, 190, 208)
_PUSH: Final[RGB] = (242, 158, 24)
_PICK: Final[RGB] = (58, 160, 110)
_WAIT: Final[RGB] = (206, 204, 200)
_REFERENCE: Final = 400.0
"""Camera size at which lengths in the code are pixels."""


def _strip(width: int, height: int, background: RGB = _PAPER) -> Canvas:
    return Canvas((0.0, 0.0), (float(width), float(height)), max(width, height), background)


def _fitting(canvas: Canvas, text: str, height_px: float, room: float) -> float:
    """Return the largest letter height up to `height_px` at which a text fits."""
    return min(height_px, height_px * room / max(canvas.text_width(text, height_px), 1.0))


def _colour(result: StepResult) -> RGB:
    if result.action.kind == "push":
        return _PUSH
    if result.action.kind in INTERACTION_KINDS:
        return _PICK
    if result.action.kind == "move":
        return _MOVE
    return {Action.DONE: GOAL, Action.WAIT: _WAIT}.get(result.action, _TURN)


class Header:
    """Strip with the episode's id and the number of the step."""

    def __init__(self, story: Story, width: int, size: int) -> None:
        self._unit = size / _REFERENCE
        self._width, self.height = width, 2 * round(15 * self._unit)
        episode = story.episode
        rooms = "1 room" if episode.room_count == 1 else f"{episode.room_count} rooms"
        self._text = f"{episode.episode_id}   {episode.mode}   {rooms}"

    def draw(self, shot: Shot) -> Image:
        """Return the strip at a shot, (height, width, 3) uint8 RGB."""
        canvas, unit = _strip(self._width, self.height), self._unit
        y = self.height / 2.0
        count = f"step {shot.moment.step} of {shot.moment.total}"
        wide = canvas.text_width(count, 9.0 * unit)
        right = self._width - 8.0 * unit
        room = right - wide - 20.0 * unit
        height = _fitting(canvas, self._text, 9.0 * unit, room)
        canvas.text((8.0 * unit, y), self._text, height, _FAINT, anchor="left")
        canvas.text((right - wide, y), count, 9.0 * unit, _FAINT, anchor="left")
        return canvas.finished()


class Footer:
    """Strip with the action in words, the goal's distance, the held object and all actions."""

    def __init__(self, story: Story, width: int, size: int) -> None:
        self._story, self._unit = story, size / _REFERENCE
        self._width, self.height = width, 2 * round(38 * self._unit)

    def draw(self, shot: Shot) -> Image:
        """Return the strip at a shot, (height, width, 3) uint8 RGB."""
        canvas, unit = _strip(self._width, self.height), self._unit
        left, room = 8.0 * unit, self._width - 16.0 * unit
        height = _fitting(canvas, shot.text, 13.0 * unit, room)
        y = self.height - 20.0 * unit
        canvas.text((left, y), shot.text, height, _MOODS[shot.mood], anchor="left")
        steps = (
            "blocked: no way to the goal" if shot.path_steps is None else f"{shot.path_steps} steps"
        )
        if shot.path_steps is not None:
            steps = f"to the goal: {steps}"
        parts = [steps]
        held = [k for k, pose in shot.poses.items() if pose is None]
        parts += [f"in hand: {self._story.name(k)}" for k in held]
        colour = _STRIP_BAD if shot.path_steps is None else _FAINT
        canvas.text((left, y - 24.0 * unit), "   ".join(parts), 9.5 * unit, colour, anchor="left")
        self._paint_actions(canvas, shot.moment.step)
        return canvas.finished()

    def _paint_actions(self, canvas: Canvas, step: int) -> None:
        """Paint a cell for each action: pale if it is to come, notched in red if it failed."""
        results, unit = self._story.results, self._unit
        left, low, high = 8.0 * unit, 8.0 * unit, 19.0 * unit
        each = (self._width - 16.0 * unit) / max(len(results), 1)
        gap = 1.0 * unit if each > 4.0 * unit else 0.0
        for k, result in enumerate(results):
            x0, x1 = left + k * each, left + (k + 1) * each - gap
            r, g, b = _colour(result)
            pale = ((r + 3 * 246) // 4, (g + 3 * 244) // 4, (b + 3 * 240) // 4)
            colour = (r, g, b) if k < step else pale
            canvas.fill([(x0, low), (x1, low), (x1, high), (x0, high)], colour)
            if not result.success:
                top = high - 4.0 * unit
                bad = _STRIP_BAD if k < step else (236, 170, 164)
                canvas.fill([(x0, top), (x1, top), (x1, high), (x0, high)], bad)
        if 0 < step <= len(results):
            x0, x1 = left + (step - 1) * each, left + step * each - gap
            box = [(x0, low - 2.0), (x1, low - 2.0), (x1, high + 2.0), (x0, high + 2.0)]
            canvas.line(box, _STRIP_INK, 1.6, closed=True)


def title_card(story: Story, title: str, size: int) -> Image:
    """Return the title card, shown in place of the camera's picture, (size, size, 3) uint8."""
    unit = size / _REFERENCE
    canvas = _strip(size, size, (240, 238, 232))
    rows = _title_rows(story, title)
    each = min(25.0, 372.0 / len(rows))
    y = size - (14.0 + each / 2.0) * unit
    for colour, number, text in rows:
        x = 16.0 * unit
        if colour is not None:
            canvas.disc((x + 8.0 * unit, y), 8.0 * unit, colour)
            canvas.disc((x + 8.0 * unit, y), 8.0 * unit, shaded(colour, 0.5), 1.0)
            if number:
                canvas.text((x + 8.0 * unit, y), str(number), 7.5 * unit, _STRIP_INK)
            x += 26.0 * unit
        height = _fitting(canvas, text, min(0.44 * each, 10.5) * unit, size - x - 12.0 * unit)
        canvas.text((x, y), text, height, _STRIP_INK, anchor="left")
        y -= each * unit
    return canvas.finished()


def _title_rows(story: Story, title: str) -> list[tuple[RGB | None, int, str]]:
    """Rows of the title card: colour of a mark, number in it, text."""
    episode = story.episode
    rooms = "1 room" if episode.room_count == 1 else f"{episode.room_count} rooms"
    path = (
        "cut off"
        if episode.obstructed_path_steps is None
        else f"{episode.obstructed_path_steps} steps"
    )
    text = "blocked: something must be moved" if episode.interactive else "lengthened: a detour"
    rows: list[tuple[RGB | None, int, str]] = [
        (None, 0, f"{episode.episode_id}, {rooms}"),
        (None, 0, text),
        (None, 0, f"goal: {path}, without obstacles {episode.shortest_path_steps} steps"),
        (None, 0, _summary(story, title)),
        (START, 0, "start"),
        (GOAL, 0, "goal"),
        (AGENT_COLOUR, 0, "agent, its path, its view as far as it reaches"),
    ]
    for k, obstacle in enumerate(episode.obstacles, 1):
        kind = obstacle_kind(obstacle)
        text = f"{obstacle.type}, {obstacle.mass_kg:.1f} kg, {NAMES[kind]}"
        rows.append((COLOURS[kind], k, text))
    return rows


def _summary(story: Story, title: str) -> str:
    results = story.results
    pushes = sum(r.action.kind == "push" for r in results)
    picks = sum(r.action == Action.PICKUP for r in results)
    parts = [f"{len(results)} action{'' if len(results) == 1 else 's'}"]
    parts += [f"{pushes} push{'' if pushes == 1 else 'es'}"] if pushes else []
    parts += [f"{picks} pick{'' if picks == 1 else 's'}"] if picks else []
    return f"{title}: {', '.join(parts)}"
