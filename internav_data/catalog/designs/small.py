"""Small household objects: boxes, clocks, laptops, pots, bins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.catalog.sampling import BLACK, BRASS, IRON, LINEN, PAPER, SCREEN, STEEL, WHITE
from internav_data.catalog.shapes import Paint, ring

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch
    from internav_data.records import Vec2

_CARDBOARD = (
    Paint((198, 156, 106), "paper"),
    Paint((178, 136, 90), "paper"),
    Paint((212, 176, 128), "paper"),
    Paint((226, 220, 208), "paper"),
)


def box(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a cardboard box: taped shut, or open with its flaps out."""
    card, x, y = sampler.pick(_CARDBOARD), w / 2, d / 2
    if sampler.chance(0.5):
        s.box((-x, x), (-y, y), (0, h - 0.002), card)
        s.box((-0.06 * w, 0.06 * w), (-y - 0.001, y + 0.001), (0.72 * h, h), card.shade(0.82))
        s.box((0.35 * x, 0.85 * x), (-y - 0.001, -y + 0.01), (0.2 * h, 0.46 * h), PAPER)
        return
    flap = 0.2 * min(w, d)
    bx, by, wall, rim = x - 0.75 * flap, y - 0.75 * flap, 0.006, 0.86 * h
    s.box((-bx, bx), (-by, by), (0, 0.008), card.shade(0.8))
    for side in (-1, 1):
        s.box(_span(side * bx, side * (bx - wall)), (-by, by), (0, rim), card.shade(0.94))
        s.box((-bx, bx), _span(side * by, side * (by - wall)), (0, rim), card)
        tip_x, tip_y = side * x, side * y
        s.taper(
            (_span(side * bx, side * (bx - wall)), (-by, by), rim),
            (_span(tip_x, tip_x - side * wall), (-0.96 * by, 0.96 * by), h),
            card.shade(1.08),
        )
        s.taper(
            ((-bx, bx), _span(side * by, side * (by - wall)), rim),
            ((-0.96 * bx, 0.96 * bx), _span(tip_y, tip_y - side * wall), h),
            card.shade(1.08),
        )


def _span(a: float, b: float) -> tuple[float, float]:
    return (a, b) if a < b else (b, a)


def alarm_clock(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an alarm clock: twin bells, digital, or a round face on a block."""
    paint, half = sampler.plastic(), (w / 2, d / 2)
    style = "digital" if w > 1.25 * h else sampler.pick(("bells", "bells", "block"))
    if style == "digital":
        _digital_clock(s, half, h, paint)
        return
    _dial(s, half, h, style, paint)
    if style == "bells":
        _bells(s, half, h, sampler)


def _digital_clock(s: Sketch, half: Vec2, h: float, paint: Paint) -> None:
    """Draw a wedge with four glowing digits on its leaning front."""
    x, y = half
    s.taper(((-x, x), (-y, y), 0), ((-0.97 * x, 0.97 * x), (-0.3 * y, 0.9 * y), h * 0.94), paint)
    shift = 0.7 * y / (0.94 * h)
    low, high = 0.2 * h, 0.8 * h
    s.slab(
        (-0.84 * x, 0.84 * x),
        (-y + low * shift - 0.003, -y + low * shift + 0.008),
        (-y + high * shift - 0.003, -y + high * shift + 0.008),
        (low, high),
        SCREEN,
    )
    for k in range(4):
        cx = (-0.55 + 0.36 * k + (0.04 if k > 1 else 0)) * x
        a, b = 0.34 * h, 0.66 * h
        s.slab(
            (cx - 0.1 * x, cx + 0.1 * x),
            (-y + a * shift - 0.005, -y + a * shift + 0.004),
            (-y + b * shift - 0.005, -y + b * shift + 0.004),
            (a, b),
            Paint((236, 92, 70), "screen"),
        )
    s.box((-0.4 * x, 0.4 * x), (0.1 * y, 0.6 * y), (0.93 * h, h), paint.shade(0.8))


def _dial(s: Sketch, half: Vec2, h: float, style: str, paint: Paint) -> None:
    """Draw a round clock with its hands: on a block, or on two feet under bells."""
    x, y = half
    foot, top = 0.1 * h, (0.78 if style == "bells" else 1.0) * h
    if style == "block":
        s.box((-x, x), (-y, y), (0, foot), paint.shade(0.8))
    else:
        for side in (-1, 1):
            cx = side * 0.5 * x
            s.box((cx - 0.12 * x, cx + 0.12 * x), (-0.9 * y, 0.9 * y), (0, 0.2 * h), STEEL)
    face = (foot - 0.02 * h, top)
    s.cylinder((-x, x), (-0.9 * y, 0.92 * y), face, paint, "y")
    middle, radius = (face[0] + face[1]) / 2, (face[1] - face[0]) / 2
    s.cylinder(
        (-0.84 * x, 0.84 * x),
        (-0.96 * y, 0),
        (middle - 0.84 * radius, middle + 0.84 * radius),
        PAPER,
        "y",
    )
    s.box((-0.035 * x, 0.035 * x), (-y, -0.5 * y), (middle, middle + 0.62 * radius), BLACK)
    s.slab(
        (-0.03 * x, 0.5 * x),
        (-y, -0.5 * y),
        (-y, -0.5 * y),
        (middle - 0.05 * radius, middle + 0.05 * radius),
        BLACK,
    )


def _bells(s: Sketch, half: Vec2, h: float, sampler: UniformSampler) -> None:
    """Draw two bells and the hammer over them."""
    x, y = half
    for side in (-1, 1):
        cx = side * 0.55 * x
        s.ball(
            (cx - 0.4 * x, cx + 0.4 * x),
            (-0.6 * y, 0.6 * y),
            (0.66 * h, 0.95 * h),
            sampler.pick((BRASS, STEEL)),
        )
    s.box((-0.5 * x, 0.5 * x), (-0.12 * y, 0.12 * y), (0.95 * h, h), STEEL)


def laptop(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an open laptop: base, keys, touch pad, screen."""
    case = sampler.pick(
        (
            Paint((184, 188, 192), "metal"),
            Paint((62, 64, 68), "metal"),
            Paint((206, 192, 176), "metal"),
            Paint((92, 98, 110), "metal"),
            WHITE,
        )
    )
    x, y = w / 2, d / 2
    thick = 0.018
    back = 0.72 * y
    s.box((-x, x), (-y, back + 0.01), (0, thick), case)
    s.box((-0.88 * x, 0.88 * x), (-0.28 * y, 0.56 * y), (thick - 0.004, thick + 0.002), BLACK)
    s.box(
        (-0.26 * x, 0.26 * x),
        (-0.88 * y, -0.4 * y),
        (thick - 0.004, thick + 0.0012),
        case.shade(0.85),
    )
    top = (y - 0.012, y)
    foot = (back, back + 0.012)
    s.slab((-x, x), foot, top, (0.6 * thick, h), case.shade(0.96))

    def face(z: float) -> float:
        return foot[0] + (z - 0.6 * thick) / (h - 0.6 * thick) * (top[0] - foot[0])

    for inset, proud, paint in (
        (0.02, 0.0014, BLACK),
        (0.05, 0.0028, Paint((74, 116, 158), "screen")),
    ):
        low, high = thick + 0.01 + inset * h, h * (1 - inset)
        s.slab(
            (-x * (1 - 1.2 * inset), x * (1 - 1.2 * inset)),
            (face(low) - proud, face(low) + 0.004),
            (face(high) - proud, face(high) + 0.004),
            (low, high),
            paint,
        )
    low, high = 0.36 * h, 0.7 * h
    s.slab(
        (-0.5 * x, 0.1 * x),
        (face(low) - 0.0042, face(low) + 0.003),
        (face(high) - 0.0042, face(high) + 0.003),
        (low, high),
        Paint((226, 232, 238), "screen"),
    )


def pot(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a cooking pot: open or with a lid, two handles or a long one."""
    body = sampler.pick(
        (STEEL, STEEL, IRON, Paint((176, 62, 54), "metal"), Paint((64, 104, 120), "metal"))
    )
    grip = sampler.pick((BLACK, STEEL.shade(0.8)))
    long_handle = d > 1.2 * w
    x, y = w / 2, d / 2
    rx = x if long_handle else 0.8 * x
    ry = min(y, 0.62 * d / 2 + 0.02) if long_handle else y
    cy = y - ry
    lidded = not long_handle and sampler.chance(0.5)
    rim = 0.72 * h if lidded else h
    if lidded:
        s.cylinder((-rx, rx), (cy - ry, cy + ry), (0, rim), body)
        s.layers(
            (ring(0, cy, rim, 1.02 * rx, ry, 12), ring(0, cy, 0.82 * h, 0.86 * rx, 0.86 * ry, 12)),
            body.shade(1.08),
        )
        s.cylinder((-0.16 * rx, 0.16 * rx), (cy - 0.16 * ry, cy + 0.16 * ry), (0.8 * h, h), grip)
    else:
        _open_wall(s, (rx, ry, rim), cy, body)
        s.cylinder(
            (-0.96 * rx, 0.96 * rx), (cy - 0.96 * ry, cy + 0.96 * ry), (0, 0.02), body.shade(0.7)
        )
    level = (0.78 * rim, 0.78 * rim + 0.018)
    if long_handle:
        s.box((-0.09 * x, 0.09 * x), (-y, cy - 0.94 * ry), level, grip)
        return
    for side in (-1, 1):
        outer = _span(side * (x - 0.014), side * x)
        s.box(outer, (-0.34 * y, 0.34 * y), level, grip)
        for cy2 in (-0.3 * y, 0.3 * y):
            s.box(
                _span(side * 0.92 * rx, side * (x - 0.004)), (cy2 - 0.008, cy2 + 0.008), level, grip
            )


def _open_wall(s: Sketch, size: tuple[float, float, float], cy: float, paint: Paint) -> None:
    """Draw the wall of a vessel as a ring of eight flat staves."""
    rx, ry, h = size
    outer, inner = ring(0, cy, 0, rx, ry, 16), ring(0, cy, 0, 0.92 * rx, 0.92 * ry, 16)
    for k in range(0, 16, 2):
        around = [one[(k + j) % 16] for one in (outer, inner) for j in (0, 1, 2)]
        s.hull([(a, b, z) for a, b, _ in around for z in (0.0, h)], paint)


def garbage_can(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a bin: tapered with a lid, pedal bin, or an open basket."""
    paint, x, y = sampler.pick((sampler.plastic(), STEEL, IRON)), w / 2, d / 2
    style = sampler.pick(("lid", "pedal", "open", "pedal"))
    if style == "pedal":
        s.box((-0.12 * x, 0.12 * x), (-y, -0.8 * y), (0.03 * h, 0.06 * h), BLACK)
        s.cylinder((-x, x), (-0.9 * y, y), (0, 0.08 * h), BLACK)
        s.cylinder((-0.97 * x, 0.97 * x), (-0.87 * y, 0.97 * y), (0.07 * h, 0.84 * h), paint)
        cy = 0.05 * y
        rings = [
            ring(0, cy, z * h, r * x, r * 0.95 * y, 10)
            for z, r in ((0.84, 1.0), (0.93, 0.86), (1.0, 0.45))
        ]
        s.layers(rings, paint.shade(0.86))
        return
    low, rim = 0.76, (0.8 if style == "lid" else 1.0) * h
    if style == "lid":
        s.taper(
            ((-low * x, low * x), (-low * y, low * y), 0),
            ((-0.94 * x, 0.94 * x), (-0.94 * y, 0.94 * y), rim),
            paint,
        )
        s.box((-x, x), (-y, y), (rim, rim + 0.05 * h), paint.shade(0.8))
        s.taper(
            ((-0.98 * x, 0.98 * x), (-0.98 * y, 0.98 * y), rim + 0.05 * h),
            ((-0.7 * x, 0.7 * x), (-0.5 * y, 0.5 * y), h),
            paint.shade(0.8),
        )
        s.box((-0.45 * x, 0.45 * x), (-0.86 * y, -0.7 * y), (rim + 0.06 * h, rim + 0.11 * h), BLACK)
        return
    t = 0.016
    s.box((-low * x, low * x), (-low * y, low * y), (0, 0.02), paint.shade(0.7))
    for side in (-1, 1):
        s.taper(
            (_span(side * low * x, side * (low * x - t)), (-low * y, low * y), 0),
            (_span(side * x, side * (x - t)), (-y, y), rim),
            paint,
        )
        s.taper(
            ((-low * x, low * x), _span(side * low * y, side * (low * y - t)), 0),
            ((-x, x), _span(side * y, side * (y - t)), rim),
            paint,
        )
    bag = sampler.pick((LINEN, BLACK, paint.shade(0.8)))
    for side in (-1, 1):
        s.box((-x, x), _span(side * (y + 0.003), side * (y - t)), (0.93 * h, h + 0.002), bag)
        s.box(_span(side * (x + 0.003), side * (x - t)), (-y, y), (0.93 * h, h + 0.002), bag)
