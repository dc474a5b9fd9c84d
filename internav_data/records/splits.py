"""Split of a scene: a function of its number alone, so that datasets can grow."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from internav_data.records import Split

PERIOD = 120
"""Scenes after which splits repeat: of 12,000 scenes 11,800 train, 100 val and 100 test."""


def split_of_scene(scene: int) -> Split:
    """Return the split of a scene by its number modulo 120: 0 is val, 1 is test, else train."""
    special: dict[int, Split] = {0: "val", 1: "test"}
    return special.get(scene % PERIOD, "train")
