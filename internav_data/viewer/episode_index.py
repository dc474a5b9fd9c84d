"""Columns of all episodes that a gallery filters by, in arrays: 31 bytes an episode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.dataset.snapshot import read_shard
from internav_data.dataset.tables import EPISODES
from internav_data.records.errors import InternavError
from internav_data.viewer.episode_filter import MODES, SPLITS, EpisodeFilter

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    import pyarrow as pa
    from numpy.typing import NDArray

    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import DataFile, Manifest

    Rows = NDArray[np.int64]
    Mask = NDArray[np.bool_]

_TYPE: Final = "obstacles.list.element.type"
_NAMES: Final = (
    *("scene_id", "index", "split", "room_count", "mode", "sealed", "obstacle_count"),
    *("shortest_path_m", _TYPE),
)
_WORD: Final = 64
"""Types of obstacles in one word of `EpisodeIndex.types`."""


@dataclass(frozen=True, slots=True, eq=False)
class EpisodeIndex:
    """Columns (n,) of all episodes, in the order of the dataset's rows."""

    scene_names: tuple[str, ...]
    """Ids of the scenes, ascending by their first row."""
    scenes: NDArray[np.int32]
    """Number of each episode's scene among `scene_names`, (n,)."""
    numbers: NDArray[np.int32]
    """Number of each episode within its scene, (n,)."""
    splits: NDArray[np.int8]
    """Number among `SPLITS`, (n,)."""
    rooms: NDArray[np.int16]
    """Number of rooms of the house, (n,)."""
    modes: NDArray[np.int8]
    """Number among `MODES`, (n,)."""
    sealed: NDArray[np.bool_]
    """Whether the disc has no path on or off the lattice, (n,)."""
    obstacles: NDArray[np.int16]
    """Number of obstacles, (n,)."""
    distances_m: NDArray[np.float64]
    """Euclidean distance from start to goal without obstacles, metres, (n,)."""
    type_names: tuple[str, ...]
    """Types of obstacles, in the order of their bits."""
    types: NDArray[np.uint64]
    """Bit t of word w: an obstacle is of type 64 w + t of `type_names`, (n, words)."""

    def __len__(self) -> int:
        return len(self.scenes)

    @staticmethod
    def read(
        store: Store, manifest: Manifest, ended: Callable[[], bool] = lambda: False
    ) -> EpisodeIndex:
        """Read the columns of all episodes that a manifest names.

        Parameters
        ----------
        store
            Folder of the dataset.
        manifest
            Manifest of the dataset.
        ended
            Function that says before each file whether the columns are needed no more.

        Raises
        ------
        CorruptDataError
            A file is missing, truncated or damaged.
        InternavError
            The columns are needed no more.
        """
        return _Reader(store, manifest.of("episodes")).read(ended)

    def row_of(self, scene_id: str, number: int) -> int | None:
        """Return the row of an episode by its scene and number; None where there is none."""
        if scene_id not in self.scene_names:
            return None
        scene = self.scene_names.index(scene_id)
        found = np.flatnonzero((self.scenes == scene) & (self.numbers == number))
        return int(found[0]) if len(found) else None

    def select(self, chosen: EpisodeFilter) -> Rows:
        """Return the rows of the episodes that a filter keeps, in its order: (k,) int64."""
        kept = np.ones(len(self), np.bool_)
        for _, mask in self._masks(chosen):
            kept &= mask
        rows = np.flatnonzero(kept)
        if chosen.order == "longest":
            return rows[np.argsort(-self.distances_m[rows], kind="stable")]
        if chosen.order == "obstacles":
            return rows[np.argsort(-self.obstacles[rows], kind="stable")]
        return rows

    def counts(self, chosen: EpisodeFilter) -> dict[str, dict[str, int]]:
        """Return the number of episodes by value of each column.

        A column's own condition is left out, so that the numbers say what another choice would
        give.
        """
        masks = dict(self._masks(chosen))

        def kept(own: str) -> Mask:
            mask = np.ones(len(self), np.bool_)
            for name, other in masks.items():
                if name != own:
                    mask &= other
            return mask

        return {
            "rooms": _numbers(self.rooms[kept("rooms")]),
            "mode": _words(self.modes[kept("mode")], MODES),
            "sealed": _words(self.sealed[kept("sealed")].astype(np.int8), ("no", "yes")),
            "split": _words(self.splits[kept("split")], SPLITS),
            "obstacles": _numbers(self.obstacles[kept("obstacles")]),
            "types": self._type_counts(kept("types")),
            "distance": _histogram(self.distances_m[kept("distance")]),
        }

    def summary(self, row: int) -> dict[str, Any]:
        """Return what a gallery says of an episode."""
        return {
            "scene_id": self.scene_names[self.scenes[row]],
            "index": int(self.numbers[row]),
            "split": SPLITS[self.splits[row]],
            "rooms": int(self.rooms[row]),
            "mode": MODES[self.modes[row]],
            "sealed": bool(self.sealed[row]),
            "obstacles": int(self.obstacles[row]),
            "distance": round(float(self.distances_m[row]), 4),
            "types": sorted(
                name
                for t, name in enumerate(self.type_names)
                if int(self.types[row, t // _WORD]) >> (t % _WORD) & 1
            ),
        }

    def _masks(self, chosen: EpisodeFilter) -> Iterator[tuple[str, Mask]]:
        """Yield the mask (n,) of each condition."""
        if chosen.rooms:
            yield "rooms", np.isin(self.rooms, sorted(chosen.rooms))
        if chosen.modes:
            yield "mode", np.isin(self.modes, [MODES.index(word) for word in chosen.modes])
        if chosen.sealed is not None:
            yield "sealed", self.sealed == chosen.sealed
        if chosen.splits:
            yield "split", np.isin(self.splits, [SPLITS.index(word) for word in chosen.splits])
        if chosen.obstacles is not None:
            low, high = chosen.obstacles
            yield "obstacles", (self.obstacles >= low) & (self.obstacles <= high)
        if chosen.distance is not None:
            near, far = chosen.distance
            yield "distance", (self.distances_m >= near) & (self.distances_m <= far)
        if chosen.types:
            yield "types", self._of_types(chosen.types)

    def _of_types(self, names: frozenset[str]) -> Mask:
        """Return the mask (n,) of episodes with an obstacle of one of the types."""
        wanted = np.zeros(self.types.shape[1], np.uint64)
        for t, name in enumerate(self.type_names):
            if name in names:
                wanted[t // _WORD] |= np.uint64(1 << t % _WORD)
        return np.asarray((self.types & wanted).any(axis=1))

    def _type_counts(self, kept: Mask) -> dict[str, int]:
        types = self.types[kept]
        counts = {
            name: int(np.count_nonzero(types[:, t // _WORD] & np.uint64(1 << t % _WORD)))
            for t, name in enumerate(self.type_names)
        }
        return dict(sorted(counts.items()))


def _numbers(values: NDArray[Any]) -> dict[str, int]:
    return {str(k): int(n) for k, n in enumerate(np.bincount(values)) if n} if len(values) else {}


def _words(values: NDArray[np.int8], words: tuple[str, ...]) -> dict[str, int]:
    counts = np.bincount(values, minlength=len(words))
    return {word: int(count) for word, count in zip(words, counts, strict=True)}


def _histogram(values: NDArray[np.float64]) -> dict[str, int]:
    """Return the number of values in bins of 1 m, by the bin's lower bound."""
    return _numbers(np.floor(values).astype(np.int64))


_KINDS: Final[dict[str, type[np.generic]]] = {
    "scenes": np.int32,
    "numbers": np.int32,
    "splits": np.int8,
    "rooms": np.int16,
    "modes": np.int8,
    "sealed": np.bool_,
    "obstacles": np.int16,
    "distances_m": np.float64,
}


class _Reader:
    """Reader of the columns, file by file, into arrays for all episodes."""

    def __init__(self, store: Store, files: tuple[DataFile, ...]) -> None:
        self._store, self._files = store, files
        total = sum(file.rows for file in files)
        self._columns = {name: np.zeros(total, kind) for name, kind in _KINDS.items()}
        self._types = np.zeros((total, 1), np.uint64)
        self._scene_codes: dict[str, int] = {}
        self._type_codes: dict[str, int] = {}

    def read(self, ended: Callable[[], bool]) -> EpisodeIndex:
        first = 0
        for file in self._files:
            if ended():
                raise InternavError("the page was ended while the columns were read; start it anew")
            self._read_file(file, first)
            first += file.rows
        return EpisodeIndex(
            scene_names=tuple(self._scene_codes),
            type_names=tuple(self._type_codes),
            types=self._types,
            **self._columns,
        )

    def _read_file(self, file: DataFile, first: int) -> None:
        table = read_shard(self._store, file, EPISODES, _NAMES)
        rows = slice(first, first + file.rows)
        for name, column in (
            ("numbers", "index"),
            ("rooms", "room_count"),
            ("sealed", "sealed"),
            ("obstacles", "obstacle_count"),
            ("distances_m", "shortest_path_m"),
        ):
            self._columns[name][rows] = table[column].to_numpy()
        for name, column, known in (
            ("scenes", "scene_id", self._scene_codes),
            ("splits", "split", {word: number for number, word in enumerate(SPLITS)}),
            ("modes", "mode", {word: number for number, word in enumerate(MODES)}),
        ):
            self._columns[name][rows] = _codes(table[column].chunks, known)
        for chunk in table["obstacles"].chunks:
            self._read_types(chunk, first)
            first += len(chunk)

    def _read_types(self, chunk: pa.ListArray, first: int) -> None:
        """Set a bit for each type that is there, numbered as they are met."""
        counts = chunk.value_lengths().to_numpy(zero_copy_only=False)
        codes = _codes([chunk.flatten().field("type")], self._type_codes)
        missing = -(-len(self._type_codes) // _WORD) - self._types.shape[1]
        if missing > 0:
            self._types = np.pad(self._types, ((0, 0), (0, missing)))
        owners = first + np.repeat(np.arange(len(counts)), counts)
        bits = np.uint64(1) << (codes % _WORD).astype(np.uint64)
        np.bitwise_or.at(self._types, (owners, codes // _WORD), bits)


def _codes(chunks: Sequence[pa.Array], known: dict[str, int]) -> NDArray[np.int32]:
    """Return the number of each word, (n,); new words take the next one."""
    parts = []
    for chunk in chunks:
        encoded = chunk.dictionary_encode()
        words = [known.setdefault(word, len(known)) for word in encoded.dictionary.to_pylist()]
        numbers = np.array(words, np.int32)
        parts.append(numbers[encoded.indices.to_numpy(zero_copy_only=False)])
    return np.concatenate(parts or [np.zeros(0, np.int32)])
