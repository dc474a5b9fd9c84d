"""What environments share about houses: prepared once a process, the latest ones kept."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.geometry import round_m
from internav_data.navigation import SPACING_M
from internav_data.world import Stage
from internav_data.world.camera import Scenery

if TYPE_CHECKING:
    from internav_data.records import House

FIELDS_KEPT: Final = 64
"""Distance fields kept a house: one for each goal."""
HOUSES_KEPT: Final = 64
"""Houses kept a process, unless an environment asks for more."""


class ClearField:
    """Any-angle distance to one goal, no obstacle about: worked out where somebody asks.

    Parameters
    ----------
    stage
        The house.
    goal : (int, int)
        Node.
    """

    __slots__ = ("_goal", "_metres", "_stage")

    def __init__(self, stage: Stage, goal: tuple[int, int]) -> None:
        self._stage = stage
        self._goal = (SPACING_M * goal[0], SPACING_M * goal[1])
        self._metres = np.full(stage.lattice.shape, np.nan)

    def at(self, i: int, j: int) -> float:
        """Distance from a node, metres, as `World.clear_m` has it; inf where cut off."""
        known = float(self._metres[i, j])
        if math.isnan(known):
            way = self._stage.clear_m((SPACING_M * i, SPACING_M * j), self._goal)
            known = math.inf if way is None else round_m(way)
            self._metres[i, j] = known
        return known


@dataclass(slots=True, eq=False)
class Place:
    """A house ready to be walked in."""

    stage: Stage
    scenery: Scenery
    instances: tuple[int, ...]
    """Which instance of the camera's props each of the stage's items is."""
    _fields: OrderedDict[tuple[int, int], ClearField] = field(default_factory=OrderedDict)

    @staticmethod
    def of(house: House) -> Place:
        """Prepare a house."""
        stage = Stage.of(house)
        rows = {thing.thing_id: row for row, thing in enumerate(house.things)}
        return Place(stage, Scenery.of(house), tuple(rows[t] for t in stage.thing_ids))

    def field_to(self, goal: tuple[int, int]) -> ClearField:
        """Return the distance field of a goal."""
        found = self._fields.get(goal)
        if found is None:
            found = self._fields[goal] = ClearField(self.stage, goal)
            if len(self._fields) > FIELDS_KEPT:
                self._fields.popitem(last=False)
        self._fields.move_to_end(goal)
        return found


class Places:
    """The latest houses, by dataset and scene."""

    def __init__(self, capacity: int = HOUSES_KEPT) -> None:
        self.capacity = capacity
        self._places: OrderedDict[tuple[str, str], Place] = OrderedDict()

    def __len__(self) -> int:
        return len(self._places)

    def of(self, dataset_key: str, house: House) -> Place:
        """Return a house's place, prepared unless it is known."""
        key = (dataset_key, house.scene_id)
        found = self._places.get(key)
        if found is None:
            found = self._places[key] = Place.of(house)
            while len(self._places) > self.capacity:
                self._places.popitem(last=False)
        self._places.move_to_end(key)
        return found


PLACES: Final = Places()
"""Of this process: environments in it share their houses."""
