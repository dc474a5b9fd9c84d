"""Report of a run, for programs and for people."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from internav_data.core.progress import clock
from internav_data.dataset import refused_share
from internav_data.records.errors import QuarantineError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from internav_data.dataset import Manifest
    from internav_data.generation.progress import GenerationProgress


@dataclass(frozen=True, slots=True)
class Report:
    """Result of a run."""

    out: Path | str
    """Folder of the dataset, or its URL."""
    scenes: int
    """Scenes of the dataset, quarantined ones included."""
    episodes: int
    """Episodes of the dataset."""
    new_scenes: int
    """Scenes made by this run."""
    new_episodes: int
    """Episodes made by this run."""
    seconds: float
    """Wall time of the run."""
    quarantined: tuple[tuple[str, str], ...]
    """Scenes of the dataset that could not be made: id and reason."""
    died: int
    """Those of them whose workers died: the next run tries them again."""
    redraws: Mapping[str, int]
    """Number of redraws of the dataset, by reason."""
    refused_share: float
    """Share of the spawned draws for which the expert found no plan."""

    @property
    def exit_code(self) -> int:
        """Exit code of the command: 0, or 4 when scenes are missing."""
        return QuarantineError.exit_code if self.quarantined else 0

    def plain(self) -> dict[str, object]:
        """Return the report as plain values, for programs."""
        return asdict(self) | {"out": str(self.out)}


def report_of(out: Path | str, manifest: Manifest, progress: GenerationProgress) -> Report:
    """Return the report of a run: the dataset's figures, and those counted on the way."""
    return Report(
        out=out,
        scenes=manifest.scenes,
        episodes=sum(count.episodes for count in manifest.counts.values()),
        new_scenes=progress.scenes,
        new_episodes=progress.episodes,
        seconds=progress.seconds,
        quarantined=tuple((entry.scene_id, entry.reason) for entry in manifest.quarantined),
        died=sum(entry.died for entry in manifest.quarantined),
        redraws=dict(manifest.redraws),
        refused_share=refused_share(manifest),
    )


def summary(report: Report) -> str:
    """Return a report in one line."""
    if not report.new_scenes:
        return (
            f"{report.out} holds {report.scenes} scenes and {report.episodes} episodes of this "
            "config already; ask for more --scenes to extend it"
        )
    rate = report.new_episodes / max(report.seconds, 1e-9)
    return (
        f"{report.out}: {report.scenes} scenes, {report.episodes} episodes "
        f"({report.new_episodes} new in {clock(report.seconds)}, {rate:.1f} episodes/s); "
        f"the expert refused {report.refused_share:.1%} of what was drawn"
    )
