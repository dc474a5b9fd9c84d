"""Cupboards, shelves and other wooden furniture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.catalog.designs.tables import drawers
from internav_data.catalog.sampling import BLACK, BRASS, CHROME, IRON, STEEL
from internav_data.catalog.shapes import Paint

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch, Span


def doors(s: Sketch, x: Span, front: float, z: Span, leaves: int, paint: Paint) -> None:
    """Draw door leaves side by side, 1 cm proud of `front`, with handles."""
    wide = (x[1] - x[0]) / leaves
    for k in range(leaves):
        left = x[0] + k * wide
        s.box(
            (left + 0.004, left + wide - 0.004),
            (front - 0.012, front + 0.008),
            (z[0] + 0.004, z[1] - 0.004),
            paint,
        )
        # Neighbouring leaves open apart.
        at = left + wide - 0.05 if k % 2 == 0 else left + 0.05
        middle = z[0] + 0.55 * (z[1] - z[0])
        half = min(0.08, 0.25 * (z[1] - z[0]))
        s.box(
            (at - 0.008, at + 0.008),
            (front - 0.028, front - 0.01),
            (middle - half, middle + half),
            STEEL,
        )


def _carcass(s: Sketch, size: tuple[float, float, float], wood: Paint, foot: float) -> None:
    """Draw a closed body with a lid and feet or a plinth."""
    w, d, h = size
    x, y = w / 2, d / 2
    if foot > 0.07:
        s.legs((-x + 0.02, x - 0.02), (-y + 0.05, y - 0.02), (0, foot), 0.02, wood.shade(0.8))
    else:
        s.box((-x + 0.01, x - 0.01), (-y + 0.06, y), (0, foot), wood.shade(0.7))
    s.box((-x + 0.004, x - 0.004), (-y + 0.03, y), (foot, h - 0.022), wood)
    s.box((-x, x), (-y + 0.008, y), (h - 0.024, h), wood.shade(1.06))


def dresser(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a chest of drawers, one or two columns."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    foot = sampler.pick((0.05, 0.12))
    _carcass(s, (w, d, h), wood, foot)
    columns, rows = (1, 4) if w < 0.95 else (2, 3)
    wide = (w - 0.03) / columns
    for k in range(columns):
        left = -x + 0.015 + k * wide
        drawers(s, (left, left + wide), -y + 0.03, (foot + 0.01, h - 0.03), rows, wood.shade(1.1))


def nightstand(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a bedside table with two drawers."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    foot = sampler.pick((0.05, 0.16))
    _carcass(s, (w, d, h), wood, foot)
    drawers(s, (-x + 0.015, x - 0.015), -y + 0.03, (foot + 0.01, h - 0.03), 2, wood.shade(1.1))


def tv_stand(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a low board with doors at the sides and open shelves between."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    _carcass(s, (w, d, h), wood, sampler.pick((0.05, 0.12)))
    front = -y + 0.03
    third = w / 3
    doors(s, (-x + 0.01, -x + third), front, (0.13, h - 0.03), 1, wood.shade(1.1))
    doors(s, (x - third, x - 0.01), front, (0.13, h - 0.03), 1, wood.shade(1.1))
    middle = (-x + third + 0.01, x - third - 0.01)
    s.box(middle, (front - 0.002, front + 0.01), (0.15, h - 0.05), wood.shade(0.5))
    half = (0.1 + h) / 2
    s.box(middle, (front - 0.012, front), (half - 0.01, half + 0.01), wood)


def _shelves(
    s: Sketch, size: tuple[float, float, float], boards: int, wood: Paint, *, back: bool
) -> list[float]:
    """Draw uprights and boards; return the heights of the boards' tops."""
    w, d, h = size
    x, y, t = w / 2, d / 2, 0.022
    for side in (-1, 1):
        span = (x - t, x) if side > 0 else (-x, -x + t)
        s.box(span, (-y, y), (0, h), wood)
    if back:
        s.box((-x, x), (y - 0.012, y), (0.05, h), wood.shade(0.82))
    tops = []
    for k in range(boards):
        z = 0.06 + k * (h - t - 0.06) / (boards - 1)
        s.box((-x + 0.5 * t, x - 0.5 * t), (-y + 0.002, y - 0.002), (z, z + t), wood.shade(1.04))
        tops.append(z + t)
    return tops


_SPINES = (
    (150, 62, 54),
    (62, 92, 120),
    (196, 168, 110),
    (84, 116, 84),
    (120, 96, 120),
    (212, 206, 194),
)


def _books(s: Sketch, x: Span, y: Span, z: Span, sampler: UniformSampler) -> None:
    """Draw a row of books as one block."""
    colour = Paint(sampler.pick(_SPINES), "paper")
    s.box(x, y, (z[0] - 0.002, z[1]), colour)


def shelving_unit(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw open shelves with a few objects on them."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    boards = 4 if h < 1.5 else 5
    tops = _shelves(s, (w, d, h), boards, wood, back=sampler.chance(0.5))
    gap = (h - 0.08) / (boards - 1)
    for top in tops[:-1]:
        left = -x + 0.03 + sampler.between(0, 0.4) * w
        _books(
            s,
            (left, left + sampler.between(0.2, 0.45) * w),
            (-0.6 * y, 0.6 * y),
            (top, top + sampler.between(0.45, 0.75) * gap),
            sampler,
        )


def bookcase(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a high shelf full of books."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    tops = _shelves(s, (w, d, h), 6, wood, back=True)
    gap = (h - 0.08) / 5
    for top in tops[:-1]:
        split = sampler.between(-0.4, 0.4) * x
        _books(
            s,
            (-x + 0.022, split),
            (-0.7 * y, y - 0.01),
            (top, top + sampler.between(0.6, 0.8) * gap),
            sampler,
        )
        _books(
            s,
            (split + 0.004, x - sampler.between(0.03, 0.5) * x),
            (-0.6 * y, y - 0.01),
            (top, top + sampler.between(0.5, 0.8) * gap),
            sampler,
        )


def wardrobe(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a wardrobe with two or three doors."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    _carcass(s, (w, d, h), wood, 0.06)
    front = -y + 0.03
    low = 0.07
    if sampler.chance(0.4):
        drawers(s, (-x + 0.01, x - 0.01), front, (0.07, 0.42), 1, wood.shade(1.08))
        low = 0.42
    doors(s, (-x + 0.01, x - 0.01), front, (low, h - 0.03), 2 if w < 1.4 else 3, wood.shade(1.1))


def shoe_cabinet(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a slim cabinet with tilting fronts."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    _carcass(s, (w, d, h), wood, 0.05)
    drawers(
        s, (-x + 0.01, x - 0.01), -y + 0.03, (0.06, h - 0.03), 2 if h < 0.9 else 3, wood.shade(1.1)
    )


def filing_cabinet(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a metal cabinet with deep drawers."""
    metal, x, y = sampler.pick((STEEL, IRON, Paint((214, 212, 204), "metal"))), w / 2, d / 2
    _carcass(s, (w, d, h), metal, 0.04)
    drawers(
        s,
        (-x + 0.01, x - 0.01),
        -y + 0.03,
        (0.05, h - 0.03),
        3 if h < 0.9 else 4,
        metal.shade(1.08),
    )


def storage_rack(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a metal rack with boxes on its boards."""
    metal, x, y = sampler.pick((IRON, STEEL)), w / 2, d / 2
    s.legs((-x, x), (-y, y), (0, h), 0.018, metal)
    board = sampler.pick((metal.shade(1.2), Paint((190, 158, 118), "wood")))
    gap = (h - 0.14) / 3
    for k in range(4):
        z = 0.1 + k * gap
        s.box((-x + 0.005, x - 0.005), (-y + 0.005, y - 0.005), (z, z + 0.03), board)
        if k < 3:
            left = -x + 0.04 + sampler.between(0.0, 0.45) * w
            wide = sampler.between(0.28, 0.45) * w
            paint = sampler.pick((Paint((196, 154, 104), "paper"), sampler.plastic()))
            s.box(
                (left, left + wide),
                (-0.7 * y, 0.7 * y),
                (z + 0.03, z + 0.03 + sampler.between(0.4, 0.7) * gap),
                paint,
            )


def coat_rack(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a coat stand: a pole, four feet, pegs around its head."""
    wood, x, y = sampler.pick((sampler.wood(), IRON)), w / 2, d / 2
    s.rod((0, 0), (0.04, h), 0.022, wood)
    s.taper(((-x, x), (-0.02, 0.02), 0), ((-0.1 * x, 0.1 * x), (-0.02, 0.02), 0.12), wood)
    s.taper(((-0.02, 0.02), (-y, y), 0), ((-0.02, 0.02), (-0.1 * y, 0.1 * y), 0.12), wood)
    for z, reach in ((0.93 * h, 0.62), (0.84 * h, 0.5)):
        for sx, sy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            s.strut((0, 0, z - 0.06), (sx * reach * x, sy * reach * y, z), 0.012, wood.shade(0.9))


def piano(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an upright piano."""
    wood = sampler.pick(
        (Paint((36, 34, 36), "wood"), Paint((96, 56, 38), "wood"), Paint((60, 40, 32), "wood"))
    )
    x, y = w / 2, d / 2
    case = -y + 0.45 * d
    for side in (-1, 1):
        span = (x - 0.05, x) if side > 0 else (-x, -x + 0.05)
        s.box(span, (case - 0.04, y), (0, h), wood)
        s.box(span, (-y, case), (0.58, 0.78), wood)
        s.box((span[0] + 0.005, span[1] - 0.005), (-y + 0.02, -y + 0.09), (0, 0.6), wood.shade(1.1))
    s.box((-x, x), (case, y), (0.04, h - 0.03), wood.shade(1.12))
    s.box((-x, x), (case - 0.05, y), (h - 0.03, h), wood)
    s.box((-x + 0.03, x - 0.03), (-y + 0.01, case), (0.6, 0.68), wood.shade(1.15))
    s.box(
        (-x + 0.06, x - 0.06),
        (-y + 0.03, case - 0.08),
        (0.68, 0.702),
        Paint((244, 242, 234), "plastic"),
    )
    s.box((-x + 0.08, x - 0.1), (-y + 0.1, case - 0.08), (0.7, 0.712), BLACK)
    s.slab(
        (-0.6 * x, 0.6 * x),
        (case - 0.04, case - 0.02),
        (case - 0.015, case + 0.005),
        (0.82, 1.02),
        wood.shade(1.3),
    )
    for cx in (-0.06, 0.06):
        s.box((cx - 0.02, cx + 0.02), (case - 0.1, case), (0.06, 0.08), BRASS)


def safe(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a strongbox: door, dial and handle."""
    metal, x, y = sampler.pick((IRON, IRON.shade(1.5), Paint((92, 102, 96), "metal"))), w / 2, d / 2
    front = -y + 0.035
    s.box((-x, x), (front, y), (0, h), metal)
    s.box((-x + 0.03, x - 0.03), (front - 0.012, front), (0.03, h - 0.03), metal.shade(1.2))
    s.cylinder(
        (-0.1 * w, 0.1 * w), (-y, front), (0.55 * h - 0.1 * w, 0.55 * h + 0.1 * w), CHROME, "y"
    )
    s.box((0.4 * x, 0.62 * x), (-y + 0.002, front), (0.42 * h, 0.66 * h), CHROME)
    for z in (0.2, 0.74):
        s.box(
            (-x - 0.004, -x + 0.03),
            (front - 0.016, front + 0.02),
            (z * h, (z + 0.08) * h),
            metal.shade(0.8),
        )


def crate(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an open wooden crate of slats."""
    wood, x, y, t = sampler.wood(), w / 2, d / 2, 0.014
    s.box((-x + t, x - t), (-y + t, y - t), (0, t), wood.shade(0.85))
    for cx in (-x, x - t):
        for low, high in ((0.0, 0.45), (0.55, 1.0)):
            s.box((cx, cx + t), (-y + t, y - t), (low * h, high * h), wood.shade(0.95))
    for cy in (-y, y - t):
        for low, high in ((0.0, 0.45), (0.55, 1.0)):
            s.box((-x, x), (cy, cy + t), (low * h, high * h), wood)
    s.legs((-x + t, x - t), (-y + t, y - t), (0, h), 0.012, wood.shade(0.8))
