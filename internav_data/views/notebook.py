"""Houses, episodes and replays as notebooks show them: PNG, and HTML that needs nothing else."""

from __future__ import annotations

import base64
import tempfile
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.records import Episode, House, Obstacle, Outcome, Vec2
    from internav_data.views.replay import Replay

PIXELS: Final = 700
"""Longer side of a house's picture."""
FILM_PIXELS: Final = 240
"""Pixels a side of the camera's picture in a replay."""
FILM_FPS: Final = 6.0
"""Frames a second of a replay."""
_SCALE: Final = 48.0
"""Pixels a metre of an episode's map."""
_MARGIN_M: Final = 0.6


def house_png(house: House) -> bytes:
    """Return a house from above as PNG."""
    from internav_data.views.plan import draw_house  # noqa: PLC0415 - needs OpenCV
    from internav_data.views.sheets import png_bytes  # noqa: PLC0415 - as above

    return png_bytes(draw_house(house, pixels=PIXELS))


def replay_html(replay: Replay) -> str:
    """Return a replay as an image that plays in the page, a GIF."""
    from internav_data.views.video import write_video  # noqa: PLC0415 - needs OpenCV

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "replay.gif"
        write_video(path, replay.frames(size=FILM_PIXELS, fps=FILM_FPS), FILM_FPS)
        data = base64.b64encode(path.read_bytes()).decode()
    words = escape(f"{replay.title}: {replay.steps} actions")
    return f'<img alt="{words}" title="{words}" src="data:image/gif;base64,{data}">'


def episode_html(episode: Episode) -> str:
    """Return an episode's map without its house, and its obstacles with what moves them."""
    facts = escape(repr(episode).partition("\n  obstacles")[0])
    rows = "".join(_row(k, obstacle) for k, obstacle in enumerate(episode.obstacles))
    heads = "".join(
        f"<th>{head}</th>" for head in ("", "obstacle", "kg", "opens the lattice", "moves", "stays")
    )
    expert = episode.expert
    told = "no expert" if expert is None else f"expert: {expert.summary}"
    return (
        f"<div><pre>{facts}</pre>{_svg(episode)}<table><tr>{heads}</tr>{rows}</table>"
        f"<p>{escape(told)}</p></div>"
    )


def _row(number: int, obstacle: Obstacle) -> str:
    outcomes = obstacle.outcomes or ()
    groups: tuple[list[str], list[str], list[str]] = ([], [], [])
    for outcome in outcomes:
        groups[0 if outcome.opened else 1 if outcome.success else 2].append(_outcome_words(outcome))
    cells = [str(number), obstacle.asset_id, f"{obstacle.mass_kg:g}", *map(", ".join, groups)]
    return f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>"


def _outcome_words(outcome: Outcome) -> str:
    if outcome.success and outcome.action != "pick":
        return f"{outcome.action} {outcome.displacement_m:.2f} m"
    return outcome.action


def _svg(episode: Episode) -> str:
    """Return a map, north (y) up: paths through doors, start, goal, obstacles by number."""
    start, goal = (episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y)
    ways = [path.points for path in episode.node_paths[:1]] or [(start, goal)]
    places = [(obstacle.x, obstacle.y) for obstacle in episode.obstacles]
    points = [start, goal, *places, *(point for way in ways for point in way)]
    left = min(x for x, _ in points) - _MARGIN_M
    top = max(y for _, y in points) + _MARGIN_M
    width = (max(x for x, _ in points) + _MARGIN_M - left) * _SCALE
    height = (top - min(y for _, y in points) + _MARGIN_M) * _SCALE

    def at(point: Vec2) -> tuple[float, float]:
        return round((point[0] - left) * _SCALE, 1), round((top - point[1]) * _SCALE, 1)

    parts = [
        f'<polyline points="{" ".join("{},{}".format(*at(p)) for p in way)}" fill="none" '
        'stroke="#2468d6" stroke-width="2" stroke-dasharray="6 5"/>'
        for way in ways
    ]
    parts += [_mark(at(start), "#289454", "start"), _mark(at(goal), "#2468d6", "goal")]
    parts += _numbered([at(place) for place in places], episode)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" width="{width:.0f}" '
        f'height="{height:.0f}" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'style="background:#faf9f6;max-width:100%;height:auto">{"".join(parts)}</svg>'
    )


def _mark(place: Vec2, colour: str, name: str) -> str:
    return (
        f'<circle cx="{place[0]}" cy="{place[1]}" r="9" fill="{colour}"><title>{name}</title>'
        "</circle>"
    )


def _numbered(places: list[Vec2], episode: Episode) -> Iterator[str]:
    for k, ((x, y), obstacle) in enumerate(zip(places, episode.obstacles, strict=True)):
        name = escape(f"{k}: {obstacle.asset_id}")
        yield (
            f'<g><title>{name}</title><circle cx="{x}" cy="{y}" r="11" fill="#ffd326" '
            f'stroke="#302408"/><text x="{x}" y="{y + 4}" text-anchor="middle" '
            f'font-size="12" fill="#302408">{k}</text></g>'
        )
