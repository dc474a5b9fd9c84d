"""Bread, apples, tomatoes and lettuce: flat beneath, so that they stay where they lie."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from internav_data.catalog.sampling import LEAF, STEM
from internav_data.catalog.shapes import Paint, ring

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch
    from internav_data.records import Vec2

_CRUSTS = ((196, 140, 82), (168, 112, 62), (210, 162, 104), (142, 92, 54))
_APPLES = ((190, 44, 44), (206, 72, 54), (142, 176, 66), (212, 180, 78), (162, 36, 52))
_TOMATOES = ((206, 58, 42), (190, 44, 40), (218, 88, 48), (212, 66, 58))


def bread(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a loaf along y: from a tin, or freely formed with cuts across."""
    crust, half = Paint(sampler.pick(_CRUSTS), "food"), (w / 2, d / 2)
    if sampler.chance(0.5):
        _tin_loaf(s, half, h, crust)
    else:
        _free_loaf(s, half, h, crust)


def _tin_loaf(s: Sketch, half: Vec2, h: float, crust: Paint) -> None:
    """Draw a loaf from a tin: straight sides, a dome with a slot, a cut heel."""
    x, y = half
    low = [(-0.9 * x, 0.0), (0.9 * x, 0.0), (0.92 * x, 0.55 * h), (-0.92 * x, 0.55 * h)]
    s.prism("y", low, (-0.97 * y, 0.97 * y), crust)
    dome = [
        (a * x, b * h)
        for a, b in (
            (-0.9, 0.5),
            (-1, 0.66),
            (-0.88, 0.85),
            (-0.5, 0.98),
            (0.5, 0.98),
            (0.88, 0.85),
            (1, 0.66),
            (0.9, 0.5),
        )
    ]
    s.prism("y", dome, (-y, y), crust.shade(0.88))
    slot = [(-0.3 * x, 0.95 * h), (0.3 * x, 0.95 * h), (0.2 * x, h), (-0.2 * x, h)]
    s.prism("y", slot, (-0.8 * y, 0.8 * y), crust.shade(1.22))
    heel = [
        (a * 0.88 * x, b * h)
        for a, b in (
            (-0.95, 0.05),
            (0.95, 0.05),
            (1, 0.66),
            (0.7, 0.88),
            (-0.7, 0.88),
            (-1, 0.66),
        )
    ]
    s.prism("y", heel, (-y - 0.001, -0.9 * y), Paint((236, 214, 170), "food"))


def _free_loaf(s: Sketch, half: Vec2, h: float, crust: Paint) -> None:
    """Draw a freely formed loaf with three cuts across."""
    x, y = half
    rings = [
        ring(0, 0, z * h, r * x, r * y, n)
        for z, r, n in ((0, 0.72, 8), (0.3, 1.0, 8), (0.62, 0.9, 8), (0.92, 0.48, 8))
    ]
    s.layers(rings, crust)
    for k in range(3):
        cy = (-0.42 + 0.42 * k) * y
        tall = (0.95 if k == 1 else 0.86) * h
        s.hull(
            [
                (a * 0.4 * x, cy + b * 0.05 * y + a * 0.1 * y, z)
                for a in (-1, 1)
                for b in (-1, 1)
                for z in (0.5 * h, tall - 0.06 * h)
            ]
            + [(0, cy + b * 0.03 * y, tall + 0.03 * h) for b in (-1, 1)],
            crust.shade(1.22),
        )


def _fruit(
    s: Sketch,
    size: tuple[float, float, float],
    profile: tuple[tuple[float, float], ...],
    skin: Paint,
) -> None:
    """Draw a body of revolution from (height, radius) shares; rings are turned alternately."""
    w, d, h = size
    rings = [ring(0, 0, z * h, r * w / 2, r * d / 2, 8) for z, r in profile]
    s.layers(rings, skin)


def apple(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw an apple with its stem and a leaf."""
    skin = Paint(sampler.pick(_APPLES), "food")
    body = 0.86 * h
    _fruit(s, (w, d, body), ((0, 0.52), (0.28, 0.9), (0.62, 1.0), (0.95, 0.6)), skin)
    s.layers(
        (ring(0, 0, 0.9 * body, 0.28 * w, 0.28 * d, 8), ring(0, 0, body, 0.16 * w, 0.16 * d, 8)),
        skin.shade(0.86),
    )
    t = 0.022 * w + 0.001
    s.strut((0, 0, 0.9 * body), (0.04 * w, 0, h), t, STEM)
    if sampler.chance(0.6):
        z = 0.93 * h
        s.hull(
            [
                (0.03 * w, 0, z - 0.03 * h),
                (0.16 * w, -0.08 * d, z),
                (0.16 * w, 0.08 * d, z),
                (0.3 * w, 0, z + 0.04 * h),
                (0.16 * w, 0, z + 0.04 * h),
            ],
            LEAF,
        )


def tomato(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a tomato with its green star."""
    skin = Paint(sampler.pick(_TOMATOES), "food")
    body = 0.92 * h
    _fruit(s, (w, d, body), ((0, 0.56), (0.3, 0.96), (0.62, 1.0), (0.96, 0.56)), skin)
    for k in range(5):
        turn = math.radians(72 * k + 20)
        c, sn = math.cos(turn), math.sin(turn)
        a, b = 0.27 * w, 0.27 * d
        s.hull(
            [
                (c * a, sn * b, body * 0.93),
                (-sn * 0.06 * w, c * 0.06 * d, body * 1.0),
                (sn * 0.06 * w, -c * 0.06 * d, body * 1.0),
                (0, 0, 0.9 * body),
                (c * 0.1 * w, sn * 0.1 * d, 1.04 * body),
            ],
            LEAF,
        )
    s.rod((0, 0), (0.9 * body, h), 0.03 * w, LEAF.shade(0.8))


def lettuce(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a head of lettuce: a pale heart within six outer leaves."""
    green = sampler.pick(
        (
            Paint((118, 172, 76), "leaf"),
            Paint((98, 152, 70), "leaf"),
            Paint((146, 190, 96), "leaf"),
            Paint((132, 110, 92), "leaf"),
        )
    )
    x, y = w / 2, d / 2
    heart = [
        ring(0, 0, z * h, r * x, r * y, 8)
        for z, r in ((0, 0.46), (0.3, 0.76), (0.68, 0.74), (0.94, 0.42))
    ]
    s.layers(heart, Paint((186, 210, 128), "leaf"))
    leaves = 6
    for k in range(leaves):
        turn = math.radians(360 / leaves * k + sampler.between(-8, 8))
        tall = sampler.between(0.86, 1.0)

        def at(r: float, aside: float, z: float, turn: float = turn) -> tuple[float, float, float]:
            angle = turn + math.radians(aside)
            return (r * x * math.cos(angle), r * y * math.sin(angle), z * h)

        pairs = ((0.48, 30, 0.0), (0.86, 42, 0.22), (1.0, 40, 0.5), (0.9, 38, 0.76 * tall))
        corners = [at(r, side * a, z) for r, a, z in pairs for side in (-1, 1)]
        corners += [at(0.72, side * 24, 0.95 * tall) for side in (-1, 1)]
        corners += [at(0.96, 0, 0.24), at(1.0, 0, 0.5), at(0.94, 0, 0.78 * tall)]
        corners += [at(0.6, 0, tall), at(0.5, 0, 0.3)]
        s.hull(corners, green.shade(sampler.between(0.84, 1.14)))
