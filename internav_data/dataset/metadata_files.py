"""What a dataset says about itself beside its data: card, croissant, statistics and schemas."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

from internav_data.core.files import write_atomically
from internav_data.dataset.card import card_text
from internav_data.dataset.croissant import croissant
from internav_data.dataset.jsonschemas import write_schemas
from internav_data.dataset.stats import stats_of

if TYPE_CHECKING:
    from pathlib import Path

    from internav_data.dataset.manifest import Manifest


def write_sidecars(root: Path, manifest: Manifest) -> None:
    """Write README.md, croissant.json, stats.json and schemas/ beside files already in place."""
    stats = stats_of(root, manifest)
    write_atomically(root / "stats.json", (json.dumps(asdict(stats), indent=1) + "\n").encode())
    write_atomically(root / "README.md", card_text(manifest, stats).encode())
    said = json.dumps(croissant(manifest), indent=1, ensure_ascii=False) + "\n"
    write_atomically(root / "croissant.json", said.encode())
    write_schemas(root / "schemas")
