"""Which split a scene belongs to: a function of its index alone, so that datasets can grow."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from internav_data.records import Split

PERIOD = 120
"""12,000 scenes: 11,800 train, 100 val, 100 test."""


def split_of_scene(scene: int) -> Split:
    """Return the split of a scene: index mod 120 is 0 for val, 1 for test, else train."""
    special: dict[int, Split] = {0: "val", 1: "test"}
    return special.get(scene % PERIOD, "train")
