"""`load_dataset`: episodes as dataclasses, by number or as a stream; columns as tables."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast, overload

import numpy as np

from internav_data.core.extras import require
from internav_data.core.lru import LRUCache
from internav_data.core.storage import FolderStore, Store, StoreLike, store_of
from internav_data.dataset.decode import from_table
from internav_data.dataset.flatten import COLUMNS, FLAT
from internav_data.dataset.location import folder_to_read
from internav_data.dataset.manifest import Manifest, check_file
from internav_data.dataset.row_group_cache import RowGroupCache
from internav_data.dataset.select import Filters, check_columns, joined, matching_rows, read_columns
from internav_data.dataset.snapshot import read_shard, with_manifest
from internav_data.dataset.stream import EpisodeStream
from internav_data.dataset.summary_html import summary_html
from internav_data.dataset.tables import ASSETS, EPISODES, SCENES
from internav_data.records import Asset, Episode, House
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import pandas as pd  # type: ignore[import-untyped,unused-ignore]
    import pyarrow as pa
    from numpy.typing import NDArray

E = TypeVar("E")

MAX_CACHED_HOUSES = 256
_RUN = 64
"""Episodes that iteration reads at once."""


def load_dataset(
    path: StoreLike | None = None,
    split: str | None = None,
    filters: Filters | None = None,
    columns: Sequence[str] | None = None,
) -> Dataset[Any]:
    """Open a finished dataset.

    Parameters
    ----------
    path : str, Path or Store, optional
        Folder that `internav-gen generate` wrote; not given: the folder that the environment
        variable INTERNAV_DATASET names, else `internav-dataset` in the current directory.
        "mini" is a small dataset that ships with the package.
    split : str, optional
        train, val or test; all of them if not given. The files of other splits need not be there,
        nor the assets until a house is asked for.
    filters : list of (column, operator, value), optional
        Episodes to keep, on top-level columns, as in `[("room_count", ">=", 4)]`: all must hold.
        A list of such lists is a choice between them. Operators: = == != < > <= >= in, not in;
        is and is not, with None, on nested columns too: `[("expert", "is not", None)]`.
    columns : list of str, optional
        Read these columns only: items are then dictionaries by column instead of `Episode`.

    Raises
    ------
    CorruptDataError
        No dataset, unfinished, of a newer version, or a file is missing, truncated or edited.
    UsageError
        An unknown split, column or operator.

    Examples
    --------
    >>> load_dataset("mini", split="val")[0].episode_id
    'scene-000000/0000'

    """
    store = path if isinstance(path, Store) else folder_to_read(path)
    return Dataset(store, split, filters, columns)


class Dataset(Generic[E]):
    """Episodes by number: `len(ds)`, `ds[i]`, `ds[a:b]`, iteration; houses by scene.

    Pickled by its path and manifest and opened again where it is unpickled, so it goes into
    DataLoader workers. While a generator extends the dataset, an open one keeps the episodes that
    it began with; load it again for the new ones.
    """

    def __init__(
        self,
        path: StoreLike,
        split: str | None = None,
        filters: Filters | None = None,
        columns: Sequence[str] | None = None,
    ) -> None:
        # Files are opened when they are first read: the folder must be found then too.
        store = store_of(path)
        if isinstance(store, FolderStore):
            store = FolderStore(store.root.absolute())
        self.store: Store = store
        self.split, self.filters = split, filters
        self.columns = None if columns is None else tuple(columns)
        with_manifest(self.store, self._open_checked)

    def _open_checked(self, manifest: Manifest, digest: str) -> None:
        """Open the manifest in place, whose files are all there, or all of the split's own."""
        if self.split is not None and self.split not in manifest.counts:
            raise UsageError(
                f"split: expected one of {sorted(manifest.counts)}, got {self.split!r}"
            )
        if self.columns is not None:
            check_columns(self.columns, EPISODES)
        for file in manifest.files:
            if self.split in {None, file.split}:
                check_file(self.store, file)
        self._open(manifest, digest)

    def _open(self, manifest: Manifest, digest: str) -> None:
        self.manifest = manifest
        self.digest = digest
        """SHA-256 of the manifest's file."""
        self._files = manifest.of("episodes", self.split)
        self.row_group_cache = RowGroupCache(self.store, self._files, EPISODES, self.columns)
        self._houses: LRUCache[str, House] = LRUCache(MAX_CACHED_HOUSES)
        self._index: NDArray[np.int64] | None = None
        if self.filters is not None:
            self._index = matching_rows(self.store, self._files, self.filters)

    def __getstate__(self) -> dict[str, Any]:
        names = ("store", "split", "filters", "columns", "manifest", "digest")
        return {name: getattr(self, name) for name in names}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name in ("store", "split", "filters", "columns"):
            setattr(self, name, state[name])
        # Not the manifest in place, which may hold more episodes by now than samplers know of.
        self._open(state["manifest"], state["digest"])

    def __repr__(self) -> str:
        chosen = f", split={self.split!r}" if self.split else ""
        part = self.manifest.part
        range_ = f", part {part.first_scene}:{part.end_scene}" if part else ""
        return f"Dataset({self.store.at('')!r}{chosen}{range_}, {len(self)} episodes)"

    def _repr_html_(self) -> str:
        """Return the dataset's statistics for a notebook."""
        return summary_html(repr(self), self.store, self.manifest)

    @property
    def path(self) -> Path:
        """Folder of the dataset, absolute."""
        return Path(self.store.at(""))

    @property
    def fingerprint(self) -> str:
        """Digest of the selection of episodes, for states; it changes whenever the order would."""
        selection = repr((self.digest, self.split, self.filters, self.columns))
        return hashlib.sha256(selection.encode()).hexdigest()[:16]

    def __len__(self) -> int:
        return len(self.row_group_cache) if self._index is None else len(self._index)

    @overload
    def __getitem__(self, item: int) -> E: ...

    @overload
    def __getitem__(self, item: slice) -> list[E]: ...

    def __getitem__(self, item: int | slice | str) -> E | list[E]:
        if isinstance(item, slice):
            return self.__getitems__(range(*item.indices(len(self))))
        if isinstance(item, str):
            raise UsageError(
                f"episode {item!r}: episodes are numbered; load the one with this id by "
                f"filters=[('episode_id', '=', {item!r})]"
            )
        number = int(item)
        if not -len(self) <= number < len(self):
            raise IndexError(f"episode {number} of {len(self)}")
        return cast("E", self.row_group_cache.row(self._row(number % len(self))))

    def __getitems__(self, numbers: Sequence[int]) -> list[E]:
        """Return several episodes, as torch's DataLoader asks for a batch."""
        return list(self._run([self._row(int(number)) for number in numbers]))

    def __iter__(self) -> Iterator[E]:
        for start in range(0, len(self), _RUN):
            stop = min(start + _RUN, len(self))
            yield from self._run([self._row(number) for number in range(start, stop)])

    def _run(self, rows: Sequence[int]) -> Iterator[E]:
        """Read rows of the files, neighbours in one go."""
        start = 0
        while start < len(rows):
            first, end, reader = self.row_group_cache.group_of(rows[start])
            stop = start + 1
            while stop < len(rows) and rows[stop] == rows[stop - 1] + 1 and rows[stop] < end:
                stop += 1
            yield from reader.rows(rows[start] - first, rows[stop - 1] + 1 - first)
            start = stop

    def _row(self, number: int) -> int:
        return number if self._index is None else int(self._index[number])

    def limit_caches(self, row_group_bytes: float, files: int, houses: int) -> None:
        """Bound what stays in memory for the next reader: for a server, or many workers.

        Parameters
        ----------
        row_group_bytes
            Bytes of decoded row groups, of each table.
        files
            Number of open files, of each table; the footer of one takes 2 MB.
        houses
            Number of houses.
        """
        self.row_group_cache.limit(row_group_bytes, files)
        if "_scenes" in self.__dict__:
            self._scenes[0].limit(row_group_bytes, files)
        self._houses.capacity = houses

    def select(self, split: str | None = None, filters: Filters | None = None) -> Dataset[E]:
        """Return the episodes among these that are of a split and for which filters hold.

        Raises
        ------
        UsageError
            These are another split's, or there is no such split, column or operator.

        """
        if split is not None and self.split not in {None, split}:
            raise UsageError(
                f"split: expected {self.split!r} (or none), as the dataset was loaded with it, "
                f"got {split!r}: load the dataset with that split"
            )
        if split in {None, self.split} and filters is None:
            return self
        both = filters if self.filters is None else joined(self.filters, filters)
        return Dataset(self.store, split or self.split, both, self.columns)

    def row_numbers(self, numbers: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the rows, among all of the split's files, of selected episodes: (n,) int64."""
        return numbers if self._index is None else self._index[numbers]

    def blocks(self) -> NDArray[np.int64]:
        """Return the numbers of episodes that begin row groups, and of all episodes: (n,) int64."""
        bounds = self.row_group_cache.all_bounds()
        if self._index is not None:
            bounds = np.searchsorted(self._index, bounds)
        return np.unique(np.concatenate([[0], bounds])).astype(np.int64)

    def iterable(
        self,
        *,
        seed: int = 0,
        epoch: int = 0,
        shuffle: bool = True,
        rank: int = 0,
        world_size: int = 1,
        drop_last: bool | None = False,
        worker_id: int | None = None,
        num_workers: int | None = None,
    ) -> EpisodeStream:
        """Return a stream over one rank's share of the episodes (see `EpisodeStream`).

        Parameters
        ----------
        seed, epoch
            Seed and number of the epoch, on which alone the order depends.
        shuffle
            Whether to shuffle; False keeps the order on disk.
        rank, world_size
            Rank of this process and number of ranks, each of which reads equally many episodes.
        drop_last
            False repeats up to `world_size` - 1 episodes for that, True leaves as many out; None
            reads each once, and ranks' lengths differ by one at most.
        worker_id, num_workers
            Share of the rank's share; as torch's DataLoader says where not given.

        Raises
        ------
        UsageError
            A rank or worker is out of its range.

        """
        return EpisodeStream(
            self,
            seed=seed,
            epoch=epoch,
            shuffle=shuffle,
            rank=rank,
            world_size=world_size,
            drop_last=drop_last,
            worker_id=worker_id,
            num_workers=num_workers,
        )

    @functools.cached_property
    def assets(self) -> Mapping[str, Asset]:
        """Every asset of the dataset by its id."""
        (file,) = self.manifest.of("assets")
        table = read_shard(self.store, file, ASSETS)
        return {asset.asset_id: asset for asset in from_table(table, ASSETS)}

    @functools.cached_property
    def _scenes(self) -> tuple[RowGroupCache, dict[str, int]]:
        files = self.manifest.of("scenes", self.split)
        cache = RowGroupCache(
            self.store,
            files,
            SCENES,
            extra=lambda: {"assets": self.assets},
            max_bytes=self.row_group_cache.max_bytes,
            max_files=self.row_group_cache.max_files,
        )
        ids = read_columns(self.store, files, SCENES, ["scene_id"])["scene_id"].to_pylist()
        return cache, {scene_id: row for row, scene_id in enumerate(ids)}

    @property
    def scene_ids(self) -> tuple[str, ...]:
        """The ids of all scenes of the split, in order."""
        files = self.manifest.of("scenes", self.split)
        return tuple(read_columns(self.store, files, SCENES, ["scene_id"])["scene_id"].to_pylist())

    def scene(self, scene_id: str) -> House:
        """Return a house with its assets.

        Raises
        ------
        UsageError
            No such scene in the split.

        """
        cache, rows = self._scenes
        if scene_id not in rows:
            place = f"{self.path}: split {self.split}" if self.split else self.path
            raise UsageError(
                f"{place}: no scene {scene_id!r} among its {len(rows)} (ids look like scene-000017)"
            )
        return self._houses.get(scene_id, lambda: cast("House", cache.row(rows[scene_id])))

    def to_table(self, columns: Sequence[str] | str | None = None) -> pa.Table:
        """Return the selected episodes as an Arrow table of the given (or all) columns.

        Parameters
        ----------
        columns
            Columns of episodes; or "obstacles" or "outcomes": a flat table of these, one row each
            (`internav_data.dataset.flatten`).

        Raises
        ------
        UsageError
            There is no such column or flat table.
        """
        if isinstance(columns, str):
            if columns not in FLAT:
                raise UsageError(
                    f"columns: expected a list of them, or one of {sorted(FLAT)}, got {columns!r}"
                )
            return FLAT[columns](self.to_table(COLUMNS))
        names = _first(columns, self.columns, EPISODES.schema.names)
        check_columns(names, EPISODES)
        table = read_columns(self.store, self._files, EPISODES, names)
        return table if self._index is None else table.take(self._index)

    def to_pandas(self, columns: Sequence[str] | str | None = None) -> pd.DataFrame:
        """Return the selected episodes as a pandas frame: scalar columns unless named.

        Parameters
        ----------
        columns
            Columns, or a flat table by name, see `to_table`.

        Raises
        ------
        UsageError
            There is no such column or flat table.
        ModuleNotFoundError
            pandas is not installed.
        """
        require("pandas")
        if not isinstance(columns, str):
            columns = _first(columns, self.columns, scalar_columns())
        return self.to_table(columns).to_pandas()

    def to_torch(self, columns: Sequence[str] | None = None) -> dict[str, Any]:
        """Return scalar columns as torch tensors by name.

        Words of a fixed choice become their number (mode: 0 blocked, 1 lengthened; split: 0
        train, 1 val, 2 test), other words are left out. Missing floats are NaN, integers -1; truth
        values that can be missing (agreed) are 1, 0 and -1, int8.
        """
        from internav_data.dataset.tensors import tensors  # noqa: PLC0415 - torch when used

        names = _first(columns, self.columns, scalar_columns())
        return tensors(self.to_table([name for name in names if name in scalar_columns()]))


def _first(*choices: Sequence[str] | None) -> Sequence[str]:
    """Return the first choice of columns that was made; an empty one is one."""
    return next(choice for choice in choices if choice is not None)


def scalar_columns() -> tuple[str, ...]:
    """Return the names of the episode columns that hold one value a row."""
    from internav_data.dataset.nodes import Leaf  # noqa: PLC0415

    return tuple(field.name for field in EPISODES.node.fields if isinstance(field.node, Leaf))


__all__ = ["Dataset", "Episode", "load_dataset"]
