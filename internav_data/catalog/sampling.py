"""Random choices of a design, and its palettes."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from internav_data.catalog.shapes import Paint

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.random import Generator

T = TypeVar("T")

_WOODS = (
    (181, 136, 92),
    (150, 103, 64),
    (112, 74, 46),
    (205, 170, 125),
    (222, 196, 158),
    (92, 62, 44),
    (168, 116, 84),
    (236, 230, 220),
    (64, 58, 54),
)
_FABRICS = (
    (126, 138, 150),
    (92, 112, 134),
    (190, 178, 160),
    (148, 92, 82),
    (110, 128, 100),
    (206, 192, 172),
    (84, 90, 102),
    (196, 148, 92),
    (62, 92, 110),
    (158, 140, 150),
    (176, 104, 88),
    (52, 78, 74),
)
_LEATHERS = ((110, 66, 44), (70, 48, 40), (146, 96, 62), (48, 46, 48), (208, 196, 180))
_PLASTICS = (
    (236, 236, 232),
    (70, 74, 80),
    (202, 72, 62),
    (70, 130, 160),
    (226, 188, 88),
    (112, 160, 130),
    (44, 46, 50),
)
_METALS = ((176, 180, 186), (120, 124, 130), (66, 68, 72), (206, 208, 210), (158, 138, 108))
_STONES = ((214, 210, 204), (120, 118, 120), (178, 170, 160), (60, 60, 66), (232, 228, 222))

WHITE = Paint((238, 238, 236), "plastic")
CERAMIC = Paint((242, 242, 240), "ceramic")
STEEL = Paint((178, 182, 188), "metal")
CHROME = Paint((206, 210, 214), "metal")
IRON = Paint((58, 60, 64), "metal")
BLACK = Paint((38, 39, 42), "plastic")
SCREEN = Paint((20, 22, 28), "screen")
GLASS = Paint((176, 204, 212), "glass")
MIRROR = Paint((196, 214, 222), "glass")
BRASS = Paint((190, 156, 88), "metal")
LEAF = Paint((84, 142, 68), "leaf")
STEM = Paint((104, 80, 50), "wood")
SOIL = Paint((74, 56, 44), "stone")
PAPER = Paint((240, 236, 226), "paper")
LINEN = Paint((240, 238, 232), "fabric")

_BATCH = 64


class UniformSampler:
    """Sampler of uniform numbers alone, in batches: the same for any release of numpy."""

    def __init__(self, rng: Generator) -> None:
        self._rng = rng
        self._left: list[float] = []

    def roll(self) -> float:
        """Return a number in [0, 1)."""
        if not self._left:
            self._left = self._rng.random(_BATCH).tolist()
        return self._left.pop()

    def between(self, low: float, high: float) -> float:
        """Return a number in [low, high)."""
        return low + (high - low) * self.roll()

    def chance(self, share: float) -> bool:
        """Return True in that share of rolls."""
        return self.roll() < share

    def pick(self, options: Sequence[T]) -> T:
        """Return one of the options."""
        return options[int(self.roll() * len(options))]

    def wood(self) -> Paint:
        """Return a wood, painted ones included."""
        return Paint(self.pick(_WOODS), "wood")

    def fabric(self) -> Paint:
        """Return a woven cloth."""
        return Paint(self.pick(_FABRICS), "fabric")

    def cover(self) -> Paint:
        """Return a seat's cover: cloth, in three of ten cases leather."""
        return Paint(self.pick(_LEATHERS), "leather") if self.chance(0.3) else self.fabric()

    def plastic(self) -> Paint:
        """Return a coloured plastic."""
        return Paint(self.pick(_PLASTICS), "plastic")

    def metal(self) -> Paint:
        """Return a metal."""
        return Paint(self.pick(_METALS), "metal")

    def stone(self) -> Paint:
        """Return a stone of worktops."""
        return Paint(self.pick(_STONES), "stone")
