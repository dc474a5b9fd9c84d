"""Seats: chairs, armchairs, sofas, stools, benches, ottomans, office chairs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from internav_data.catalog.sampling import BLACK, CHROME, IRON, STEEL
from internav_data.catalog.shapes import ring
from internav_data.core.arithmetic import plain_sum

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Paint, Sketch, Span


def chair(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a dining chair: legs, seat and back."""
    seat = min(0.46, 0.56 * h)
    shallow = d < 0.6  # a moulded seat that deep would be a lounger
    style = sampler.pick(("slats", "spindles", "panel", "padded", *(("shell",) if shallow else ())))
    if style == "shell":
        _shell_chair(s, w, d, h, sampler)
        return
    wood, x, y = sampler.wood(), w / 2, d / 2
    thick = 0.05 * w + 0.012
    lean = 0.1 * d
    front, back = -y, y - lean
    s.legs((-x, x), (front, back), (0, seat - 0.03), thick / 2, wood)
    seat_paint = (
        sampler.cover()
        if style == "padded"
        else (sampler.fabric() if sampler.chance(0.3) else wood)
    )
    s.cushion((-x, x), (front, back), (seat - 0.035, seat + 0.015), seat_paint, 0.3)
    span = (back, y)
    if style == "padded":
        _padded_back(s, x, span, (seat, h), thick, (wood, seat_paint))
    else:
        _open_back(s, x, span, (seat, h), thick, style, wood)


def _padded_back(
    s: Sketch, x: float, span: Span, z: Span, thick: float, paints: tuple[Paint, Paint]
) -> None:
    """Draw a leaning board with a pad; `span` is its y at the seat and at the top."""
    wood, cover = paints
    back, y = span
    s.slab((-x, x), (back - thick, back), (y - thick, y), z, wood)
    s.slab(
        (-0.86 * x, 0.86 * x),
        (back - 1.7 * thick, back),
        (y - 1.7 * thick, y),
        (z[0] + 0.08, z[1] - 0.04),
        cover,
    )


def _open_back(
    s: Sketch, x: float, span: Span, z: Span, thick: float, style: str, wood: Paint
) -> None:
    """Draw two leaning posts with slats, a panel or spindles between them.

    `span` is the back's y at the seat and at the top, `z` the two heights.
    """
    back, y = span
    seat, h = z
    behind = (back - thick, back), (y - thick, y)
    for side in (-1, 1):
        post = (side * x - (thick if side > 0 else 0), side * x + (0 if side > 0 else thick))
        s.slab(post, *behind, (seat, h), wood)

    def rail(low: float, high: float) -> None:
        a, b = ((z - seat) / (h - seat) * (y - back) + back for z in (low, high))
        spans = ((a - 0.8 * thick, a - 0.2 * thick), (b - 0.8 * thick, b - 0.2 * thick))
        s.slab((-x, x), *spans, (low, high), wood.shade(0.94))

    rise = h - seat
    if style == "slats":
        for share in (0.28, 0.54, 0.8):
            rail(seat + share * rise, seat + (share + 0.14) * rise)
        return
    rail(h - 0.2 * rise, h - 0.01)
    if style == "panel":
        rail(seat + 0.12 * rise, h - 0.28 * rise)
        return
    for k in range(4):
        cx = (-0.54 + 0.36 * k) * x * 1.0
        s.slab(
            (cx - 0.2 * thick, cx + 0.2 * thick),
            (back - 0.7 * thick, back - 0.3 * thick),
            (y - 0.7 * thick, y - 0.3 * thick),
            (seat, h - 0.1 * rise),
            wood,
        )


def _shell_chair(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a moulded seat on splayed legs."""
    seat, x, y = min(0.46, 0.56 * h), w / 2, d / 2
    shell, leg = sampler.plastic(), sampler.pick((sampler.wood(), CHROME, IRON))
    for sx in (-1, 1):
        for sy in (-1, 1):
            s.strut(
                (sx * 0.86 * x, sy * 0.8 * y, 0),
                (sx * 0.55 * x, sy * 0.5 * y, seat - 0.02),
                0.018,
                leg,
            )
    s.cushion((-0.96 * x, 0.96 * x), (-y, 0.8 * y), (seat - 0.03, seat + 0.02), shell, 0.4)
    middle = seat + 0.55 * (h - seat)
    s.slab((-0.8 * x, 0.8 * x), (0.6 * y, 0.74 * y), (0.82 * y, 0.93 * y), (seat, middle), shell)
    s.taper(
        ((-x, x), (0.8 * y, 0.93 * y), middle - 0.01), ((-0.7 * x, 0.7 * x), (0.9 * y, y), h), shell
    )


def arm_chair(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an armchair: club, wing or with a wooden frame."""
    style = sampler.pick(("club", "wing", "frame", "club"))
    cloth, wood = sampler.cover(), sampler.wood()
    if style == "frame":
        _framed(s, (w, d, h), cloth, wood)
        return
    seats = 1 if w < 1.2 else 2
    _upholstered(s, (w, d, h), seats, cloth, wood, sampler)
    if style == "wing":
        x, y = w / 2, d / 2
        for side in (-1, 1):
            outer, inner = side * x, side * (x - 0.09 * w)
            s.slab(
                (min(outer, inner), max(outer, inner)),
                (-0.05 * y, 0.9 * y),
                (0.5 * y, y),
                (0.5 * h, 0.96 * h),
                cloth.shade(0.97),
            )


def _framed(s: Sketch, size: tuple[float, float, float], cloth: Paint, wood: Paint) -> None:
    """Draw a lounge chair: cushions in an open wooden frame."""
    w, d, h = size
    x, y, bar = w / 2, d / 2, 0.045 * w + 0.01
    arm, seat = 0.64 * h, 0.42 * h
    for side in (-1, 1):
        span = (side * x - (bar if side > 0 else 0), side * x + (0 if side > 0 else bar))
        s.box(span, (-y, -y + bar), (0, arm), wood)
        s.box(span, (0.62 * y, 0.62 * y + bar), (0, arm), wood)
        s.box(span, (-y, 0.78 * y), (arm, arm + 0.6 * bar), wood)
        s.box(span, (-y, 0.62 * y), (seat - 0.17 * h, seat - 0.1 * h), wood)
    inner = (-x + 1.1 * bar, x - 1.1 * bar)
    s.box((-x, x), (-0.86 * y, 0.64 * y), (seat - 0.15 * h, seat - 0.1 * h), wood.shade(0.9))
    s.cushion(inner, (-0.98 * y, 0.62 * y), (seat - 0.1 * h, seat + 0.07 * h), cloth, 0.3)
    s.slab(inner, (0.44 * y, 0.68 * y), (0.76 * y, y), (seat, h), cloth.shade(1.05))


def sofa(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a sofa; a deep one has a chaise on one side."""
    cloth, wood = sampler.cover(), sampler.wood()
    seats = 2 if w < 1.95 else 3
    if d <= 1.2:
        _upholstered(s, (w, d, h), seats, cloth, wood, sampler)
        return
    deep = 0.95
    side = sampler.pick((-1, 1))
    _upholstered(s, (w, deep, h), seats, cloth, wood, sampler, d / 2 - deep / 2)
    x, width = w / 2, 0.34 * w
    span = (-x, -x + width) if side < 0 else (x - width, x)
    front = d / 2 - deep
    s.box(span, (-d / 2, front + 0.1), (0.1 * h, 0.34 * h), cloth.shade(0.92))
    s.cushion(
        (span[0] + 0.02, span[1] - 0.02), (-d / 2, front + 0.12), (0.34 * h, 0.48 * h), cloth, 0.3
    )
    for cx in span:
        inset = 0.07 if cx < plain_sum(span) / 2 else -0.07
        s.rod((cx + inset, -d / 2 + 0.07), (0, 0.1 * h), 0.025, wood)


def _upholstered(
    s: Sketch,
    size: tuple[float, float, float],
    seats: int,
    cloth: Paint,
    wood: Paint,
    sampler: UniformSampler,
    shift: float = 0.0,
) -> None:
    """Draw base, legs, arms, back, and a seat and a back cushion for each place."""
    w, d, h = size
    x, front, back = w / 2, shift - d / 2, shift + d / 2
    arm_w = (
        min(0.24, sampler.between(0.11, 0.17) * w) if seats == 1 else sampler.between(0.13, 0.24)
    )
    foot, base, seat, arm = 0.09 * h, 0.34 * h, 0.5 * h, sampler.between(0.62, 0.72) * h
    rest = 0.2 * d
    s.legs((-x + 0.03, x - 0.03), (front + 0.04, back - 0.04), (0, foot), 0.026, wood, round_=True)
    s.box((-x + 0.02, x - 0.02), (front + 0.02, back), (foot, base), cloth.shade(0.9))
    rolled = sampler.chance(0.35)
    for side in (-1, 1):
        span = (x - arm_w, x) if side > 0 else (-x, -x + arm_w)
        if rolled:
            s.box(span, (front + 0.01, back), (foot, arm - 0.35 * arm_w), cloth)
            s.cylinder(span, (front, back), (arm - 0.9 * arm_w, arm), cloth.shade(0.97), "y")
        else:
            s.cushion(span, (front, back), (foot, arm), cloth, 0.2)
    s.slab(
        (-x + 0.5 * arm_w, x - 0.5 * arm_w),
        (back - rest, back - 0.02),
        (back - 0.55 * rest, back),
        (base, h),
        cloth.shade(0.94),
    )
    wide = (w - 2 * arm_w) / seats
    for k in range(seats):
        left = -x + arm_w + k * wide
        span = (left + 0.004, left + wide - 0.004)
        s.cushion(span, (front, back - 0.7 * rest), (base, seat), cloth.shade(1.05), 0.28)
        s.taper(
            (span, (back - 1.75 * rest, back - 0.7 * rest), seat),
            ((span[0] + 0.02, span[1] - 0.02), (back - 1.1 * rest, back - 0.5 * rest), 0.95 * h),
            cloth.shade(1.02),
        )


def stool(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a stool: a round, square or padded seat on four legs with a foot rail."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    legs = sampler.pick((wood, IRON, CHROME))
    seat = sampler.pick((wood, sampler.cover()))
    for sx in (-1, 1):
        for sy in (-1, 1):
            s.strut(
                (sx * (x - 0.018), sy * (y - 0.018), 0),
                (sx * 0.55 * x, sy * 0.55 * y, h - 0.03),
                0.018,
                legs,
            )
    low = 0.32 * h
    reach_x, reach_y = 0.85 * x - 0.018, 0.85 * y - 0.018
    for side in (-1, 1):
        s.box(
            (-reach_x, reach_x),
            (side * reach_y - 0.01, side * reach_y + 0.01),
            (low, low + 0.025),
            legs,
        )
        s.box(
            (side * reach_x - 0.01, side * reach_x + 0.01),
            (-reach_y, reach_y),
            (low + 0.03, low + 0.055),
            legs,
        )
    if sampler.chance(0.5):
        s.cylinder((-0.92 * x, 0.92 * x), (-0.92 * y, 0.92 * y), (h - 0.045, h), seat)
    else:
        s.cushion((-0.94 * x, 0.94 * x), (-0.94 * y, 0.94 * y), (h - 0.06, h), seat, 0.4)


def ottoman(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an upholstered block on short legs, or a round pouf."""
    cloth, x, y = sampler.cover(), w / 2, d / 2
    if w < 1.25 * d:
        low, high = ring(0, 0, 0, 0.86 * x, 0.86 * y, 10), ring(0, 0, h, 0.8 * x, 0.8 * y, 10)
        s.layers((low, ring(0, 0, 0.55 * h, x, y, 12), high), cloth)
        s.cylinder(
            (-0.3 * x, 0.3 * x), (-0.3 * y, 0.3 * y), (h - 0.02, h + 0.004), cloth.shade(0.85)
        )
        return
    s.legs((-0.94 * x, 0.94 * x), (-0.9 * y, 0.9 * y), (0, 0.2 * h), 0.022, sampler.wood())
    s.box((-x, x), (-y, y), (0.2 * h, 0.66 * h), cloth.shade(0.92))
    s.cushion((-x, x), (-y, y), (0.66 * h, h), cloth, 0.3)


def office_chair(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a swivel chair on a five-pointed base."""
    x, y, cloth = w / 2, d / 2, sampler.cover()
    seat = 0.47 * h
    for k in range(5):
        turn = math.radians(90 + 72 * k)
        c, sn = math.cos(turn), math.sin(turn)
        across = (-0.03 * sn, 0.03 * c)
        corners = [
            (c * r * x + sign * across[0], sn * r * y + sign * across[1], z)
            for r, z in ((0.05, 0.07), (0.05, 0.12), (0.96, 0.0), (0.96, 0.06))
            for sign in (-1, 1)
        ]
        s.hull(corners, BLACK)
    s.rod((0, 0), (0.1, seat - 0.05), 0.03, STEEL)
    s.cushion((-0.78 * x, 0.78 * x), (-0.8 * y, 0.7 * y), (seat - 0.06, seat + 0.03), cloth, 0.35)
    s.slab(
        (-0.1 * x, 0.1 * x),
        (0.66 * y, 0.76 * y),
        (0.82 * y, 0.9 * y),
        (seat - 0.03, 0.7 * h),
        BLACK,
    )
    s.slab(
        (-0.72 * x, 0.72 * x), (0.58 * y, 0.76 * y), (0.78 * y, 0.92 * y), (seat + 0.12, h), cloth
    )
    for side in (-1, 1):
        outer = (side * 0.9 * x - 0.025, side * 0.9 * x + 0.025)
        s.box(outer, (-0.05 * y, 0.05 * y), (seat - 0.04, seat + 0.2), BLACK)
        s.box(outer, (-0.4 * y, 0.5 * y), (seat + 0.2, seat + 0.23), BLACK)
    s.box((-0.9 * x, 0.9 * x), (-0.05 * y, 0.05 * y), (seat - 0.08, seat - 0.04), BLACK)


def bench(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a bench: slab sides or legs, sometimes a cushion on top."""
    wood, x, y = sampler.wood(), w / 2, d / 2
    if sampler.chance(0.5):
        for side in (-1, 1):
            cx = side * 0.82 * x
            s.box((cx - 0.025, cx + 0.025), (-0.9 * y, 0.9 * y), (0, h - 0.08), wood.shade(0.92))
        s.box((-0.82 * x, 0.82 * x), (-0.02, 0.02), (0.3 * h, 0.5 * h), wood.shade(0.88))
    else:
        s.legs((-0.96 * x, 0.96 * x), (-0.92 * y, 0.92 * y), (0, h - 0.08), 0.025, wood)
    if sampler.chance(0.5):
        s.box((-x, x), (-y, y), (h - 0.1, h - 0.06), wood)
        s.cushion(
            (-0.98 * x, 0.98 * x), (-0.96 * y, 0.96 * y), (h - 0.06, h), sampler.fabric(), 0.3
        )
    else:
        s.box((-x, x), (-y, y), (h - 0.08, h - 0.03), wood)
        s.box((-x, x), (-y, y), (h - 0.035, h), wood.shade(1.06))
