"""The words of a replay: a header, a title card, and below what was done and how it went."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from internav_data.views.canvas import Canvas
from internav_data.views.replay_map import AGENT
from internav_data.views.replay_story import PUSHES
from internav_data.views.silhouettes import shaded
from internav_data.views.tasks import COLOURS, GOAL, NAMES, START, obstacle_kind
from internav_data.world import Action

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from internav_data.records import RGB
    from internav_data.views.replay_shots import Shot
    from internav_data.views.replay_story import Story
    from internav_data.world import StepResult

    Image = NDArray[np.uint8]

_PAPER: Final[RGB] = (250, 249, 246)
_INK: Final[RGB] = (40, 42, 50)
_FAINT: Final[RGB] = (104, 106, 114)
_BAD: Final[RGB] = (200, 36, 24)
_GOOD: Final[RGB] = (24, 128, 66)
_MOODS: Final = {"plain": _INK, "good": _GOOD, "bad": _BAD}
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
    """Return a letter height at most `height_px` at which a text fits."""
    return min(height_px, height_px * room / max(canvas.text_width(text, height_px), 1.0))


def _colour(result: StepResult) -> RGB:
    if result.action in PUSHES:
        return _PUSH
    if result.action in {Action.PICKUP, Action.DROP}:
        return _PICK
    if result.action == Action.MOVE_AHEAD:
        return _MOVE
    return {Action.DONE: GOAL, Action.WAIT: _WAIT}.get(result.action, _TURN)


class Header:
    """Which episode this is, and how far it has come."""

    def __init__(self, story: Story, width: int, size: int) -> None:
        self._unit = size / _REFERENCE
        self._width, self.height = width, 2 * round(15 * self._unit)
        episode = story.episode
        rooms = "1 room" if episode.room_count == 1 else f"{episode.room_count} rooms"
        self._text = f"{episode.episode_id}   {episode.mode}   {rooms}"

    def draw(self, shot: Shot) -> Image:
        """Return the strip, (height, width, 3)."""
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
    """What was done, how far the goal is, what is held; and all actions as a row of colours."""

    def __init__(self, story: Story, width: int, size: int) -> None:
        self._story, self._unit = story, size / _REFERENCE
        self._width, self.height = width, 2 * round(38 * self._unit)

    def draw(self, shot: Shot) -> Image:
        """Return the strip, (height, width, 3)."""
        canvas, unit = _strip(self._width, self.height), self._unit
        left, room = 8.0 * unit, self._width - 16.0 * unit
        height = _fitting(canvas, shot.text, 13.0 * unit, room)
        y = self.height - 20.0 * unit
        canvas.text((left, y), shot.text, height, _MOODS[shot.mood], anchor="left")
        steps = "blocked: no way to the goal" if shot.steps is None else f"{shot.steps} steps"
        if shot.steps is not None:
            steps = f"to the goal: {steps}"
        parts = [steps]
        held = [k for k, pose in shot.poses.items() if pose is None]
        parts += [f"in hand: {self._story.name(k)}" for k in held]
        colour = _BAD if shot.steps is None else _FAINT
        canvas.text((left, y - 24.0 * unit), "   ".join(parts), 9.5 * unit, colour, anchor="left")
        self._paint_actions(canvas, shot.moment.step)
        return canvas.finished()

    def _paint_actions(self, canvas: Canvas, step: int) -> None:
        """Paint a cell for each action, pale while it is to come; failures are notched in red."""
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
                bad = _BAD if k < step else (236, 170, 164)
                canvas.fill([(x0, top), (x1, top), (x1, high), (x0, high)], bad)
        if 0 < step <= len(results):
            x0, x1 = left + (step - 1) * each, left + step * each - gap
            box = [(x0, low - 2.0), (x1, low - 2.0), (x1, high + 2.0), (x0, high + 2.0)]
            canvas.line(box, _INK, 1.6, closed=True)


def title_card(story: Story, title: str, size: int) -> Image:
    """Return what stands in the camera's place at the beginning, (size, size, 3)."""
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
                canvas.text((x + 8.0 * unit, y), str(number), 7.5 * unit, _INK)
            x += 26.0 * unit
        height = _fitting(canvas, text, min(0.44 * each, 10.5) * unit, size - x - 12.0 * unit)
        canvas.text((x, y), text, height, _INK, anchor="left")
        y -= each * unit
    return canvas.finished()


def _title_rows(story: Story, title: str) -> list[tuple[RGB | None, int, str]]:
    """Colour of a mark, number in it, text."""
    episode = story.episode
    rooms = "1 room" if episode.room_count == 1 else f"{episode.room_count} rooms"
    way = "cut off" if episode.steps is None else f"{episode.steps} steps"
    said = "blocked: something must be moved" if episode.interactive else "lengthened: a detour"
    rows: list[tuple[RGB | None, int, str]] = [
        (None, 0, f"{episode.episode_id}, {rooms}"),
        (None, 0, said),
        (None, 0, f"goal: {way}, without obstacles {episode.clear_steps} steps"),
        (None, 0, _summary(story, title)),
        (START, 0, "start"),
        (GOAL, 0, "goal"),
        (AGENT, 0, "agent, its way, its view as far as it reaches"),
    ]
    for k, obstacle in enumerate(episode.obstacles, 1):
        kind = obstacle_kind(obstacle)
        text = f"{obstacle.type}, {obstacle.mass_kg:.1f} kg, {NAMES[kind]}"
        rows.append((COLOURS[kind], k, text))
    return rows


def _summary(story: Story, title: str) -> str:
    results = story.results
    pushes = sum(r.action in PUSHES for r in results)
    picks = sum(r.action == Action.PICKUP for r in results)
    parts = [f"{len(results)} action{'' if len(results) == 1 else 's'}"]
    parts += [f"{pushes} push{'' if pushes == 1 else 'es'}"] if pushes else []
    parts += [f"{picks} pick{'' if picks == 1 else 's'}"] if picks else []
    return f"{title}: {', '.join(parts)}"
