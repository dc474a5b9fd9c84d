"""Where environments get their episodes: a dataset, opened once a process.

What environments share about houses: prepared once a process, the latest ones kept.
"""

from __future__ import annotations

import hashlib
import math
from collections import OrderedDict
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.dataset import load_dataset
from internav_data.dataset.manifest import MANIFEST
from internav_data.envs.auxiliary import auxiliary_starts
from internav_data.envs.order import EpisodeOrder, scene_bounds
from internav_data.geometry import round_m
from internav_data.navigation import SPACING_M
from internav_data.records.errors import UsageError
from internav_data.render.camera import StaticScene
from internav_data.world import HouseModel

if TYPE_CHECKING:
    import pyarrow as pa
    from numpy.typing import NDArray

    from internav_data.dataset import Dataset
    from internav_data.envs.auxiliary import AuxiliaryStart, Kind
    from internav_data.records import Episode, House, PushModel


FIELDS_KEPT: Final = 64
"""Distance fields kept a house: one for each goal."""
HOUSE_CACHE_SIZE: Final = 64
"""Houses kept a process, unless an environment asks for more."""


class ShortestPathField:
    """Any-angle distance to one goal, no obstacle about: worked out where somebody asks.

    Parameters
    ----------
    model
        The house.
    goal : (int, int)
        Node.
    """

    __slots__ = ("_goal", "_metres", "_model")

    def __init__(self, model: HouseModel, goal: tuple[int, int]) -> None:
        self._model = model
        self._goal = (SPACING_M * goal[0], SPACING_M * goal[1])
        self._metres = np.full(model.lattice.shape, np.nan)

    def at(self, i: int, j: int) -> float:
        """Distance from a node, metres, as `World.shortest_path_m` has it; inf where cut off."""
        known = float(self._metres[i, j])
        if math.isnan(known):
            way = self._model.shortest_path_m((SPACING_M * i, SPACING_M * j), self._goal)
            known = math.inf if way is None else round_m(way)
            self._metres[i, j] = known
        return known


@dataclass(slots=True, eq=False)
class LoadedHouse:
    """A house ready to be walked in."""

    model: HouseModel
    static_scene: StaticScene
    instances: tuple[int, ...]
    """Which instance of the camera's props each of the stage's items is."""
    _fields: OrderedDict[tuple[int, int], ShortestPathField] = field(default_factory=OrderedDict)

    @staticmethod
    def of(house: House) -> LoadedHouse:
        """Prepare a house."""
        model = HouseModel.of(house)
        rows = {thing.object_id: row for row, thing in enumerate(house.objects)}
        return LoadedHouse(model, StaticScene.of(house), tuple(rows[t] for t in model.object_ids))

    def distance_field(self, goal: tuple[int, int]) -> ShortestPathField:
        """Return the distance field of a goal."""
        found = self._fields.get(goal)
        if found is None:
            found = self._fields[goal] = ShortestPathField(self.model, goal)
            if len(self._fields) > FIELDS_KEPT:
                self._fields.popitem(last=False)
        self._fields.move_to_end(goal)
        return found


class LoadedHouses:
    """The latest houses, by dataset and scene."""

    def __init__(self, capacity: int = HOUSE_CACHE_SIZE) -> None:
        self.capacity = capacity
        self._houses: OrderedDict[tuple[str, str], LoadedHouse] = OrderedDict()

    def __len__(self) -> int:
        return len(self._houses)

    def of(self, dataset_key: str, house: House) -> LoadedHouse:
        """Return a house's place, prepared unless it is known."""
        key = (dataset_key, house.scene_id)
        found = self._houses.get(key)
        if found is None:
            found = self._houses[key] = LoadedHouse.of(house)
            while len(self._houses) > self.capacity:
                self._houses.popitem(last=False)
        self._houses.move_to_end(key)
        return found


LOADED_HOUSES: Final = LoadedHouses()
"""Of this process: environments in it share their houses."""


SOURCES_KEPT: Final = 8
STARTS_KEPT: Final = 8192
"""Episodes whose auxiliary starts are kept a source."""


class Source:
    """Episodes by number and by id, and the places they happen in."""

    def __init__(self, dataset: Dataset[Episode], digest: str) -> None:
        self.dataset, self._digest = dataset, digest
        self.auxiliary_starts = lru_cache(STARTS_KEPT)(self._auxiliary_starts)
        if len(dataset) == 0:
            raise UsageError(
                f"dataset {dataset.path}: no episodes for split={dataset.split!r}, "
                f"filters={dataset.filters!r}; there are {dataset.manifest.counts}: choose others"
            )

    @property
    def push_model(self) -> PushModel:
        """The model that the dataset's outcomes and experts were made with."""
        model: PushModel = self.dataset.manifest.config.get("episodes", {}).get(
            "push_model", "force"
        )
        return model

    @cached_property
    def bounds(self) -> NDArray[np.int64]:
        """Episode numbers at which a new house begins, and the count."""
        return scene_bounds(self.dataset)

    @cached_property
    def _ids(self) -> pa.ChunkedArray:
        return self.dataset.to_table(["episode_id"]).column("episode_id")

    def order(self, seed: int, *, episodes_per_house: int, shuffle: bool) -> EpisodeOrder:
        """Return the order of episodes of a seed."""
        return EpisodeOrder(
            self.bounds, seed, episodes_per_house=episodes_per_house, shuffle=shuffle
        )

    def number_of(self, episode_id: str) -> int:
        """Return the number of an episode.

        Raises
        ------
        UsageError
            No such episode among those selected.
        """
        import pyarrow.compute as pc  # noqa: PLC0415 - only those who ask by id need it

        number = int(pc.index(self._ids, str(episode_id)).as_py())
        if number < 0:
            raise UsageError(
                f"options['episode_id']: no episode {episode_id!r} in {self.dataset!r}; ids look "
                f"like {self._ids[0].as_py()!r} (other splits and filtered-out ones do not count)"
            )
        return number

    def episode(self, number: int) -> Episode:
        """Return an episode."""
        return self.dataset[number]

    def loaded_house(self, episode: Episode) -> LoadedHouse:
        """Return the house of an episode, ready for the environment."""
        return LOADED_HOUSES.of(self._digest, self.dataset.scene(episode.scene_id))

    def _auxiliary_starts(self, number: int, kind: Kind) -> tuple[AuxiliaryStart, ...]:
        """Return the starts of an episode; `auxiliary_starts` keeps the latest ones."""
        episode = self.episode(number)
        model = self.loaded_house(episode).model
        return auxiliary_starts(model, episode, self.dataset.assets, kind)


_SOURCES: OrderedDict[str, Source] = OrderedDict()


def open_source(
    dataset: str | Path | Dataset[Episode],
    split: str | None = None,
    filters: list[tuple[str, str, object]] | None = None,
) -> Source:
    """Open a dataset, or take the one that this process has open already.

    Raises
    ------
    CorruptDataError
        No dataset there, or a damaged one.
    UsageError
        An unknown split, column or operator, or nothing selected.
    """
    if not isinstance(dataset, str | Path):
        return Source(dataset, _digest(dataset.path))
    path = Path(dataset)
    if not (path / MANIFEST).exists():
        load_dataset(path)  # says what is wrong
    digest = _digest(path)
    key = repr((str(path.resolve()), digest, split, filters))
    found = _SOURCES.get(key)
    if found is None:
        found = _SOURCES[key] = Source(load_dataset(path, split, filters), digest)
        if len(_SOURCES) > SOURCES_KEPT:
            _SOURCES.popitem(last=False)
    _SOURCES.move_to_end(key)
    return found


def _digest(path: Path) -> str:
    return hashlib.sha256((path / MANIFEST).read_bytes()).hexdigest()
