"""Statistics of a dataset, from its columns alone: the paper's Table 2 and more."""

from __future__ import annotations

from collections.abc import Mapping  # noqa: TC003 - read at run time for the JSON Schema
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.compute as pc

from internav_data.core.storage import Store, StoreLike, store_of
from internav_data.dataset.confounding import (
    ASSET_COLUMNS,
    ConfoundingRow,
    PushCounts,
    looks_of,
)
from internav_data.dataset.manifest import Manifest, read_manifest
from internav_data.dataset.outcome_stats import (
    EXPERT_COLUMNS,
    OUTCOME_COLUMNS,
    AgreementRow,
    ExpertRow,
    OutcomeCounts,
    OutcomeRow,
    agreement_row,
    expert_row,
)
from internav_data.dataset.snapshot import read_shard
from internav_data.dataset.summary_statistics import Spread, counts, mean, share, spread
from internav_data.dataset.tables import ASSETS, EPISODES
from internav_data.records.agent import SPACING_M

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.core.typing import Ints


_SCALARS = (
    *("scene_id", "split", "room_count", "mode", "sealed", "rooms_on_path"),
    *(
        "obstacle_count",
        "shortest_path_m",
        "shortest_path_steps",
        "obstructed_path_m",
        "obstructed_path_steps",
    ),
    "agreed",
)
_START = tuple(f"start.{name}" for name in ("faces_wall", "reachable_nodes"))
POCKET_NODES = 4
"""Number of nodes within reach below which a start is in a pocket."""
_OBSTACLES = tuple(
    f"obstacles.list.element.{n}" for n in ("asset_id", "type", "pushable", "pickable", "relevant")
)


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
    """Mean of 0.25 m x shortest_path_steps."""
    cross_room_num: float
    """Mean number of rooms on the shortest room path."""
    blocked: int
    sealed: int
    """Blocked episodes that let nothing through off the lattice either."""
    paper: PaperRow


@dataclass(frozen=True, slots=True)
class TypeShare:
    """A type's share of what is drawn and of what stands in the end."""

    type: str
    drawn: float | None
    """Share of the draws; null where the manifest does not state it, as in earlier releases."""
    standing: float
    """Share of the obstacles."""
    ratio: float | None
    """Standing to drawn; null without a share of the draws."""


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
    type_shares: tuple[TypeShare, ...]
    """Types that are drawn or stand: draws are not what stands, since small objects fit oftener."""
    obstacles_pushable: int
    obstacles_pickable: int
    obstacles_fixed: int
    obstacles_relevant: int | None
    """Obstacles in a smallest set that makes the path longer or blocks it; null where no obstacle
    states whether it is, as in datasets of earlier releases."""
    relevant_share: float | None
    """Share of these among the obstacles that state it; null likewise."""
    shortest_path_m: Spread
    shortest_path_steps: Spread
    detour_steps: Spread
    """Further steps of lengthened episodes: obstructed_path_steps - shortest_path_steps."""
    facing_wall_share: float | None
    """Share of starts whose first step ahead a wall or furniture blocks; null where no episode
    states it, as in datasets of earlier releases."""
    pocket_share: float | None
    """Share of starts with fewer than 4 nodes within reach; null likewise."""
    expert: ExpertRow
    outcomes: tuple[OutcomeRow, ...]
    openable_share_of_blocked: float
    """Share of blocked episodes that a single interaction opens."""
    agreement: AgreementRow | None
    """Agreement of two physics engines; null where one alone was asked (`physics.cross_check`)."""
    confounding: ConfoundingRow | None
    """Predictability of pushes from the look of their obstacles; null without any push outcome."""
    redraws: Mapping[str, int]
    """Number of redraws while generating, by reason; of all splits."""
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
    dataset : Dataset, str, Path or Store
        An open dataset (its split is taken; filters are not) or the folder of one.
    split : str, optional
        Split to which the statistics are confined.

    Raises
    ------
    CorruptDataError
        A file is missing or damaged.

    """
    if isinstance(dataset, str | Path | Store):  # a str has a method `split`
        store = store_of(dataset)
        return asdict(stats_of(store, read_manifest(store), split))
    return asdict(stats_of(dataset.store, dataset.manifest, split or dataset.split))


def stats_of(root: StoreLike, manifest: Manifest, split: str | None = None) -> Stats:
    """Return the statistics of the files that a manifest names."""
    names = [*_SCALARS, *_START, *_OBSTACLES, *EXPERT_COLUMNS, *OUTCOME_COLUMNS]
    store = store_of(root)
    tables, kinds = [_no_rows()], [_no_obstacles()]
    outcomes, pushes = OutcomeCounts(), PushCounts()
    for file in manifest.of("episodes", split):
        table = read_shard(store, file, EPISODES, names)
        tables.append(_flat_rows(table))
        for chunk in table.column("obstacles").chunks:
            kinds.append(_flat_obstacles(chunk))
            outcomes.add(chunk)
            pushes.add(chunk)
    (assets,) = manifest.of("assets")
    confounding = pushes.row(looks_of(read_shard(store, assets, ASSETS, ASSET_COLUMNS)))
    obstacles = pa.concat_tables(kinds)
    return _stats(pa.concat_tables(tables), obstacles, outcomes, confounding, manifest, split)


def _flat_rows(table: pa.Table) -> pa.Table:
    """Return the columns of episodes, of the expert's what its figures need."""
    return table.select([*_SCALARS, "start", "expert"]).cast(_no_rows().schema)


def _flat_obstacles(column: pa.ListArray) -> pa.Table:
    names = _no_obstacles().schema.names
    return pa.Table.from_struct_array(column.flatten()).select(names).cast(_no_obstacles().schema)


def _no_rows() -> pa.Table:
    """Return the columns of episodes without a row."""
    schema = EPISODES.schema
    structs = [
        pa.field(
            name, pa.struct([schema.field(name).type.field(c.partition(".")[2]) for c in columns])
        )
        for name, columns in (("start", _START), ("expert", EXPERT_COLUMNS))
    ]
    return pa.schema([*(schema.field(name) for name in _SCALARS), *structs]).empty_table()


def _no_obstacles() -> pa.Table:
    booleans = dict.fromkeys(("pushable", "pickable", "relevant"), pa.bool_())
    types = {"type": pa.string(), **booleans}
    return pa.schema(types).empty_table()


def _stats(
    table: pa.Table,
    kinds: pa.Table,
    outcomes: OutcomeCounts,
    confounding: ConfoundingRow | None,
    manifest: Manifest,
    split: str | None,
) -> Stats:
    rooms = table.column("room_count").to_numpy()
    blocked = pc.equal(table.column("mode"), "blocked").to_numpy()
    sealed = table.column("sealed").to_numpy()
    push, pick = (kinds.column(name).to_numpy().astype(bool) for name in ("pushable", "pickable"))
    relevant = kinds.column("relevant").drop_null().to_numpy().astype(bool)
    walls, nodes = (
        pc.struct_field(table.column("start"), name.partition(".")[2]).drop_null().to_numpy()
        for name in _START
    )
    held = {k: v for k, v in manifest.counts.items() if split in (None, k)}
    return Stats(
        scenes=sum(count.scenes for count in held.values()),
        episodes=table.num_rows,
        splits={name: count.episodes for name, count in held.items()},
        table2=tuple(_rooms_row(table, rooms, blocked, sealed, span) for span in PAPER),
        modes={"blocked": int(blocked.sum()), "lengthened": int((~blocked).sum())},
        sealed=int(sealed.sum()),
        sealed_share_of_blocked=mean(sealed[blocked]),
        room_count=counts(table.column("room_count")),
        obstacle_count=counts(table.column("obstacle_count")),
        obstacle_types=counts(kinds.column("type")),
        type_shares=_type_shares(counts(kinds.column("type")), manifest.obstacle_shares),
        obstacles_pushable=int(push.sum()),
        obstacles_pickable=int(pick.sum()),
        obstacles_fixed=int((~(push | pick)).sum()),
        obstacles_relevant=int(relevant.sum()) if len(relevant) else None,
        relevant_share=mean(relevant) if len(relevant) else None,
        shortest_path_m=spread(table.column("shortest_path_m").to_numpy()),
        shortest_path_steps=spread(table.column("shortest_path_steps").to_numpy()),
        detour_steps=spread(_detours(table)),
        facing_wall_share=mean(walls) if len(walls) else None,
        pocket_share=mean(nodes < POCKET_NODES) if len(nodes) else None,
        expert=expert_row(table, manifest),
        outcomes=outcomes.rows(),
        openable_share_of_blocked=share(outcomes.openable, int(blocked.sum())),
        agreement=agreement_row(outcomes, table.column("agreed")),
        confounding=confounding,
        redraws=dict(manifest.redraws),
        quarantined=len(manifest.quarantined),
    )


def _detours(table: pa.Table) -> Ints:
    """Return the further steps (n,) of the lengthened paths."""
    detours = pc.subtract(
        table.column("obstructed_path_steps"), table.column("shortest_path_steps")
    )
    lengthened = detours.filter(pc.equal(table.column("mode"), "lengthened"))
    found: Ints = lengthened.drop_null().to_numpy()
    return found


def _type_shares(
    standing: Mapping[str, int], drawn: Mapping[str, float] | None
) -> tuple[TypeShare, ...]:
    total, rows = sum(standing.values()), []
    for kind in sorted({*standing, *(drawn or ())}):
        stands = share(standing.get(kind, 0), total)
        draws = None if drawn is None else drawn.get(kind, 0.0)
        ratio = share(stands, draws) if draws else None
        rows.append(TypeShare(kind, draws, stands, ratio))
    return tuple(rows)


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
        ratio=mean(chosen),
        obstacle_num=mean(part.column("obstacle_count").to_numpy()),
        distance_m=mean(SPACING_M * part.column("shortest_path_steps").to_numpy()),
        cross_room_num=mean(part.column("rooms_on_path").to_numpy()),
        blocked=int((chosen & blocked).sum()),
        sealed=int((chosen & sealed).sum()),
        paper=PAPER[span],
    )
