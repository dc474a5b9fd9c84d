"""Where environments get their episodes: a dataset, opened once a process."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

from internav_data.dataset import load_dataset
from internav_data.dataset.manifest import MANIFEST
from internav_data.envs.order import EpisodeOrder, scene_bounds
from internav_data.envs.places import PLACES
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    import numpy as np
    import pyarrow as pa
    from numpy.typing import NDArray

    from internav_data.dataset import Dataset
    from internav_data.envs.places import Place
    from internav_data.records import Episode
    from internav_data.world import PushModel

SOURCES_KEPT: Final = 8


class Source:
    """Episodes by number and by id, and the places they happen in."""

    def __init__(self, dataset: Dataset[Episode], digest: str) -> None:
        self.dataset, self._digest = dataset, digest
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

    def order(self, seed: int, *, stay: int, shuffle: bool) -> EpisodeOrder:
        """Return the order of episodes of a seed."""
        return EpisodeOrder(self.bounds, seed, stay=stay, shuffle=shuffle)

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

    def place(self, episode: Episode) -> Place:
        """Return the place of an episode."""
        return PLACES.of(self._digest, self.dataset.scene(episode.scene_id))


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
