"""Tables and desks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from internav_data.catalog.sampling import BRASS, GLASS, IRON, MIRROR
from internav_data.catalog.shapes import ring

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Paint, Sketch, Span


def drawers(
    s: Sketch, x: Span, front: float, z: Span, rows: int, paint: Paint, *, knob: bool = True
) -> None:
    """Draw drawer fronts one above the other, 1 cm proud of `front`, with handles."""
    step = (z[1] - z[0]) / rows
    gap = min(0.012, 0.12 * step)
    middle, half = (x[0] + x[1]) / 2, min(0.07, 0.2 * (x[1] - x[0]))
    for k in range(rows):
        low, high = z[0] + k * step + gap, z[0] + (k + 1) * step - gap
        s.box((x[0] + gap, x[1] - gap), (front - 0.012, front + 0.01), (low, high), paint)
        if knob:
            cz = (low + high) / 2
            s.box(
                (middle - half, middle + half),
                (front - 0.028, front - 0.01),
                (cz - 0.008, cz + 0.008),
                IRON,
            )


def desk(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a desk: pedestals, trestles, panels, an L for deep ones, a hutch for tall ones."""
    wood = sampler.wood()
    if d > 1.0:
        _corner_desk(s, (w, d, min(h, 0.8)), wood, sampler)
    else:
        top = h if h <= 1.0 else 0.76
        style = sampler.pick(("double", "single", "trestle", "panels"))
        _plain_desk(s, (w, d, top), style, wood, sampler)
    if h > 1.0:
        _hutch(s, (w, d, h), wood)


def _plain_desk(
    s: Sketch, size: tuple[float, float, float], style: str, wood: Paint, sampler: UniformSampler
) -> None:
    w, d, h = size
    x, y, lid = w / 2, d / 2, h - 0.035
    s.box((-x, x), (-y, y), (lid, h), wood.shade(1.06))
    front = -y + 0.03
    side_w = min(0.4, 0.28 * w)
    if style == "trestle":
        metal = sampler.pick((IRON, wood.shade(0.8)))
        for side in (-1, 1):
            cx = side * 0.72 * x
            for sy in (-1, 1):
                s.strut((cx, sy * 0.88 * y, 0), (cx, sy * 0.3 * y, lid), 0.022, metal)
            s.box((cx - 0.03, cx + 0.03), (-0.8 * y, 0.8 * y), (lid - 0.05, lid), metal)
        s.box((-0.72 * x, 0.72 * x), (-0.02, 0.02), (0.55 * h, 0.6 * h), metal)
        return
    s.box((-x + 0.03, x - 0.03), (0.8 * y, 0.8 * y + 0.02), (0.45 * h, lid), wood.shade(0.85))
    closed = {"double": (-1, 1), "single": (sampler.pick((-1, 1)),), "panels": ()}[style]
    for side in (-1, 1):
        outer = side * (x - 0.015)
        if side in closed:
            inner = side * (x - 0.015 - side_w)
            span = (min(outer, inner), max(outer, inner))
            s.box(span, (front, y - 0.02), (0.0, lid), wood)
            drawers(s, span, front, (0.05, lid), 3, wood.shade(1.1))
        elif style == "panels":
            s.box((outer - 0.018, outer + 0.018), (front, y - 0.02), (0, lid), wood)
        else:
            for cy in (front + 0.03, y - 0.05):
                s.box((outer - 0.025, outer + 0.025), (cy - 0.025, cy + 0.025), (0, lid), wood)
    if style == "panels":
        drawers(s, (-0.3 * x, 0.3 * x), front, (lid - 0.11, lid), 1, wood.shade(1.1))
        s.box((-0.3 * x, 0.3 * x), (front, 0.8 * y), (lid - 0.11, lid), wood.shade(0.9))


def _corner_desk(
    s: Sketch, size: tuple[float, float, float], wood: Paint, sampler: UniformSampler
) -> None:
    """Draw an L: one leaf along the back, one towards the front."""
    w, d, h = size
    x, y, side = w / 2, d / 2, sampler.pick((-1, 1))
    leaf = min(0.65, 0.45 * w)
    lid = h - 0.04
    s.box((-x, x), (y - 0.65, y), (lid, h), wood.shade(1.06))
    span = (-x, -x + leaf) if side < 0 else (x - leaf, x)
    s.box(span, (-y, y - 0.65), (lid, h), wood.shade(1.06))
    inner = (span[0] + 0.04, span[1] - 0.04)
    s.box(inner, (-y + 0.03, -y + 0.05), (0, lid), wood)
    s.box(
        (span[0] + 0.02, span[0] + 0.04) if side < 0 else (span[1] - 0.04, span[1] - 0.02),
        (-y + 0.03, y - 0.03),
        (0, lid),
        wood,
    )
    other = (x - 0.42, x - 0.03) if side < 0 else (-x + 0.03, -x + 0.42)
    s.box(other, (y - 0.6, y - 0.03), (0, lid), wood)
    drawers(s, other, y - 0.6, (0.05, lid), 3, wood.shade(1.1))
    s.box((-x + 0.05, x - 0.05), (y - 0.05, y - 0.03), (0.4 * h, lid), wood.shade(0.85))


def _hutch(s: Sketch, size: tuple[float, float, float], wood: Paint) -> None:
    """Draw shelves above a desk, along its back."""
    w, d, h = size
    x, y, top = w / 2, d / 2, 0.76
    depth = min(0.3, 0.45 * d)
    for cx in (-x + 0.015, x - 0.015):
        s.box((cx - 0.015, cx + 0.015), (y - depth, y), (top, h), wood)
    s.box((-x, x), (y - 0.015, y), (top, h), wood.shade(0.85))
    s.box((-x, x), (y - depth, y), (h - 0.03, h), wood.shade(1.05))
    s.box(
        (-x + 0.02, x - 0.02),
        (y - depth, y),
        (top + 0.5 * (h - top), top + 0.5 * (h - top) + 0.02),
        wood.shade(1.02),
    )


def dining_table(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a dining table: four legs, trestle, or round on a pedestal."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    top = wood.shade(1.06)
    compact = max(w, d) < 1.35 * min(w, d)
    if compact and sampler.chance(0.75):
        s.cylinder((-x, x), (-y, y), (h - 0.04, h), top)
        s.cone((0, 0), (0.06, h - 0.04), (0.09, 0.06), wood)
        s.cone((0, 0), (h - 0.1, h - 0.04), (0.07, 0.3 * min(w, d)), wood)
        for dx, dy in ((0.62 * x, 0.045), (0.045, 0.62 * y)):
            s.taper(
                ((-dx, dx), (-dy, dy), 0),
                ((-0.6 * dx, 0.6 * dx), (-0.6 * dy, 0.6 * dy), 0.08),
                wood.shade(0.92),
            )
        return
    glass = sampler.chance(0.12)
    s.box((-x, x), (-y, y), (h - 0.04, h), GLASS if glass else top)
    under = h - 0.04
    style = sampler.pick(("legs", "legs", "trestle", "slabs"))
    if style == "legs":
        leg = sampler.between(0.03, 0.045)
        inset = 0.02
        s.legs((-x + inset, x - inset), (-y + inset, y - inset), (0, under), leg, wood)
        for cy in (-y + 0.06, y - 0.06):
            s.box(
                (-x + 0.06, x - 0.06),
                (cy - 0.012, cy + 0.012),
                (under - 0.09, under),
                wood.shade(0.9),
            )
        for cx in (-x + 0.06, x - 0.06):
            s.box(
                (cx - 0.012, cx + 0.012),
                (-y + 0.06, y - 0.06),
                (under - 0.09, under),
                wood.shade(0.9),
            )
        return
    for side in (-1, 1):
        cx = side * 0.64 * x
        if style == "slabs":
            s.box((cx - 0.03, cx + 0.03), (-0.8 * y, 0.8 * y), (0, under), wood)
        else:
            s.box((cx - 0.045, cx + 0.045), (-0.82 * y, 0.82 * y), (0, 0.08), wood)
            s.box((cx - 0.04, cx + 0.04), (-0.22 * y, 0.22 * y), (0.08, under - 0.05), wood)
            s.box((cx - 0.045, cx + 0.045), (-0.7 * y, 0.7 * y), (under - 0.06, under), wood)
    s.box((-0.64 * x, 0.64 * x), (-0.025, 0.025), (0.26 * h, 0.36 * h), wood.shade(0.9))


def side_table(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a side table: console, night table, round, shelved or a cube."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    compact = max(w, d) < 1.3 * min(w, d)
    if w > 0.95:
        _console(s, (w, d, h), wood, sampler)
    elif compact and sampler.chance(0.5):
        _round_table(s, (w, d, h), wood, sampler)
    else:
        style = sampler.pick(("chest", "shelf", "drawer", "cube"))
        if style == "cube":
            s.box((-x, x), (-y, y), (h - 0.03, h), wood.shade(1.06))
            for side in (-1, 1):
                cx = side * (x - 0.013)
                s.box((cx - 0.012, cx + 0.012), (-y + 0.004, y - 0.004), (0, h - 0.03), wood)
            s.box((-x + 0.01, x - 0.01), (-y + 0.01, y), (0.05, 0.07), wood.shade(0.96))
            s.box((-x + 0.01, x - 0.01), (y - 0.014, y - 0.002), (0.05, h - 0.03), wood.shade(0.8))
            s.box(
                (-x + 0.01, x - 0.01), (-y + 0.01, y), (0.5 * h, 0.5 * h + 0.018), wood.shade(0.96)
            )
            return
        s.box((-x, x), (-y, y), (h - 0.03, h), wood.shade(1.06))
        leg = min(0.022, 0.07 * min(w, d))
        inset_x, inset_y = x - 0.008, y - 0.008
        s.legs((-inset_x, inset_x), (-inset_y, inset_y), (0, h - 0.03), leg, wood)
        front = -y + 0.035
        inner = (-x + 0.02, x - 0.02)
        low = {"chest": 0.22 * h, "shelf": h - 0.08, "drawer": h - 0.2 * min(h, 0.8)}[style]
        s.box(inner, (front, y - 0.02), (low, h - 0.03), wood.shade(0.95))
        if style != "shelf":
            drawers(s, inner, front, (low, h - 0.03), 2 if style == "chest" else 1, wood.shade(1.1))
        if style != "chest":
            s.box(inner, (-y + 0.02, y - 0.02), (0.22 * h, 0.22 * h + 0.02), wood)


def _round_table(
    s: Sketch, size: tuple[float, float, float], wood: Paint, sampler: UniformSampler
) -> None:
    w, d, h = size
    x, y = w / 2, d / 2
    metal = sampler.pick((BRASS, IRON, wood))
    s.cylinder(
        (-x, x), (-y, y), (h - 0.025, h), sampler.pick((wood.shade(1.06), sampler.stone(), GLASS))
    )
    if sampler.chance(0.5):
        s.rod((0, 0), (0.02, h - 0.02), 0.022, metal)
        s.layers(
            (ring(0, 0, 0, 0.72 * x, 0.72 * y, 12), ring(0, 0, 0.02, 0.66 * x, 0.66 * y, 12)), metal
        )
        s.cone((0, 0), (0.018, 0.09), (0.06, 0.022), metal, 8)
        return
    for k in range(4):
        turn = math.radians(45 + 90 * k)
        c, sn = math.cos(turn), math.sin(turn)
        s.strut(
            (0.86 * x * c, 0.86 * y * sn, 0), (0.6 * x * c, 0.6 * y * sn, h - 0.02), 0.014, metal
        )
    s.cylinder((-0.62 * x, 0.62 * x), (-0.62 * y, 0.62 * y), (0.3 * h, 0.3 * h + 0.018), wood)


def _console(
    s: Sketch, size: tuple[float, float, float], wood: Paint, sampler: UniformSampler
) -> None:
    w, d, h = size
    x, y = w / 2, d / 2
    s.box((-x, x), (-y, y), (h - 0.035, h), wood.shade(1.06))
    s.legs((-x + 0.01, x - 0.01), (-y + 0.01, y - 0.01), (0, h - 0.035), 0.02, wood)
    if sampler.chance(0.5):
        front = -y + 0.035
        low = h - 0.16
        s.box((-x + 0.03, x - 0.03), (front, y - 0.02), (low, h - 0.035), wood.shade(0.95))
        for k in range(3):
            left = -x + 0.03 + k * (w - 0.06) / 3
            drawers(s, (left, left + (w - 0.06) / 3), front, (low, h - 0.035), 1, wood.shade(1.1))
    else:
        s.box((-x + 0.02, x - 0.02), (-y + 0.02, y - 0.02), (0.5 * h, 0.5 * h + 0.02), wood)
    s.box((-x + 0.02, x - 0.02), (-y + 0.02, y - 0.02), (0.16 * h, 0.16 * h + 0.02), wood)


def coffee_table(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a low table: oval, with a shelf, or a slab on panels."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    style = sampler.pick(("oval", "shelf", "panels"))
    top = sampler.pick((wood.shade(1.06), wood.shade(1.06), GLASS, sampler.stone()))
    if style == "oval":
        s.cylinder((-x, x), (-y, y), (h - 0.03, h), top)
        for sx in (-1, 1):
            for sy in (-1, 1):
                s.strut(
                    (sx * 0.66 * x, sy * 0.66 * y, 0),
                    (sx * 0.5 * x, sy * 0.5 * y, h - 0.03),
                    0.02,
                    wood,
                )
        return
    s.box((-x, x), (-y, y), (h - 0.04, h), top)
    if style == "panels":
        for side in (-1, 1):
            cx = side * 0.8 * x
            s.box((cx - 0.025, cx + 0.025), (-0.9 * y, 0.9 * y), (0, h - 0.04), wood)
        s.box(
            (-0.8 * x, 0.8 * x), (-0.85 * y, 0.85 * y), (0.3 * h, 0.3 * h + 0.025), wood.shade(0.95)
        )
        return
    s.legs((-x + 0.01, x - 0.01), (-y + 0.01, y - 0.01), (0, h - 0.04), 0.03, wood)
    s.box(
        (-x + 0.03, x - 0.03), (-y + 0.03, y - 0.03), (0.26 * h, 0.26 * h + 0.025), wood.shade(0.95)
    )


def vanity_table(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a dressing table with a mirror."""
    wood, x, y, top = sampler.wood(), w / 2, d / 2, 0.76
    s.box((-x, x), (-y, y), (top - 0.03, top), wood.shade(1.06))
    s.legs((-x + 0.01, x - 0.01), (-y + 0.01, y - 0.01), (0, top - 0.03), 0.02, wood)
    front = -y + 0.03
    s.box((-x + 0.02, x - 0.02), (front, y - 0.02), (top - 0.16, top - 0.03), wood.shade(0.95))
    for side in (-1, 1):
        span = (0.02, x - 0.02) if side > 0 else (-x + 0.02, -0.02)
        drawers(s, span, front, (top - 0.16, top - 0.03), 1, wood.shade(1.1))
    s.box((-0.5 * x, 0.5 * x), (y - 0.03, y), (top, h), wood)
    s.box((-0.45 * x, 0.45 * x), (y - 0.036, y - 0.01), (top + 0.04, h - 0.03), MIRROR)
