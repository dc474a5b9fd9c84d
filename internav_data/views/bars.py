"""Bar charts beside a replay: an agent's distributions, step by step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from internav_data.records.errors import UsageError
from internav_data.views.canvas import Canvas

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from internav_data.core.typing import Image
    from internav_data.records import RGB
    from internav_data.views.replay_story import Moment

_PAPER: Final[RGB] = (250, 249, 246)
_INK: Final[RGB] = (40, 42, 50)
_RAIL: Final[RGB] = (228, 226, 220)
_BAR: Final[RGB] = (96, 132, 176)
_CHOSEN: Final[RGB] = (196, 36, 112)
_REFERENCE: Final = 400.0
"""Camera size at which lengths in the code are pixels."""
_WIDTH: Final = 0.5
"""Width of the panel as a share of its height."""


@dataclass(frozen=True, slots=True)
class Bars:
    """A group of bars with a title."""

    title: str
    labels: tuple[str, ...]
    shares: tuple[float, ...]
    """Lengths of the bars, in [0, 1]."""
    chosen: int = -1
    """Index of the bar in the colour of the chosen one, -1 for none."""


def bars_panel(steps: Sequence[Sequence[Bars]], size: int) -> Callable[[Moment], Image]:
    """Return a replay's panel that shows groups of bars for each action.

    Parameters
    ----------
    steps
        Groups of bars of each action, in order: those of action k + 1 stand beside the moment
        after k actions.
    size
        Pixels a side of the replay's camera.

    Returns
    -------
    Function for `Replay.frames(panel=…)`: it returns pictures (size, size / 2, 3) uint8 RGB.

    Raises
    ------
    UsageError
        A group has more or fewer shares than labels.
    """
    for group in (group for groups in steps for group in groups):
        if len(group.labels) != len(group.shares):
            raise UsageError(
                f"bars {group.title!r}: {len(group.labels)} labels, {len(group.shares)} shares"
            )

    def panel(moment: Moment) -> Image:
        groups = steps[min(moment.step, len(steps) - 1)] if steps else ()
        return draw_bars(groups, size)

    return panel


def draw_bars(groups: Sequence[Bars], size: int) -> Image:
    """Draw groups of bars below each other, (size, size / 2, 3) uint8 RGB."""
    unit, width = size / _REFERENCE, 2 * round(_WIDTH * size / 2.0)
    canvas = Canvas((0.0, 0.0), (float(width), float(size)), max(width, size), _PAPER)
    rows = sum(len(group.labels) + 2 for group in groups)
    each = min(22.0 * unit, (size - 12.0 * unit) / max(rows, 1))
    letter = min(0.5 * each, 9.0 * unit)
    y = size - 6.0 * unit - each / 2.0
    for group in groups:
        canvas.text((8.0 * unit, y), group.title, letter, _INK, anchor="left")
        y -= each
        for k, (label, share) in enumerate(zip(group.labels, group.shares, strict=True)):
            colour = _CHOSEN if k == group.chosen else _BAR
            _bar(canvas, (y, each, width), label, share, colour)
            y -= each
        y -= each
    return canvas.finished()


def _bar(
    canvas: Canvas, place: tuple[float, float, int], label: str, share: float, colour: RGB
) -> None:
    y, each, width = place
    left, right = 0.46 * width, 0.96 * width
    tip = left + min(max(share, 0.0), 1.0) * (right - left)
    low, high = y - 0.32 * each, y + 0.32 * each
    letter = min(0.44 * each, 0.042 * width)
    canvas.text((0.04 * width, y), label, letter, _INK, anchor="left")
    canvas.fill([(left, low), (right, low), (right, high), (left, high)], _RAIL)
    if tip > left:
        canvas.fill([(left, low), (tip, low), (tip, high), (left, high)], colour)
