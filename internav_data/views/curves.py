"""Line charts as SVG over a common axis, without any library."""

from __future__ import annotations

import html
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

COLOURS: Final = ("#1f6fb4", "#c4246f", "#2c9a5c", "#d98a00", "#6a4fb0", "#7a6a55")
_WIDTH, _HEIGHT = 460, 250
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 12, 28, 38
_TICKS: Final = 5
_MAX_POINTS: Final = 400
"""Maximum number of points of a drawn curve; longer ones are thinned."""


@dataclass(frozen=True, slots=True)
class Curve:
    """Named line of points (x, y); points that are not finite are left out."""

    name: str
    points: tuple[tuple[float, float], ...]


def curves_svg(title: str, x_name: str, curves: Sequence[Curve]) -> str:
    """Return an SVG picture of some curves, empty if no point is finite."""
    kept = [Curve(curve.name, _thinned(curve.points)) for curve in curves]
    points = [point for curve in kept for point in curve.points]
    if not points:
        return ""
    xs, ys = _ticks([p[0] for p in points]), _ticks([p[1] for p in points])

    def place(x: float, y: float) -> tuple[float, float]:
        right = _LEFT + (x - xs[0]) / (xs[-1] - xs[0]) * (_WIDTH - _LEFT - _RIGHT)
        down = _HEIGHT - _BOTTOM - (y - ys[0]) / (ys[-1] - ys[0]) * (_HEIGHT - _TOP - _BOTTOM)
        return round(right, 1), round(down, 1)

    parts = [
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" class="curve">',
        f'<text x="{_LEFT}" y="16" class="title">{html.escape(title)}</text>',
    ]
    for y in ys:
        _, down = place(xs[0], y)
        parts.append(f'<path d="M{_LEFT} {down}H{_WIDTH - _RIGHT}" class="grid"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{down + 4}" class="left">{_number(y)}</text>')
    for x in xs:
        right, _ = place(x, ys[0])
        parts.append(f'<text x="{right}" y="{_HEIGHT - 20}" class="below">{_number(x)}</text>')
    middle = (_LEFT + _WIDTH - _RIGHT) / 2
    parts.append(f'<text x="{middle}" y="{_HEIGHT - 5}" class="below">{html.escape(x_name)}</text>')
    for k, curve in enumerate(kept):
        colour = COLOURS[k % len(COLOURS)]
        line = " ".join(f"{a},{b}" for a, b in (place(x, y) for x, y in curve.points))
        parts.append(
            f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.8"/>'
        )
        if len(kept) > 1:
            x = _WIDTH - _RIGHT - 4
            name = html.escape(curve.name)
            parts.append(
                f'<text x="{x}" y="{_TOP + 12 + 14 * k}" class="name" fill="{colour}">{name}</text>'
            )
    return "".join([*parts, "</svg>"])


def _thinned(points: Sequence[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    finite = [(x, y) for x, y in points if math.isfinite(x) and math.isfinite(y)]
    every = -(-len(finite) // _MAX_POINTS)
    return tuple(finite[::every]) if every > 1 else tuple(finite)


def _ticks(values: Sequence[float]) -> list[float]:
    """Return round numbers around values: about `_TICKS`, the first and last outside of them."""
    low, high = min(values), max(values)
    if high - low < 1e-12 * max(1.0, abs(low)):
        low, high = low - 0.5, high + 0.5
    rough = (high - low) / (_TICKS - 1)
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * k for k in (1.0, 2.0, 2.5, 5.0, 10.0) if power * k >= rough * 0.999)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    return [k * step for k in range(first, last + 1)]


def _number(value: float) -> str:
    if abs(value) >= 1e6:
        return f"{value / 1e6:g} M"
    return f"{value / 1e3:g} k" if abs(value) >= 1e4 else f"{value:.4g}"
