"""What a dataset says about itself beside its data: card, croissant, statistics and schemas."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from internav_data.dataset.manifest import Manifest


def write_sidecars(root: Path, manifest: Manifest) -> None:
    """Write README.md, croissant.json, stats.json and schemas/ of a dataset."""
