"""Kitchen and bathroom fixtures, plants, rugs, pictures and mirrors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from internav_data.catalog.designs.storage import doors
from internav_data.catalog.designs.tables import drawers
from internav_data.catalog.sampling import (
    BLACK,
    CERAMIC,
    CHROME,
    GLASS,
    LEAF,
    MIRROR,
    PAPER,
    SOIL,
    STEEL,
    STEM,
    WHITE,
)
from internav_data.catalog.shapes import Paint, ring

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch

_WATER = Paint((206, 216, 218), "ceramic")


def _base_cabinets(s: Sketch, size: tuple[float, float, float], sampler: UniformSampler) -> None:
    """Draw cabinets with doors and one column of drawers under a worktop."""
    w, d, h = size
    x, y = w / 2, d / 2
    front = -y + 0.035
    paint = sampler.pick(
        (sampler.wood(), WHITE, Paint((96, 112, 120), "wood"), Paint((120, 136, 116), "wood"))
    )
    s.box((-x, x), (front + 0.05, y), (0, 0.1), BLACK)
    s.box((-x, x), (front, y), (0.1, h - 0.04), paint)
    s.box((-x, x), (-y, y), (h - 0.04, h), sampler.stone())
    drawn = min(0.5, w) if w < 0.75 or sampler.chance(0.6) else 0.0
    if drawn:
        drawers(s, (-x, -x + drawn), front, (0.1, h - 0.05), 3, paint.shade(1.06))
    rest = w - drawn
    if rest > 0.2:
        leaves = max(1, min(4, round(rest / 0.5)))
        doors(s, (-x + drawn, x), front, (0.1, h - 0.05), leaves, paint.shade(1.06))


def counter_top(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a run of base cabinets with a worktop."""
    _base_cabinets(s, (w, d, h), sampler)


def kitchen_island(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an island: cabinets on one side, a lid that overhangs on the other."""
    _base_cabinets(s, (w, 0.62 * d, h), sampler)
    x, y = w / 2, d / 2
    s.box((-x, x), (0.62 * y, 1.38 * y), (h - 0.04, h), sampler.wood())
    for cx in (-x + 0.04, x - 0.04):
        s.box(
            (cx - 0.03, cx + 0.03), (1.38 * y - 0.1, 1.38 * y - 0.04), (0, h - 0.04), sampler.wood()
        )


def sink(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a wash basin on a pedestal or in a vanity."""
    x, y = w / 2, d / 2
    rim = h - 0.1
    if w > 0.55:
        paint = sampler.wood()
        s.box((-x + 0.02, x - 0.02), (-y + 0.06, y), (0, 0.08), BLACK)
        s.box((-x + 0.01, x - 0.01), (-y + 0.03, y), (0.08, rim - 0.06), paint)
        doors(s, (-x + 0.015, x - 0.015), -y + 0.03, (0.09, rim - 0.07), 2, paint.shade(1.08))
        s.box((-x, x), (-y, y), (rim - 0.06, rim), CERAMIC)
    else:
        s.cone((0, 0.35 * y), (0, rim - 0.16), (0.12, 0.085), CERAMIC)
        s.layers(
            (ring(0, 0.1 * y, rim - 0.2, 0.5 * x, 0.6 * y, 12), ring(0, 0, rim, x, y, 12)), CERAMIC
        )
    s.cylinder(
        (-0.7 * x, 0.7 * x), (-0.8 * y, 0.45 * y), (rim - 0.01, rim + 0.002), _WATER.shade(0.84)
    )
    s.rod((0, 0.72 * y), (rim, h), 0.014, CHROME)
    s.box((-0.012, 0.012), (0.1 * y, 0.74 * y), (h - 0.024, h), CHROME)


def toilet(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a toilet: foot, bowl, seat, tank."""
    x, y = w / 2, d / 2
    bowl = min(0.42, 0.55 * h)
    tank = 0.22 * d
    middle = (-y + (y - tank)) / 2
    reach = (2 * y - tank) / 2 + 0.02
    lid = sampler.pick((WHITE, WHITE, Paint((150, 106, 68), "wood")))
    s.layers(
        (
            ring(0, middle + 0.2 * reach, 0, 0.55 * x, 0.7 * reach, 12),
            ring(0, middle + 0.12 * reach, 0.5 * bowl, 0.52 * x, 0.66 * reach, 12),
        ),
        CERAMIC,
    )
    s.layers(
        (
            ring(0, middle + 0.1 * reach, 0.42 * bowl, 0.55 * x, 0.7 * reach, 12),
            ring(0, middle, bowl - 0.03, 0.9 * x, reach, 16),
        ),
        CERAMIC,
    )
    s.cylinder(
        (-0.9 * x, 0.9 * x), (middle - reach, middle + reach), (bowl - 0.03, bowl + 0.02), lid
    )
    s.cylinder(
        (-0.62 * x, 0.62 * x),
        (middle - 0.72 * reach, middle + 0.55 * reach),
        (bowl + 0.015, bowl + 0.024),
        _WATER.shade(0.86),
    )
    s.box((-0.6 * x, 0.6 * x), (y - 1.2 * tank, y), (0.1, bowl), CERAMIC)
    s.cushion((-0.96 * x, 0.96 * x), (y - tank, y), (bowl, h - 0.04), CERAMIC, 0.1)
    s.box((-x, x), (y - tank - 0.01, y), (h - 0.045, h - 0.008), CERAMIC.shade(0.97))
    s.rod((0, y - tank / 2), (h - 0.01, h), 0.025, CHROME)


def bathtub(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a tub with walls, a floor and taps."""
    x, y, t = w / 2, d / 2, 0.07
    skirt = sampler.pick((CERAMIC, CERAMIC, Paint((150, 166, 170), "ceramic")))
    s.box((-x + 0.02, x - 0.02), (-y + 0.02, y - 0.02), (0, 0.14), CERAMIC.shade(0.95))
    for side in (-1, 1):
        edge = (y - t, y) if side > 0 else (-y, -y + t)
        s.box((-x, x), edge, (0, h), skirt)
    s.taper(((-x, -x + 0.28), (-y, y), 0), ((-x, -x + t), (-y, y), h), CERAMIC)
    s.taper(((x - 0.16, x), (-y, y), 0), ((x - t, x), (-y, y), h), CERAMIC)
    s.box((x - 0.09, x - 0.02), (-0.02, 0.02), (h, h + 0.07), CHROME)
    s.box((x - 0.18, x - 0.06), (-0.014, 0.014), (h + 0.045, h + 0.07), CHROME)


def shower(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a shower: tray, glass on two sides, pole and head."""
    x, y = w / 2, d / 2
    s.box((-x, x), (-y, y), (0, 0.1), CERAMIC)
    s.box((-x + 0.05, x - 0.05), (-y + 0.05, y - 0.05), (0.098, 0.104), _WATER.shade(0.9))
    tile = sampler.pick((Paint((198, 210, 212), "ceramic"), Paint((170, 186, 180), "ceramic")))
    s.box((-x, x), (y - 0.03, y), (0.1, h), tile)
    s.box((x - 0.03, x), (-y, y), (0.1, h), tile.shade(0.96))
    for z in (0.12, h - 0.05):
        s.box((-x, -x + 0.02), (-y, y), (z, z + 0.03), CHROME)
    s.box((-x + 0.004, -x + 0.014), (-y + 0.02, y - 0.03), (0.15, h - 0.05), GLASS)
    s.box((-x, -x + 0.025), (-y, -y + 0.025), (0.1, h), CHROME)
    s.rod((0.3 * x, y - 0.06), (1.0, h - 0.04), 0.012, CHROME)
    s.box((0.3 * x - 0.012, 0.3 * x + 0.012), (y - 0.3, y - 0.05), (h - 0.06, h - 0.04), CHROME)
    s.rod((0.3 * x, y - 0.3), (h - 0.09, h - 0.05), 0.09, CHROME)
    s.box((0.3 * x - 0.06, 0.3 * x + 0.06), (y - 0.08, y - 0.03), (1.02, 1.07), CHROME)


def house_plant(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a potted plant: long leaves from the soil, or a crown on a stem."""
    x, y = w / 2, d / 2
    pot = sampler.pick(
        (
            Paint((186, 104, 72), "ceramic"),
            CERAMIC,
            Paint((88, 92, 96), "ceramic"),
            sampler.plastic(),
        )
    )
    high = min(0.4 * h, 0.34)
    r = min(0.3 * min(w, d) + 0.05, 0.48 * min(w, d))
    green = LEAF.shade(sampler.between(0.8, 1.2))
    s.cone((0, 0), (0, high), (0.72 * r, r), pot)
    s.rod((0, 0), (high - 0.01, high + 0.004), 0.9 * r, SOIL)
    if sampler.chance(0.4):
        s.rod((0, 0), (high, 0.68 * h), 0.022, STEM)
        for k in range(4):
            turn = math.radians(90 * k + 30)
            cx, cy = 0.42 * x * math.cos(turn), 0.42 * y * math.sin(turn)
            low = (0.52 + 0.07 * (k % 2)) * h
            s.ball(
                (cx - 0.58 * x, cx + 0.58 * x),
                (cy - 0.58 * y, cy + 0.58 * y),
                (low, low + 0.32 * h),
                green.shade(sampler.between(0.85, 1.15)),
            )
        s.ball((-0.6 * x, 0.6 * x), (-0.6 * y, 0.6 * y), (0.7 * h, h), green.shade(1.1))
        return
    for k in range(9):
        turn = math.radians(360 / 8 * k + sampler.between(-10, 10))
        tall = (1.0 if k == 8 else sampler.between(0.74, 0.96)) * h
        reach = 0.15 if k == 8 else sampler.between(0.8, 1.0)
        c, sn = math.cos(turn), math.sin(turn)
        wide = 0.17 * min(x, y) + 0.01
        middle = high + 0.55 * (tall - high)
        s.hull(
            [(0.1 * c * r, 0.1 * sn * r, high - 0.01)]
            + [
                (0.5 * reach * x * c - j * wide * sn, 0.5 * reach * y * sn + j * wide * c, middle)
                for j in (-1, 1)
            ]
            + [
                (0.44 * reach * x * c, 0.44 * reach * y * sn, middle - 0.03 * h),
                (reach * x * c, reach * y * sn, tall),
                (0.62 * reach * x * c, 0.62 * reach * y * sn, middle + 0.3 * (tall - middle)),
            ],
            green.shade(sampler.between(0.82, 1.18)),
        )


def laundry_hamper(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a laundry basket with a lid."""
    weave, x, y = (
        Paint(sampler.pick(((196, 164, 120), (150, 116, 82), (226, 220, 208))), "wood"),
        w / 2,
        d / 2,
    )
    s.taper(
        ((-0.86 * x, 0.86 * x), (-0.86 * y, 0.86 * y), 0),
        ((-0.97 * x, 0.97 * x), (-0.97 * y, 0.97 * y), 0.9 * h),
        weave,
    )
    for z in (0.25, 0.55):
        grow = 0.86 + 0.122 * z + 0.012
        s.box(
            (-grow * x, grow * x), (-grow * y, grow * y), (z * h, (z + 0.05) * h), weave.shade(0.86)
        )
    s.cushion((-x, x), (-y, y), (0.89 * h, h), weave.shade(1.06), 0.3)
    s.box((-0.2 * x, 0.2 * x), (-0.1 * y, 0.1 * y), (h - 0.01, h + 0.012), weave.shade(0.8))


def rug(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a rug with a border and a field; stepped in fractions of its thickness."""
    cloth, x, y = sampler.fabric(), w / 2, d / 2
    other = sampler.fabric()
    inset = 0.07 * min(w, d)
    if sampler.chance(0.3):
        s.cylinder((-x, x), (-y, y), (0, 0.85 * h), cloth)
        s.cylinder((-x + inset, x - inset), (-y + inset, y - inset), (0, h), other)
        return
    s.box((-x, x), (-y, y), (0, 0.7 * h), cloth)
    s.box((-x + inset, x - inset), (-y + inset, y - inset), (0, 0.85 * h), other)
    s.box(
        (-x + 1.6 * inset, x - 1.6 * inset),
        (-y + 1.6 * inset, y - 1.6 * inset),
        (0, h),
        cloth.shade(1.12),
    )


def painting(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a framed picture whose back is the wall's side (+y)."""
    x, y = w / 2, d / 2
    frame = sampler.pick((sampler.wood(), BLACK, Paint((196, 166, 104), "metal")))
    sky = Paint(
        sampler.pick(((150, 184, 204), (224, 196, 160), (196, 178, 196), (206, 214, 206))), "paper"
    )
    land = Paint(
        sampler.pick(((98, 130, 92), (166, 112, 76), (70, 92, 112), (60, 66, 82))), "paper"
    )
    s.box((-x, x), (-0.4 * y, y), (0, h), frame)
    rim = 0.06 * min(w, h) + 0.01
    s.box((-x + rim, x - rim), (-0.6 * y, 0), (rim, h - rim), PAPER)
    mat = 1.9 * rim
    s.box((-x + mat, x - mat), (-0.8 * y, 0), (mat, h - mat), sky)
    low = mat + (h - 2 * mat) * 0.2
    s.prism(
        "y",
        (
            (-x + mat, mat),
            (x - mat, mat),
            (x - mat, low),
            (0.2 * x, low + 0.3 * (h - 2 * mat)),
            (-x + mat, low),
        ),
        (-y, 0),
        land,
    )


def mirror(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a wall mirror, rectangular or oval."""
    x, y = w / 2, d / 2
    frame = sampler.pick((sampler.wood(), BLACK, CHROME, STEEL))
    if sampler.chance(0.4):
        s.cylinder((-x, x), (-0.7 * y, y), (0, h), frame, "y")
        s.cylinder((-0.93 * x, 0.93 * x), (-y, 0), (0.04 * h, 0.96 * h), MIRROR, "y")
        return
    rim = 0.05 * w
    s.box((-x, x), (-0.7 * y, y), (0, h), frame)
    s.box((-x + rim, x - rim), (-y, 0), (rim, h - rim), MIRROR)
