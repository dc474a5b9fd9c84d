"""Episodes and houses of environments, shared by all environments of a process.

A dataset is opened once, and a house is prepared once: a `HouseModel`, the camera's scene and
distance fields cost far more than a step. The most recently used ones are kept.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.core.hardware import hardware
from internav_data.core.lru import LRUCache
from internav_data.core.storage import FolderStore, store_of
from internav_data.dataset import load_dataset
from internav_data.dataset.location import folder_to_read
from internav_data.dataset.manifest import read_manifest_and_digest
from internav_data.dataset.select import joined
from internav_data.envs.auxiliary import auxiliary_starts
from internav_data.envs.house_map import house_raster
from internav_data.envs.order import EpisodeOrder, scene_bounds
from internav_data.geometry import round_m
from internav_data.navigation import SPACING_M
from internav_data.physics.config import PhysicsConfig
from internav_data.physics.engines.installed import require_engine
from internav_data.records import type_affordances
from internav_data.records.errors import UsageError
from internav_data.render.camera import StaticScene
from internav_data.world import HouseModel
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pyarrow as pa
    from numpy.typing import NDArray

    from internav_data.dataset import Dataset, Manifest
    from internav_data.dataset.select import Filters
    from internav_data.envs.auxiliary import AuxiliaryStart, InteractionKind
    from internav_data.records import Affordance, Episode, House


FIELDS_KEPT: Final = 64
"""Number of distance fields kept for a house, one for each goal."""
HOUSE_CACHE_SIZE: Final = 64
"""Number of houses kept in a process, unless an environment asks for more."""


class ShortestPathField:
    """Euclidean path lengths to one goal without obstacles, computed where they are asked for.

    Parameters
    ----------
    model
        Model of the house.
    goal : (int, int)
        Lattice node.
    """

    __slots__ = ("_goal", "_metres", "_model")

    def __init__(self, model: HouseModel, goal: tuple[int, int]) -> None:
        self._model = model
        self._goal = (SPACING_M * goal[0], SPACING_M * goal[1])
        self._metres = np.full(model.lattice.shape, np.nan)

    def at(self, i: int, j: int) -> float:
        """Return the path length from a node, metres: `World.shortest_path_m`, inf if cut off."""
        known = float(self._metres[i, j])
        if math.isnan(known):
            path = self._model.shortest_path_m((SPACING_M * i, SPACING_M * j), self._goal)
            known = math.inf if path is None else round_m(path)
            self._metres[i, j] = known
        return known


@dataclass(frozen=True, eq=False)
class LoadedHouse:
    """House prepared for episodes: model, camera scene and distance fields."""

    model: HouseModel
    static_scene: StaticScene
    instances: tuple[int, ...]
    """Instance number, among the camera's props, of each movable object of the model."""
    affordances: Mapping[str, Affordance]
    """Affordance of each type that can be handled."""
    _fields: LRUCache[tuple[int, int], ShortestPathField] = field(
        default_factory=lambda: LRUCache(FIELDS_KEPT)
    )

    @staticmethod
    def of(house: House, affordances: Mapping[str, Affordance] | None = None) -> LoadedHouse:
        """Prepare a house; the affordances of types are those of its own assets if not given."""
        model = HouseModel.of(house)
        rows = {placed.object_id: row for row, placed in enumerate(house.objects)}
        if affordances is None:
            affordances = type_affordances(house.assets.values())
        instances = tuple(rows[t] for t in model.object_ids)
        return LoadedHouse(model, StaticScene.of(house), instances, affordances)

    @cached_property
    def raster(self) -> NDArray[np.uint8]:
        """Raster of the house without what can move, (6, a, b) uint8: see `house_raster`."""
        return house_raster(self.model, self.affordances)

    def distance_field(self, goal: tuple[int, int]) -> ShortestPathField:
        """Return the distance field of a goal."""
        return self._fields.get(goal, lambda: ShortestPathField(self.model, goal))


LOADED_HOUSES: Final[LRUCache[tuple[str, str], LoadedHouse]] = LRUCache(HOUSE_CACHE_SIZE)
"""The latest houses by manifest digest and scene id; all environments of a process share them."""


SOURCES_KEPT: Final = 8
"""Number of datasets kept open in a process."""
STARTS_KEPT: Final = 8192
"""Number of episodes of a source whose auxiliary starts are kept."""


class Source:
    """Episodes of a dataset by number and by id, and their houses.

    Parameters
    ----------
    dataset
        Dataset, or a selection of one.

    Raises
    ------
    UsageError
        Nothing is selected.
    MissingEngineError
        The dataset's physics engine is not installed.
    """

    def __init__(self, dataset: Dataset[Episode]) -> None:
        engine = PhysicsConfig.of_dataset(dataset.manifest.config).engine
        require_engine(engine, f"dataset {dataset.path}")
        self.dataset = dataset
        self.auxiliary_starts = lru_cache(STARTS_KEPT)(self._auxiliary_starts)
        if len(dataset) == 0:
            counts = dataset.manifest.counts.items()
            there = ", ".join(f"{name} {count.episodes}" for name, count in counts)
            raise UsageError(
                f"dataset {dataset.path}: no episodes for split={dataset.split!r}, "
                f"filters={dataset.filters!r}; episodes by split: {there}: choose others"
            )

    @cached_property
    def world_config(self) -> WorldConfig:
        """Settings of the world that the dataset's outcomes and experts were made with."""
        return WorldConfig.of_dataset(self.dataset.manifest.config)

    @cached_property
    def _affordances(self) -> Mapping[str, Affordance]:
        return type_affordances(self.dataset.assets.values())

    @cached_property
    def _same_arithmetic(self) -> bool:
        return self.dataset.manifest.hardware == (hardware(),)

    def outcomes_hold(self, config: WorldConfig) -> bool:
        """Return whether this machine finds the stored outcomes, too, with a world's settings."""
        return self._same_arithmetic and config.push_spec == self.world_config.push_spec

    @cached_property
    def bounds(self) -> NDArray[np.int64]:
        """Episode numbers at which a new house begins, and the count: (houses + 1,) int64."""
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
        house = self.dataset.scene(episode.scene_id)
        return LOADED_HOUSES.get(
            (self.dataset.digest, house.scene_id), lambda: LoadedHouse.of(house, self._affordances)
        )

    def _auxiliary_starts(self, number: int, kind: InteractionKind) -> tuple[AuxiliaryStart, ...]:
        """Return the starts of an episode; `auxiliary_starts` keeps the latest ones."""
        episode = self.episode(number)
        model = self.loaded_house(episode).model
        return auxiliary_starts(model, episode, self.dataset.assets, kind)


AGREED: Final = (("agreed", "==", True),)
"""Filters of the episodes on whose outcomes two physics engines agree."""
_SOURCES: Final[LRUCache[str, Source]] = LRUCache(SOURCES_KEPT)


def open_source(
    dataset: str | Path | Dataset[Episode],
    split: str | None = None,
    filters: Filters | None = None,
    *,
    agreed_only: bool = False,
) -> Source:
    """Open a dataset, or return the one that this process has open already.

    A split and filters choose among the episodes of a loaded dataset, too; `agreed_only` leaves
    those on whose outcomes two physics engines agree.

    Raises
    ------
    CorruptDataError
        There is no dataset, or it is damaged.
    UsageError
        An unknown split, column or operator, nothing selected, or `agreed_only` where one engine
        alone was asked.
    MissingEngineError
        The dataset's physics engine is not installed.
    """
    if agreed_only:
        filters = joined(AGREED, filters)
    if not isinstance(dataset, str | Path):
        if dataset.columns is not None:
            raise UsageError(
                f"{dataset!r}: loaded with columns={list(dataset.columns)}: environments need "
                "episodes: load it without columns"
            )
        if agreed_only:
            _check_agreed(dataset.manifest)
        return Source(dataset.select(split, filters))
    store = store_of(folder_to_read(dataset))
    manifest, digest = read_manifest_and_digest(store)
    if agreed_only:
        _check_agreed(manifest)
    place = store.root.resolve() if isinstance(store, FolderStore) else store.at("")
    key = repr((str(place), digest, split, filters))
    return _SOURCES.get(key, lambda: Source(load_dataset(store, split, filters)))


def _check_agreed(manifest: Manifest) -> None:
    if not PhysicsConfig.of_dataset(manifest.config).cross_check:
        raise UsageError(
            "agreed_only: one physics engine alone was asked for this dataset's outcomes; generate "
            "one with --cross-check"
        )
