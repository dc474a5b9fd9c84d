"""Predictability of pushes from the look of their obstacles: base rate, best guess, information.

The entropy of a push's success given its obstacle's asset, type and size is estimated by
cross-validation: each obstacle is predicted from all others, by shares that are shrunk from the
asset's to those of similar sizes, of the type and of all (Katz's back-off by pseudo-counts). Taking
the shares of the data themselves would overstate what the look tells: with few obstacles of an
asset, chance alone makes theirs differ. The estimate is low, if anything, and rises with the data.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from internav_data.dataset.summary_statistics import share
from internav_data.records import type_affordances

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import Vec3

ASSET_COLUMNS: Final = ("asset_id", "type", "size", "pushable", "pickable", "spawnable")
"""Columns of the assets that the estimate needs."""
SIZE_CLASSES: Final = 4
"""Classes of size within a type, by volume."""
PSEUDO_COUNTS: Final = (1.0, 4.0, 16.0, 64.0, 256.0, 1024.0)
"""Pushes for which the share of the next larger group counts; those that predict best are taken."""


class AssetLook(NamedTuple):
    """Facts about an asset that its look tells."""

    asset_id: str
    type: str
    size: Vec3
    """Bounding box, metres."""
    pushable: bool
    pickable: bool
    spawnable: bool


@dataclass(frozen=True, slots=True)
class ConfoundingRow:
    """Predictability of pushes from the look of their obstacles.

    Over the push outcomes of all obstacles whose type is pushed, fixed ones among them.
    """

    pushes: int
    base_rate: float
    """Share of these pushes that succeed."""
    guess_accuracy: float
    """Share that the best guess from asset, type and size gets right (cross-validated)."""
    information_share: float
    """I(success; asset, type, size) / H(success), cross-validated: 1 where the look tells all."""


@dataclass(frozen=True, slots=True)
class PushCounts:
    """Counts over the push outcomes of some obstacles."""

    cells: Counter[tuple[str, int, int]] = field(default_factory=Counter)
    """Number of obstacles by asset_id, pushes and successful pushes."""

    def add(self, obstacles: pa.ListArray) -> None:
        """Count the outcomes of a column of obstacles, one list for each episode."""
        column = obstacles.flatten()
        lists = pc.struct_field(column, "outcomes")
        pushed = pc.starts_with(pc.struct_field(lists.flatten(), "action"), "push")
        success = pc.struct_field(lists.flatten(), "success").filter(pushed)
        table = pa.table(
            {"obstacle": pc.list_parent_indices(lists).filter(pushed), "success": success}
        )
        sums = table.group_by("obstacle").aggregate([("success", "count"), ("success", "sum")])
        assets = pc.struct_field(column, "asset_id").take(sums.column("obstacle"))
        counts = (sums.column(name).to_pylist() for name in ("success_count", "success_sum"))
        self.cells.update(zip(assets.to_pylist(), *counts, strict=True))

    def row(self, looks: Iterable[AssetLook]) -> ConfoundingRow | None:
        """Return the statistics, given the looks of all assets; None without any push."""
        looks = tuple(looks)
        affordances = type_affordances(looks)
        groups = {
            look.asset_id: group
            for look, group in zip(looks, _groups(looks), strict=True)
            if affordances.get(look.type) == "push"
        }
        cells = [(*cell, count) for cell, count in self.cells.items() if cell[0] in groups]
        if not cells:
            return None
        names, pushes, successes, counts = zip(*sorted(cells), strict=True)
        levels = np.array([groups[name] for name in names], np.int64).T
        return confounding(
            levels, np.array(pushes), np.array(successes), np.array(counts, np.float64)
        )


def _groups(looks: tuple[AssetLook, ...]) -> list[tuple[int, int, int]]:
    """Return the groups of each asset: numbers of its type, of its class of size, its own."""
    types = {name: k for k, name in enumerate(sorted({look.type for look in looks}))}
    members: dict[str, list[float]] = {}
    for look in looks:
        members.setdefault(look.type, []).append(_volume(look))
    out = []
    for own, look in enumerate(looks):
        volumes = members[look.type]
        smaller = sum(volume < _volume(look) for volume in volumes)
        number = types[look.type]
        out.append((number, SIZE_CLASSES * number + SIZE_CLASSES * smaller // len(volumes), own))
    return out


def _volume(look: AssetLook) -> float:
    return look.size[0] * look.size[1] * look.size[2]


def confounding(levels: Ints, pushes: Ints, successes: Ints, counts: Floats) -> ConfoundingRow:
    """Estimate what groups tell about successes, each obstacle predicted from all others.

    Parameters
    ----------
    levels
        Groups of obstacles, from the largest to the smallest, (levels, n) int64.
    pushes, successes
        Pushes of an obstacle, and those that succeed, (n,) int64.
    counts
        Number of obstacles with these groups, pushes and successes, (n,) float64.
    """
    total, won = float((counts * pushes).sum()), float((counts * successes).sum())
    base = won / total
    best, guess = np.inf, 0.0
    # Pushes and successes of all other obstacles of the same group, level by level.
    sums = []
    for groups in levels:
        tried, succeeded = (np.bincount(groups, counts * n) for n in (pushes, successes))
        sums.append((tried[groups] - pushes, succeeded[groups] - successes))
    first = (won - successes + 0.5) / (total - pushes + 1.0)
    for weights in product(PSEUDO_COUNTS, repeat=len(levels)):
        chance = first
        for (tried, succeeded), weight in zip(sums, weights, strict=True):
            chance = (succeeded + weight * chance) / (tried + weight)
        bits = -successes * np.log2(chance) - (pushes - successes) * np.log2(1.0 - chance)
        entropy = float((counts * bits).sum()) / total
        if entropy < best:
            right = np.where(chance >= 0.5, successes, pushes - successes)  # noqa: PLR2004 - even
            best, guess = entropy, float((counts * right).sum()) / total
    whole = -sum(p * np.log2(p) for p in (base, 1.0 - base) if p > 0.0)
    told = max(0.0, float(whole) - best) / float(whole) if whole > 0.0 else 0.0
    return ConfoundingRow(
        pushes=int(total),
        base_rate=share(won, total),
        guess_accuracy=round(guess, 6),
        information_share=round(told, 6),
    )


def looks_of(assets: pa.Table) -> tuple[AssetLook, ...]:
    """Return the looks of assets, of a table with `ASSET_COLUMNS`."""
    columns: Mapping[str, list[object]] = {
        name: assets.column(name).to_pylist() for name in ASSET_COLUMNS
    }
    sizes = [(size["x"], size["y"], size["z"]) for size in assets.column("size").to_pylist()]
    rows = zip(*({**columns, "size": sizes}[name] for name in ASSET_COLUMNS), strict=True)
    return tuple(AssetLook(*row) for row in rows)
