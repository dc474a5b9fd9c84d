"""What a run did, for programs and for people."""

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
    """What a run did."""

    out: Path
    scenes: int
    """In the dataset now, quarantined ones included."""
    episodes: int
    """In the dataset now."""
    new_scenes: int
    """Made by this run."""
    new_episodes: int
    seconds: float
    quarantined: tuple[tuple[str, str], ...]
    """Scene ids in the dataset's manifest that could not be made, and why."""
    redraws: Mapping[str, int]
    """How often something was drawn again for the whole dataset, by reason."""
    refused_share: float
    """Of all that was spawned for it: what the expert found no plan for."""

    @property
    def exit_code(self) -> int:
        """0, or 4 when scenes are missing."""
        return QuarantineError.exit_code if self.quarantined else 0

    def plain(self) -> dict[str, object]:
        """Return it for programs."""
        return asdict(self) | {"out": str(self.out)}


def report_of(out: Path, manifest: Manifest, progress: GenerationProgress) -> Report:
    """Gather what a run did: what the dataset holds now, and what was counted on the way."""
    return Report(
        out=out,
        scenes=manifest.scenes,
        episodes=sum(count.episodes for count in manifest.counts.values()),
        new_scenes=progress.scenes,
        new_episodes=progress.episodes,
        seconds=progress.seconds,
        quarantined=tuple((entry.scene_id, entry.reason) for entry in manifest.quarantined),
        redraws=dict(manifest.redraws),
        refused_share=refused_share(manifest),
    )


def summary(report: Report) -> str:
    """Return in one line what a run did."""
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
