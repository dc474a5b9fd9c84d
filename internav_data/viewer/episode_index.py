"""Columns of all episodes that a gallery filters by, in arrays: 30 bytes an episode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pyarrow as pa

from internav_data.dataset.snapshot import read_shard
from internav_data.dataset.tables import EPISODES
from internav_data.viewer.episode_filter import MODES, SPLITS, EpisodeFilter

if TYPE_CHECKING:
    from collections.abc import Iterator

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
    """Types of obstacles, ascending."""
    types: NDArray[np.uint64]
    """Bit t of word w: an obstacle is of type 64 w + t of `type_names`, (n, words)."""

    def __len__(self) -> int:
        return len(self.scenes)

    @staticmethod
    def read(store: Store, manifest: Manifest) -> EpisodeIndex:
        """Read the columns of all episodes that a manifest names.

        Raises
        ------
        CorruptDataError
            A file is missing, truncated or damaged.
        """
        return _Reader(store).read(manifest.of("episodes"))

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
            "types": [
                name
                for t, name in enumerate(self.type_names)
                if int(self.types[row, t // _WORD]) >> (t % _WORD) & 1
            ],
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
        return {
            name: int(np.count_nonzero(types[:, t // _WORD] & np.uint64(1 << t % _WORD)))
            for t, name in enumerate(self.type_names)
        }


def _numbers(values: NDArray[Any]) -> dict[str, int]:
    return {str(k): int(n) for k, n in enumerate(np.bincount(values)) if n} if len(values) else {}


def _words(values: NDArray[np.int8], words: tuple[str, ...]) -> dict[str, int]:
    counts = np.bincount(values, minlength=len(words))
    return {word: int(count) for word, count in zip(words, counts, strict=True)}


def _histogram(values: NDArray[np.float64]) -> dict[str, int]:
    """Return the number of values in bins of 1 m, by the bin's lower bound."""
    return _numbers(np.floor(values).astype(np.int64))


class _Reader:
    """Reader of the columns, file by file: no more than one file's are in memory twice."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._scenes: dict[str, int] = {}
        self._types: dict[str, int] = {}

    def read(self, files: tuple[DataFile, ...]) -> EpisodeIndex:
        parts = [self._part(file) for file in files]
        columns = {
            name: np.concatenate([part[name] for part in parts] or [np.zeros(0, kind)])
            for name, kind in _KINDS.items()
        }
        names = sorted(self._types)
        return EpisodeIndex(
            scene_names=tuple(self._scenes),
            type_names=tuple(names),
            types=self._joined([part["types"] for part in parts], names),
            **columns,
        )

    def _part(self, file: DataFile) -> dict[str, NDArray[Any]]:
        table = read_shard(self._store, file, EPISODES, _NAMES)
        return {
            "scenes": _codes(table["scene_id"], self._scenes),
            "numbers": _values(table["index"], np.int32),
            "splits": _codes(table["split"], {word: k for k, word in enumerate(SPLITS)}),
            "rooms": _values(table["room_count"], np.int16),
            "modes": _codes(table["mode"], {word: k for k, word in enumerate(MODES)}),
            "sealed": _values(table["sealed"], np.bool_),
            "obstacles": _values(table["obstacle_count"], np.int16),
            "distances_m": _values(table["shortest_path_m"], np.float64),
            "types": self._type_bits(table["obstacles"]),
        }

    def _type_bits(self, column: pa.ChunkedArray) -> NDArray[np.uint64]:
        """Return a bit for each type that is there, numbered as they are met: (n, words)."""
        parts = []
        for chunk in column.chunks:
            counts = chunk.value_lengths().to_numpy(zero_copy_only=False)
            names = chunk.flatten().field("type")
            codes = _codes(pa.chunked_array([names]), self._types)
            owners = np.repeat(np.arange(len(counts)), counts)
            bits = np.zeros((len(counts), max(1, -(-len(self._types) // _WORD))), np.uint64)
            one = np.uint64(1) << (codes % _WORD).astype(np.uint64)
            np.bitwise_or.at(bits, (owners, codes // _WORD), one)
            parts.append(bits)
        return _stacked(parts)

    def _joined(self, parts: list[NDArray[np.uint64]], names: list[str]) -> NDArray[np.uint64]:
        """Return the bits of all files, renumbered by the sorted names: (n, words)."""
        met = _stacked(parts)
        bits = np.zeros((len(met), max(1, -(-len(names) // _WORD))), np.uint64)
        for t, name in enumerate(names):
            word, bit = divmod(self._types[name], _WORD)
            there = (met[:, word] >> np.uint64(bit)) & np.uint64(1)
            bits[:, t // _WORD] |= there << np.uint64(t % _WORD)
        return bits


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


def _stacked(parts: list[NDArray[np.uint64]]) -> NDArray[np.uint64]:
    """Return bits of several tables below each other, padded to the most words."""
    words = max((part.shape[1] for part in parts), default=1)
    padded = [np.pad(part, ((0, 0), (0, words - part.shape[1]))) for part in parts]
    return np.concatenate(padded or [np.zeros((0, words), np.uint64)])


def _values(column: pa.ChunkedArray, kind: type[np.generic]) -> NDArray[Any]:
    values: NDArray[Any] = column.to_numpy()
    return values.astype(kind)


def _codes(column: pa.ChunkedArray, known: dict[str, int]) -> NDArray[Any]:
    """Return the number of each word, (n,) int32 (int8 for few); new words take the next one."""
    parts = []
    for chunk in column.chunks:
        encoded = chunk.dictionary_encode()
        words = [known.setdefault(word, len(known)) for word in encoded.dictionary.to_pylist()]
        numbers = np.array(words, np.int32)
        parts.append(numbers[encoded.indices.to_numpy(zero_copy_only=False)])
    return np.concatenate(parts or [np.zeros(0, np.int32)])
