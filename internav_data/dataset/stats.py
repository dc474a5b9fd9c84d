"""What a dataset is like, from its columns alone: the paper's Table 2 and more."""

from __future__ import annotations

from collections.abc import Mapping  # noqa: TC003 - read at run time for the JSON Schema
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from internav_data.dataset.manifest import Manifest, open_file, read_manifest
from internav_data.dataset.parquet import read_all
from internav_data.dataset.tables import EPISODES

if TYPE_CHECKING:
    from numpy.typing import NDArray

_STEP_M = 0.25  # of the lattice: the distance of Table 2 counts its steps
_SCALARS = (
    *("scene_id", "split", "room_count", "mode", "sealed", "rooms_on_way"),
    *("obstacle_count", "clear_m", "clear_steps", "way_m", "steps"),
)
_OBSTACLES = tuple(f"obstacles.list.element.{n}" for n in ("type", "pushable", "pickable"))
_DIGITS = 6


@dataclass(frozen=True, slots=True)
class PaperRow:
    """A row of Table 2 as the paper prints it."""

    ratio: float
    obstacle_num: float
    distance_m: float
    cross_room_num: float


@dataclass(frozen=True, slots=True)
class RoomsRow:
    """A row of Table 2: episodes in houses of some numbers of rooms."""

    rooms: str
    scenes: int
    episodes: int
    ratio: float
    """Share of all episodes."""
    obstacle_num: float
    """Mean number of spawned obstacles."""
    distance_m: float
    """Mean of 0.25 m x clear_steps."""
    cross_room_num: float
    """Mean number of rooms on the shortest room path."""
    blocked: int
    sealed: int
    """Blocked ones that let nothing through off the lattice either."""
    paper: PaperRow


@dataclass(frozen=True, slots=True)
class Spread:
    """The spread of one figure over all episodes; zeros without any."""

    least: float
    median: float
    mean: float
    most: float


@dataclass(frozen=True, slots=True)
class Stats:
    """Statistics of a dataset or of one of its splits."""

    scenes: int
    episodes: int
    splits: Mapping[str, int]
    """Episodes by split."""
    table2: tuple[RoomsRow, ...]
    modes: Mapping[str, int]
    """Episodes by mode."""
    sealed: int
    sealed_share_of_blocked: float
    room_count: Mapping[str, int]
    """Episodes by number of rooms."""
    obstacle_count: Mapping[str, int]
    """Episodes by number of obstacles."""
    obstacle_types: Mapping[str, int]
    obstacles_pushable: int
    obstacles_pickable: int
    obstacles_fixed: int
    clear_m: Spread
    clear_steps: Spread
    detour_steps: Spread
    """Further steps of lengthened episodes: steps - clear_steps."""
    redraws: Mapping[str, int]
    """How often something was drawn again while generating, by reason."""
    quarantined: int


PAPER = {
    (1, 2): PaperRow(0.39, 2.05, 5.45, 1.44),
    (3, 5): PaperRow(0.423, 3.37, 9.92, 2.5),
    (6, 10): PaperRow(0.187, 4.58, 14.67, 3.29),
}
"""Table 2 of the paper, by number of rooms."""


def compute_stats(dataset: Any, split: str | None = None) -> dict[str, Any]:  # noqa: ANN401
    """Return the statistics of a dataset as a dictionary that JSON can hold (see `Stats`).

    Parameters
    ----------
    dataset : Dataset, str or Path
        An open dataset (its split is taken; filters are not) or the folder of one.
    split : str, optional
        Of this split only.

    Raises
    ------
    CorruptDataError
        A file is missing or damaged.

    """
    root = Path(getattr(dataset, "path", dataset))
    chosen = split or getattr(dataset, "split", None)
    return asdict(stats_of(root, read_manifest(root), chosen))


def stats_of(root: Path, manifest: Manifest, split: str | None = None) -> Stats:
    """Return the statistics of the files that a manifest names."""
    names = [*_SCALARS, *_OBSTACLES]
    parts = []
    for file in manifest.of("episodes", split):
        with open_file(root, file, EPISODES) as opened:
            parts.append(_flat(read_all(root / file.path, opened, names)))
    table = pa.concat_tables([p[0] for p in parts]) if parts else _no_rows()
    kinds = pa.concat_tables([p[1] for p in parts]) if parts else _no_obstacles()
    return _stats(table, kinds, manifest, split)


def _flat(table: pa.Table) -> tuple[pa.Table, pa.Table]:
    """Part a file's columns into those of episodes and those of obstacles."""
    names = _no_obstacles().schema.names
    chunks = [chunk.flatten().flatten() for chunk in table.column("obstacles").chunks]
    obstacles = [pa.table(dict(zip(names, chunk, strict=True))) for chunk in chunks]
    return table.select(list(_SCALARS)), pa.concat_tables([_no_obstacles(), *obstacles])


def _no_rows() -> pa.Table:
    return pa.schema([EPISODES.schema.field(name) for name in _SCALARS]).empty_table()


def _no_obstacles() -> pa.Table:
    types = {"type": pa.string(), "pushable": pa.bool_(), "pickable": pa.bool_()}
    return pa.schema(types).empty_table()


def _stats(table: pa.Table, kinds: pa.Table, manifest: Manifest, split: str | None) -> Stats:
    rooms = table.column("room_count").to_numpy()
    blocked = pc.equal(table.column("mode"), "blocked").to_numpy()
    sealed = table.column("sealed").to_numpy()
    detours = pc.subtract(table.column("steps"), table.column("clear_steps"))
    longer = detours.filter(pc.equal(table.column("mode"), "lengthened")).drop_null()
    push, pick = (kinds.column(name).to_numpy().astype(bool) for name in ("pushable", "pickable"))
    counts = {k: v for k, v in manifest.counts.items() if split in (None, k)}
    return Stats(
        scenes=sum(count.scenes for count in counts.values()),
        episodes=table.num_rows,
        splits={name: count.episodes for name, count in counts.items()},
        table2=tuple(_rooms_row(table, rooms, blocked, sealed, span) for span in PAPER),
        modes={"blocked": int(blocked.sum()), "lengthened": int((~blocked).sum())},
        sealed=int(sealed.sum()),
        sealed_share_of_blocked=_mean(sealed[blocked]),
        room_count=_counts(table.column("room_count")),
        obstacle_count=_counts(table.column("obstacle_count")),
        obstacle_types=_counts(kinds.column("type")),
        obstacles_pushable=int(push.sum()),
        obstacles_pickable=int(pick.sum()),
        obstacles_fixed=int((~(push | pick)).sum()),
        clear_m=_spread(table.column("clear_m").to_numpy()),
        clear_steps=_spread(table.column("clear_steps").to_numpy()),
        detour_steps=_spread(longer.to_numpy()),
        redraws=dict(manifest.redraws),
        quarantined=len(manifest.quarantined),
    )


def _rooms_row(
    table: pa.Table,
    rooms: NDArray[Any],
    blocked: NDArray[Any],
    sealed: NDArray[Any],
    span: tuple[int, int],
) -> RoomsRow:
    chosen = (rooms >= span[0]) & (rooms <= span[1])
    part = table.filter(pa.array(chosen))
    return RoomsRow(
        rooms=f"{span[0]}-{span[1]}",
        scenes=len(pc.unique(part.column("scene_id"))),
        episodes=part.num_rows,
        ratio=_mean(chosen),
        obstacle_num=_mean(part.column("obstacle_count").to_numpy()),
        distance_m=_mean(_STEP_M * part.column("clear_steps").to_numpy()),
        cross_room_num=_mean(part.column("rooms_on_way").to_numpy()),
        blocked=int((chosen & blocked).sum()),
        sealed=int((chosen & sealed).sum()),
        paper=PAPER[span],
    )


def _mean(values: NDArray[Any]) -> float:
    return round(float(values.mean()), _DIGITS) if len(values) else 0.0


def _spread(values: NDArray[Any]) -> Spread:
    if not len(values):
        return Spread(0.0, 0.0, 0.0, 0.0)
    figures = (values.min(), np.median(values), values.mean(), values.max())
    return Spread(*(round(float(figure), _DIGITS) for figure in figures))


def _counts(column: pa.ChunkedArray) -> dict[str, int]:
    pairs = [(c["values"], c["counts"]) for c in pc.value_counts(column).to_pylist()]
    return {str(value): count for value, count in sorted(pairs)}
