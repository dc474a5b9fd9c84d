"""Soft furniture: beds, pillows, dog beds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from internav_data.catalog.sampling import LINEN, WHITE
from internav_data.catalog.shapes import ring

if TYPE_CHECKING:
    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch


def bed(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a bed, its head at +y: frame, mattress, duvet, pillows."""
    x, y = w / 2, d / 2
    wood, cloth = sampler.wood(), sampler.fabric()
    head = sampler.pick((wood, wood, sampler.fabric()))
    s.box((-x, x), (y - 0.06, y), (0, h), head)
    s.box((-x, x), (-y, y - 0.05), (0.12, 0.3), wood)
    s.legs((-x + 0.02, x - 0.02), (-y + 0.02, y - 0.08), (0, 0.12), 0.035, wood.shade(0.85))
    s.cushion((-x + 0.02, x - 0.02), (-y + 0.03, y - 0.06), (0.28, 0.5), LINEN, 0.2)
    s.cushion((-x + 0.002, x - 0.002), (-y + 0.01, y - 0.75), (0.32, 0.545), cloth, 0.2)
    s.cushion((-x + 0.004, x - 0.004), (y - 0.9, y - 0.62), (0.34, 0.56), cloth.shade(1.18), 0.25)
    count = 1 if w < 1.2 else 2
    wide = (w - 0.1) / count
    for k in range(count):
        left = -x + 0.05 + k * wide
        s.cushion((left + 0.02, left + wide - 0.02), (y - 0.5, y - 0.1), (0.48, 0.62), WHITE, 0.4)


def pillow(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a stuffed pillow: pointed corners, a full middle, perhaps a stripe."""
    cloth, x, y = sampler.pick((sampler.fabric(), sampler.fabric(), LINEN)), w / 2, d / 2

    def body(grow: float, half_x: float) -> list[tuple[float, float, float]]:
        corners = [(a * half_x, b * y, 0.5 * h) for a in (-1, 1) for b in (-1, 1)]
        for share, z in ((0.5, 0.0), (0.78, 0.2), (0.78, 0.8), (0.5, 1.0)):
            reach = min(half_x, share * x + (half_x < x) * x)
            corners += [
                (a * reach, b * share * y * 1.04, h * (0.5 + (z - 0.5) * grow))
                for a in (-1, 1)
                for b in (-1, 1)
            ]
        return corners

    s.hull(body(1.0, x), cloth)
    if sampler.chance(0.5):
        s.hull(
            [
                (a * 0.16 * x, b * share * y, h * z)
                for a in (-1, 1)
                for b in (-1, 1)
                for share, z in (
                    (0.53, -0.004),
                    (0.84, 0.2),
                    (0.96, 0.5),
                    (0.84, 0.8),
                    (0.53, 1.004),
                )
            ],
            sampler.fabric() if sampler.chance(0.5) else cloth.shade(0.8),
        )


def dog_bed(s: Sketch, w: float, d: float, h: float, sampler: UniformSampler) -> None:
    """Draw a dog's bed: a cushion within a soft rim, lower in front."""
    rim, x, y = sampler.fabric(), w / 2, d / 2
    t = 0.15 * min(w, d)
    if sampler.chance(0.5):
        for k in range(8):
            a, b = (math.radians(22.5 + 45 * (k + j)) for j in (0, 1))
            high = h if math.sin((a + b) / 2) > -0.5 else 0.72 * h
            corners = []
            for turn in (a, b):
                c, sn = math.cos(turn) / 0.924, math.sin(turn) / 0.924
                for r, z in ((0.97, 0.0), (1.0, 0.45), (0.92, 1.0), (0.74, 1.0), (0.66, 0.0)):
                    corners.append((c * r * x, sn * r * y, z * high))
            s.hull(corners, rim)
        s.layers(
            (ring(0, 0, 0, 0.8 * x, 0.8 * y, 12), ring(0, 0, 0.5 * h, 0.74 * x, 0.74 * y, 12)),
            LINEN,
        )
        return
    s.cushion((-x + 0.7 * t, x - 0.7 * t), (-y + 0.5 * t, y - 0.7 * t), (0, 0.55 * h), LINEN, 0.3)
    s.cushion((-x, x), (y - t, y), (0, h), rim, 0.35)
    s.cushion((-x, -x + t), (-y, y), (0, h), rim, 0.35)
    s.cushion((x - t, x), (-y, y), (0, h), rim, 0.35)
    s.cushion((-x + 0.6 * t, x - 0.6 * t), (-y, -y + 0.8 * t), (0, 0.66 * h), rim.shade(0.95), 0.35)
