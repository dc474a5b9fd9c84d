"""Electric appliances: televisions, microwaves, fridges, stoves, washing machines, lamps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.catalog.sampling import BLACK, BRASS, CHROME, IRON, SCREEN, STEEL, WHITE
from internav_data.catalog.shapes import Paint, ring

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch

_DRUM = Paint((96, 112, 124), "glass")
_ENAMEL = (WHITE, STEEL, Paint((66, 70, 76), "metal"), Paint((226, 222, 212), "metal"))


def television(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a television: a thin panel on a stand, on feet, or an old deep one."""
    x, y = w / 2, d / 2
    frame = sampler.pick((BLACK, IRON, STEEL))
    old = d > 0.34 and sampler.chance(0.4)
    foot = (0.05 if old else 0.11) * h
    thick = min(0.06, 0.5 * d)
    front = -y if old else -thick / 2
    face = (front, front + thick)
    s.box((-x, x), face, (foot, h), frame)
    bezel = 0.03 * w if old else 0.014 * w
    s.box(
        (-x + bezel, x - bezel),
        (front - 0.004, front + 0.01),
        (foot + 1.6 * bezel, h - bezel),
        SCREEN,
    )
    s.hull(
        [
            (-x + 2 * bezel, front - 0.006, h - 2 * bezel),
            (-0.1 * x, front - 0.006, h - 2 * bezel),
            (-x + 2 * bezel, front - 0.006, foot + 0.45 * h),
            (-x + 2 * bezel, front, h - 2 * bezel),
            (-0.1 * x, front, h - 2 * bezel),
            (-x + 2 * bezel, front, foot + 0.45 * h),
        ],
        Paint((44, 54, 68), "screen"),
    )
    if old:
        corners = [(a * x, -y + thick, z) for a in (-0.98, 0.98) for z in (foot, h)]
        corners += [(a * x, y, z * h) for a in (-0.6, 0.6) for z in (0.2, 0.8)]
        s.hull(corners, frame.shade(1.15))
        s.box((-0.8 * x, 0.8 * x), (-0.9 * y, 0.2 * y), (0, foot), frame.shade(0.9))
        s.box((-0.5 * x, 0.5 * x), (0.1 * y, 0.8 * y), (0, 0.24 * h), frame.shade(1.1))
        return
    s.box(
        (-0.62 * x, 0.62 * x),
        (thick / 2, thick / 2 + 0.3 * thick),
        (0.25 * h, 0.8 * h),
        frame.shade(1.2),
    )
    if sampler.chance(0.5):
        s.box((-0.07 * x, 0.07 * x), (-0.3 * thick, 0.3 * thick), (0, 0.3 * h), frame)
        s.cushion((-0.45 * x, 0.45 * x), (-y, y), (0, 0.018), frame, 0.3)
        return
    for side in (-1, 1):
        cx = side * 0.7 * x
        for sy in (-1, 1):
            s.strut((cx, sy * (y - 0.014), 0), (cx, sy * 0.2 * thick, foot + 0.01), 0.014, frame)


def microwave(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a microwave oven: door with window, handle, keys."""
    case, x, y = sampler.pick((*_ENAMEL, BLACK)), w / 2, d / 2
    front = -y + 0.03
    s.legs((-0.9 * x, 0.9 * x), (front + 0.03, 0.9 * y), (0, 0.014), 0.016, BLACK, round_=True)
    s.box((-x, x), (front, y), (0.012, h), case)
    split = 0.5 * x
    s.box((-x + 0.008, split), (front - 0.01, front + 0.01), (0.025, h - 0.012), case.shade(0.92))
    s.box((-0.86 * x, split - 0.07), (front - 0.013, front), (0.2 * h, 0.8 * h), SCREEN)
    if sampler.chance(0.7):
        s.cylinder((split - 0.045, split - 0.025), (-y, -y + 0.02), (0.15 * h, 0.85 * h), CHROME)
    else:
        s.box((split - 0.05, split - 0.02), (-y, front), (0.12 * h, 0.88 * h), case.shade(0.7))
    right = (split + 0.02, x - 0.015)
    s.box(right, (front - 0.006, front), (0.06 * h + 0.012, 0.94 * h), BLACK)
    s.box(
        (right[0] + 0.012, right[1] - 0.012),
        (front - 0.009, front),
        (0.74 * h, 0.88 * h),
        Paint((92, 190, 150), "screen"),
    )
    for k in range(2):
        low = (0.16 + 0.27 * k) * h
        s.box(
            (right[0] + 0.012, right[1] - 0.012),
            (front - 0.009, front),
            (low, low + 0.18 * h),
            STEEL,
        )


def fridge(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a fridge: two doors above each other or side by side."""
    case, x, y = sampler.pick(_ENAMEL), w / 2, d / 2
    front = -y + 0.05
    s.box((-x + 0.02, x - 0.02), (front + 0.06, y), (0, 0.06), BLACK)
    s.box((-x, x), (front + 0.05, y), (0.05, h), case.shade(0.92))

    def door(
        xs: tuple[float, float], zs: tuple[float, float], handle: float, hz: tuple[float, float]
    ) -> None:
        s.cushion(
            (xs[0] + 0.003, xs[1] - 0.003),
            (front, front + 0.055),
            (zs[0] + 0.004, zs[1] - 0.004),
            case,
            0.15,
        )
        s.box((handle - 0.012, handle + 0.012), (-y, -y + 0.02), hz, CHROME)
        for z in (hz[0] + 0.02, hz[1] - 0.04):
            s.box((handle - 0.008, handle + 0.008), (-y + 0.01, front), (z, z + 0.02), CHROME)

    if w > 0.8:
        door((-x, 0), (0.06, h), -0.05, (0.4 * h, 0.75 * h))
        door((0, x), (0.06, h), 0.05, (0.4 * h, 0.75 * h))
        s.box((-0.7 * x, -0.3 * x), (front - 0.004, front), (0.5 * h, 0.68 * h), BLACK)
    else:
        split = sampler.pick((0.36, 0.68)) * h
        side = sampler.pick((-1, 1)) * (x - 0.06)
        door((-x, x), (0.06, split), side, (max(0.12, split - 0.42), split - 0.06))
        door((-x, x), (split, h), side, (split + 0.06, min(h - 0.1, split + 0.42)))


def stove(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a cooker: oven door with window and bar, knobs, four plates."""
    case, x, y = sampler.pick(_ENAMEL), w / 2, d / 2
    top = min(h, 0.92)
    front = -y + 0.04
    s.box((-x, x), (front, y), (0.06, top - 0.012), case)
    s.box((-x + 0.02, x - 0.02), (front + 0.04, y), (0, 0.06), BLACK)
    s.box((-x, x), (front, y), (top - 0.014, top), BLACK)
    s.box((-x + 0.02, x - 0.02), (front - 0.012, front + 0.01), (0.2, 0.72), case.shade(0.9))
    s.box((-0.72 * x, 0.72 * x), (front - 0.015, front), (0.3, 0.6), SCREEN)
    s.cylinder((-0.8 * x, 0.8 * x), (-y, -y + 0.022), (0.66, 0.682), CHROME, "x")
    s.box((-x + 0.02, x - 0.02), (front - 0.01, front), (0.08, 0.18), case.shade(0.94))
    for k in range(4):
        cx = (-0.66 + 0.44 * k) * x
        s.cylinder((cx - 0.02, cx + 0.02), (front - 0.02, front + 0.01), (0.78, 0.82), IRON, "y")
    for sx in (-0.48, 0.48):
        for sy, r in ((-0.38, 0.09), (0.46, 0.075)):
            cy = front / 2 + sy * y + y / 2 * 0.5 - 0.02
            s.cylinder(
                (sx * x - r, sx * x + r),
                (cy - r, cy + r),
                (top - 0.01, top + 0.004),
                IRON.shade(1.4),
            )
    if h > 0.97:
        s.box((-x, x), (y - 0.05, y), (top, h), case)


def washing_machine(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a front loader: round door, drawer, dial."""
    case, x, y = sampler.pick((WHITE, WHITE, STEEL)), w / 2, d / 2
    front = -y + 0.03
    s.box((-x, x), (front, y), (0.02, h), case)
    s.legs((-0.92 * x, 0.92 * x), (front + 0.04, 0.92 * y), (0, 0.02), 0.02, BLACK, round_=True)
    r, cz = 0.3 * w, 0.46 * h
    s.cylinder((-r, r), (-y, front + 0.01), (cz - r, cz + r), STEEL, "y")
    s.cylinder(
        (-0.74 * r, 0.74 * r), (-y - 0.003, front), (cz - 0.74 * r, cz + 0.74 * r), _DRUM, "y"
    )
    s.box((-x + 0.012, x - 0.012), (front - 0.006, front), (0.85 * h, 0.97 * h), case.shade(0.9))
    s.box((-0.9 * x, -0.45 * x), (front - 0.01, front), (0.87 * h, 0.95 * h), case)
    s.cylinder((0.0, 0.08), (front - 0.026, front), (0.91 * h - 0.04, 0.91 * h + 0.04), IRON, "y")
    s.box((0.4 * x, 0.82 * x), (front - 0.01, front), (0.88 * h, 0.94 * h), SCREEN)


def clothes_dryer(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a dryer: square door with a round glass, grille, dial on the left."""
    case, x, y = sampler.pick((WHITE, WHITE, STEEL)), w / 2, d / 2
    front = -y + 0.03
    s.box((-x, x), (front, y), (0.02, h), case)
    s.legs((-0.92 * x, 0.92 * x), (front + 0.04, 0.92 * y), (0, 0.02), 0.02, BLACK, round_=True)
    r, cz = 0.27 * w, 0.5 * h
    s.cushion(
        (-1.15 * r, 1.15 * r),
        (-y + 0.008, front + 0.01),
        (cz - 1.15 * r, cz + 1.15 * r),
        case.shade(0.9),
        0.3,
    )
    s.cylinder((-0.8 * r, 0.8 * r), (-y, front), (cz - 0.8 * r, cz + 0.8 * r), _DRUM, "y")
    s.box((-0.8 * x, 0.8 * x), (front - 0.006, front), (0.07 * h, 0.13 * h), IRON)
    s.box((-x + 0.012, x - 0.012), (front - 0.006, front), (0.87 * h, 0.97 * h), case.shade(0.85))
    s.cylinder(
        (-0.6 * x - 0.04, -0.6 * x + 0.04),
        (front - 0.026, front),
        (0.92 * h - 0.035, 0.92 * h + 0.035),
        IRON,
        "y",
    )
    s.box((0.3 * x, 0.82 * x), (front - 0.01, front), (0.89 * h, 0.95 * h), SCREEN)


def dishwasher(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a dishwasher: one door, a bar, a strip of keys."""
    case, x, y = sampler.pick(_ENAMEL), w / 2, d / 2
    front = -y + 0.035
    s.box((-x + 0.01, x - 0.01), (front + 0.05, y), (0, 0.1), BLACK)
    s.box((-x, x), (front, y), (0.1, h), case.shade(0.92))
    s.box((-x + 0.004, x - 0.004), (front - 0.014, front + 0.01), (0.11, 0.86 * h), case)
    s.box((-x + 0.004, x - 0.004), (front - 0.014, front + 0.01), (0.875 * h, 0.99 * h), BLACK)
    s.cylinder((-0.7 * x, 0.7 * x), (-y, -y + 0.022), (0.78 * h, 0.78 * h + 0.022), CHROME, "x")


def floor_lamp(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a standing lamp: a foot, a pole and a shade."""
    x, y = w / 2, d / 2
    pole = sampler.pick((BRASS, IRON, CHROME))
    shade = Paint(
        sampler.pick(((240, 228, 200), (226, 214, 190), (70, 74, 80), (206, 178, 140))), "fabric"
    )
    low = h - sampler.between(0.24, 0.32)
    s.rod((0, 0), (0, 0.03), 0.13, pole)
    s.rod((0, 0), (0.02, h - 0.08), 0.014, pole)
    top = sampler.between(0.55, 0.9)
    s.layers((ring(0, 0, low, x, y, 16), ring(0, 0, h, top * x, top * y, 16)), shade)
