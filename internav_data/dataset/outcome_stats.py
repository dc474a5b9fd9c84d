"""Statistics of the experts and outcomes of a dataset, from their columns alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping  # noqa: TC003 - read at run time for the JSON Schema
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pyarrow as pa
import pyarrow.compute as pc

from internav_data.dataset.summary_statistics import (
    Spread,
    counts,
    mean,
    path_efficiency,
    share,
    spread,
)
from internav_data.records.agent import SPACING_M

if TYPE_CHECKING:
    from internav_data.dataset.manifest import Manifest
    from internav_data.records import Redraw

EXPERT_COLUMNS = tuple(f"expert.{name}" for name in ("steps", "pushes", "picks", "path_m"))
OUTCOME_COLUMNS = tuple(
    f"obstacles.list.element.outcomes.list.element.{name}"
    for name in ("action", "success", "opened", "agrees")
)
REFUSED: Redraw = "no expert"


@dataclass(frozen=True, slots=True)
class ExpertRow:
    """Results of the experts: no agent on the same lattice can be expected to do better."""

    solved: int
    """Episodes with an expert."""
    solved_share: float
    """Share of all episodes."""
    steps: Spread
    """Steps of the experts, Done included."""
    pushes: float
    """Mean number of pushes of an expert."""
    picks: float
    """Mean number of pick-ups of an expert."""
    interactions: Mapping[str, int]
    """Experts by their number of pushes and pick-ups."""
    spl: float
    """Mean of shortest_path_m / max(path_m, shortest_path_m) over episodes; 0 without expert."""
    sts: float
    """Mean over all episodes of shortest_path_m / 0.25 m / steps, 0 without an expert."""
    refused: int
    """Draws of all splits that were thrown away since no expert was found."""
    refused_share: float
    """Share of these among these draws and the episodes together."""


@dataclass(frozen=True, slots=True)
class OutcomeRow:
    """Effects of one interaction on the obstacles of all episodes."""

    action: str
    possible: int
    """Obstacles that can be pushed, or picked up, at all."""
    success_share: float
    """Share of the possible ones that succeed."""
    opened: int
    """Number of interactions that open a blocked path by themselves."""


@dataclass(frozen=True, slots=True)
class AgreementRow:
    """Agreement of two physics engines on the outcomes of pushes: the same success and opening."""

    asked: int
    """Number of pushes that both engines were asked for."""
    share: float
    """Share of these on which they agree."""
    share_by_type: Mapping[str, float]
    """The same share by type of obstacle."""
    episodes: int
    """Number of episodes on all of whose outcomes they agree."""
    episodes_share: float
    """Share of all episodes."""


@dataclass(slots=True)
class OutcomeCounts:
    """Counts over the outcomes of some files."""

    possible: Counter[str] = field(default_factory=Counter)
    succeeded: Counter[str] = field(default_factory=Counter)
    opened: Counter[str] = field(default_factory=Counter)
    openable: int = 0
    """Episodes that a single interaction opens."""
    asked: Counter[str] = field(default_factory=Counter)
    """Pushes that a second engine was asked for, by type of obstacle."""
    agree: Counter[str] = field(default_factory=Counter)
    """Those on which it agrees."""

    def add(self, obstacles: pa.ListArray) -> None:
        """Count the outcomes of a column of obstacles, one list for each episode."""
        parts = dict(
            zip(_names(obstacles.type.value_type), obstacles.flatten().flatten(), strict=True)
        )
        lists = parts["outcomes"]
        rows = dict(zip(_names(lists.type.value_type), lists.flatten().flatten(), strict=True))
        obstacle = pc.list_parent_indices(lists)
        able = pc.if_else(
            pc.equal(rows["action"], "pick"),
            parts["pickable"].take(obstacle),
            parts["pushable"].take(obstacle),
        )
        table = pa.table({"action": rows["action"], "able": able} | rows)
        sums = table.group_by("action").aggregate(
            [("able", "sum"), ("success", "sum"), ("opened", "sum")]
        )
        for row in sums.to_pylist():
            self.possible[row["action"]] += row["able_sum"]
            self.succeeded[row["action"]] += row["success_sum"]
            self.opened[row["action"]] += row["opened_sum"]
        kinds = parts["type"].take(obstacle)
        self.asked.update(kinds.filter(rows["agrees"].is_valid()).to_pylist())
        self.agree.update(kinds.filter(rows["agrees"].fill_null(False)).to_pylist())  # noqa: FBT003
        episode = pc.list_parent_indices(obstacles).take(obstacle)
        self.openable += len(pc.unique(episode.filter(rows["opened"])))

    def rows(self) -> tuple[OutcomeRow, ...]:
        """Return the statistics of each interaction."""
        return tuple(
            OutcomeRow(
                action, count, share(self.succeeded[action], count), int(self.opened[action])
            )
            for action, count in sorted(self.possible.items())
        )


def agreement_row(counts: OutcomeCounts, agreed: pa.ChunkedArray) -> AgreementRow | None:
    """Return the agreement of two engines; None where one alone was asked.

    Parameters
    ----------
    counts
        Counts over the outcomes.
    agreed
        Column `agreed` of the episodes.

    """
    if agreed.null_count == len(agreed):
        return None
    agreeing = int(pc.sum(agreed).as_py())
    return AgreementRow(
        asked=counts.asked.total(),
        share=share(counts.agree.total(), counts.asked.total()),
        share_by_type={
            kind: share(counts.agree[kind], count) for kind, count in sorted(counts.asked.items())
        },
        episodes=agreeing,
        episodes_share=share(agreeing, len(agreed)),
    )


def expert_row(table: pa.Table, manifest: Manifest) -> ExpertRow:
    """Return the results of the experts of some episodes.

    Parameters
    ----------
    table
        Episodes: `shortest_path_m` and, of `expert`, the `EXPERT_COLUMNS`.
    manifest
        Manifest of the dataset, which counts the redraws of all splits.

    """
    expert = table.column("expert")
    solved = expert.is_valid().to_numpy()
    steps, pushes, picks, path_m = (
        pc.struct_field(expert, name).drop_null().to_numpy()
        for name in ("steps", "pushes", "picks", "path_m")
    )
    shortest_path_m = table.column("shortest_path_m").to_numpy()[solved]
    return ExpertRow(
        solved=int(solved.sum()),
        solved_share=mean(solved),
        steps=spread(steps),
        pushes=mean(pushes),
        picks=mean(picks),
        interactions=counts(pa.chunked_array([pa.array(pushes + picks)])),
        spl=share(float(path_efficiency(shortest_path_m, path_m).sum()), len(solved)),
        sts=share(float((shortest_path_m / SPACING_M / steps).sum()), len(solved)),
        refused=manifest.redraws.get(REFUSED, 0),
        refused_share=refused_share(manifest),
    )


def refused_share(manifest: Manifest) -> float:
    """Return the share of spawned draws that the expert refused."""
    refused = manifest.redraws.get(REFUSED, 0)
    return share(refused, refused + sum(count.episodes for count in manifest.counts.values()))


def _names(kind: pa.StructType) -> list[str]:
    return [kind.field(k).name for k in range(kind.num_fields)]
