"""One episode from above: obstacles in yellow, start, goal and the paths between them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from internav_data.records.agent import AGENT
from internav_data.records.errors import UsageError
from internav_data.views.captions import with_caption
from internav_data.views.plan import INK, PAPER, house_canvas, paint_house, paint_labels
from internav_data.views.silhouettes import Silhouette, paint, shaded, silhouettes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.core.typing import Floats, Image
    from internav_data.records import RGB, Asset, Episode, House, Obstacle, Vec2
    from internav_data.views.canvas import Canvas

ObstacleKind = Literal["push", "pick", "fixed"]
"""Interactions that an obstacle allows; fixed allows none."""
PUSHABLE: RGB = (255, 211, 38)
PICKABLE: RGB = (255, 238, 130)
FIXED: RGB = (228, 150, 20)
COLOURS: dict[ObstacleKind, RGB] = {"push": PUSHABLE, "pick": PICKABLE, "fixed": FIXED}
NAMES: dict[ObstacleKind, str] = {"push": "pushable", "pick": "pickable", "fixed": "fixed"}
_RIM: RGB = (48, 36, 8)
START: RGB = (40, 148, 84)
GOAL: RGB = (36, 104, 214)
_PATH: RGB = (150, 70, 150)
_ROOM_PATH: RGB = (164, 195, 246)
"""Swatch of the tinted rooms: pale as they are, not to be taken for the goal."""
_SHORTEST_PATH: RGB = (36, 104, 214)
_RADIUS_M = AGENT.radius_m
_SMALL_M = 0.3
"""Obstacles smaller than this are ringed: an apple is three pixels wide."""


def draw_episode(
    house: House,
    episode: Episode,
    assets: Mapping[str, Asset] | None = None,
    *,
    pixels: int = 900,
    path: Floats | None = None,
) -> Image:
    """Draw an episode from above, north (y) up, with a legend and a caption.

    Parameters
    ----------
    house
        The house that the episode plays in.
    episode
        The episode.
    assets
        Assets of the obstacles by asset_id, beyond those of the house.
    pixels
        Longer side of the plan; legend and caption are added below it.
    path
        Euclidean path to draw, shape (n, 2), metres.

    Returns
    -------
    (h, w, 3) uint8 RGB.

    Raises
    ------
    UsageError
        The episode belongs to another house, or an obstacle's asset is not known.
    """
    if episode.scene_id != house.scene_id:
        raise UsageError(
            f"episode {episode.episode_id} plays in {episode.scene_id}, not in {house.scene_id}; "
            "pass the house that `dataset.scene(episode.scene_id)` returns"
        )
    known = {**house.assets, **(assets or {})}
    shapes = [_silhouettes(obstacle, known) for obstacle in episode.obstacles]
    canvas = house_canvas(house, pixels)
    on_path = episode.room_paths[0] if episode.room_paths else ()
    paint_house(canvas, house, on_path)
    for k, node_path in enumerate(episode.node_paths):
        if k == 0:
            canvas.dashes(node_path.points, _PATH, 2.0, 0.14)
    if path is not None and len(path) > 1:
        canvas.line(path, _SHORTEST_PATH, 1.6)
    for obstacle, parts in zip(episode.obstacles, shapes, strict=True):
        paint_obstacle(canvas, obstacle_kind(obstacle), parts)
    paint_start(canvas, episode)
    paint_goal(canvas, episode)
    taken = [p.plan for parts in shapes for p in parts]
    taken += [canvas.arc(at, 0.45, 0.0, 360.0) for at in _ends(episode)]
    paint_labels(canvas, house, taken)
    for number, (obstacle, parts) in enumerate(zip(episode.obstacles, shapes, strict=True), 1):
        paint_number(canvas, number, COLOURS[obstacle_kind(obstacle)], parts)
    return with_caption(canvas.finished(), episode_lines(episode), _legend(episode))


def episode_lines(episode: Episode) -> list[str]:
    """Return the caption of an episode's picture: its figures, then its obstacles."""
    mode = f"{episode.mode}, {'sealed' if episode.sealed else 'passable off the grid'}"
    if episode.mode == "lengthened":
        mode = episode.mode
    first = [
        episode.episode_id,
        mode,
        f"shortest path {episode.shortest_path_steps} steps, {episode.shortest_path_m:.2f} m",
        f"with obstacles {_with_obstacles(episode)}",
    ]
    objects = [
        f"{k} {o.type} {o.mass_kg:.1f} kg ({obstacle_kind(o)})"
        for k, o in enumerate(episode.obstacles, 1)
    ]
    return ["   ".join(first), "   ".join(objects)] if objects else ["   ".join(first)]


def _with_obstacles(episode: Episode) -> str:
    if episode.obstructed_path_steps is not None:
        return (
            f"{episode.obstructed_path_steps} steps, {episode.obstructed_path_m or math.nan:.2f} m"
        )
    if episode.obstructed_path_m is not None:
        return f"cut off on the grid, {episode.obstructed_path_m:.2f} m off it"
    return "cut off"


def _ends(episode: Episode) -> tuple[Vec2, Vec2]:
    return (episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y)


def obstacle_kind(obstacle: Obstacle) -> ObstacleKind:
    """Return what can be done with an obstacle."""
    if obstacle.pickable:
        return "pick"
    return "push" if obstacle.pushable else "fixed"


def _legend(episode: Episode) -> list[tuple[RGB, str]]:
    kinds = {obstacle_kind(o) for o in episode.obstacles}
    entries = [(START, "start"), (GOAL, "goal"), (_ROOM_PATH, "shortest room path")]
    entries.append((_PATH, "node path, straight from door to door"))
    return entries + [(COLOURS[k], f"{NAMES[k]} obstacle") for k in NAMES if k in kinds]


def _silhouettes(obstacle: Obstacle, assets: Mapping[str, Asset]) -> list[Silhouette]:
    asset = assets.get(obstacle.asset_id)
    if asset is None:
        raise UsageError(
            f"obstacle {obstacle.asset_id}: its asset is not known; pass the dataset's assets or "
            "the catalogue that the episode was made with"
        )
    return silhouettes(asset, obstacle.pose)


def paint_obstacle(canvas: Canvas, kind: ObstacleKind, parts: list[Silhouette]) -> None:
    """Paint an obstacle in the colour of its kind, with a dark rim; a small one with a ring."""
    colour = COLOURS[kind]
    low, high = _extent(parts)
    if float((high - low).max()) < _SMALL_M:
        middle = (float(low[0] + high[0]) / 2.0, float(low[1] + high[1]) / 2.0)
        canvas.disc(middle, 0.16, _RIM, 3.0)
        canvas.disc(middle, 0.16, colour, 1.4)
        for part in parts:
            canvas.fill(part.plan, colour)
        return
    for part in parts:  # a dark rim around the object
        canvas.line(part.plan, _RIM, 3.4, closed=True)
    paint(canvas, parts, line_px=0.8, colour=colour)
    if kind == "fixed":
        _hatch(canvas, parts)


def _hatch(canvas: Canvas, parts: list[Silhouette]) -> None:
    """Draw diagonal lines over a fixed obstacle."""
    mask = canvas.mask([p.plan for p in parts])
    low, high = _extent(parts)
    window = canvas.window((float(low[0]), float(low[1])), (float(high[0]), float(high[1])))
    x, y = canvas.metres(window)
    lines = np.zeros_like(mask)
    lines[window] = np.where((x[None, :] + y[:, None]) % 0.12 < 0.03, 255, 0)
    canvas.blend(np.minimum(mask, lines), (70, 44, 0), 0.7)


def _extent(parts: list[Silhouette]) -> tuple[Floats, Floats]:
    corners = np.vstack([p.plan for p in parts])
    return corners.min(axis=0), corners.max(axis=0)


def paint_number(canvas: Canvas, number: int, colour: RGB, parts: list[Silhouette]) -> None:
    """Paint a numbered badge on the obstacle, or beside a small one."""
    low, high = _extent(parts)
    at = (low + high) / 2.0
    radius = 6.5 / canvas.scale
    if float((high - low).max()) < 4.0 * radius:
        at = np.array([high[0] + 1.2 * radius, high[1] + 1.2 * radius])
    centre = (float(at[0]), float(at[1]))
    canvas.disc(centre, radius, INK)
    canvas.disc(centre, radius, colour, 1.0)
    canvas.text(centre, str(number), 6.5, PAPER)


def paint_start(canvas: Canvas, episode: Episode) -> None:
    """Paint the agent's disc at the start, with an arrow along its yaw."""
    at = (episode.start.x, episode.start.y)
    turn = math.radians(episode.start.yaw_deg)
    ahead = np.array([math.cos(turn), math.sin(turn)])
    left = np.array([-ahead[1], ahead[0]])
    tip = np.array(at)
    canvas.disc(at, _RADIUS_M, START)
    canvas.disc(at, _RADIUS_M, shaded(START, 0.6), 1.4)
    arrow = [tip + 0.34 * ahead, tip - 0.1 * ahead + 0.13 * left, tip - 0.04 * ahead]
    arrow.append(tip - 0.1 * ahead - 0.13 * left)
    canvas.fill(np.array(arrow), PAPER)
    canvas.line(np.array(arrow), shaded(START, 0.5), 1.0, closed=True)


def paint_goal(canvas: Canvas, episode: Episode) -> None:
    """Paint a target of the agent's size."""
    at = (episode.goal.x, episode.goal.y)
    canvas.disc(at, _RADIUS_M, GOAL)
    canvas.disc(at, _RADIUS_M * 0.62, PAPER, 1.4)
    canvas.disc(at, _RADIUS_M * 0.3, PAPER)
    canvas.disc(at, _RADIUS_M, shaded(GOAL, 0.6), 1.4)
