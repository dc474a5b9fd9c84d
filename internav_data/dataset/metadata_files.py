"""Metadata files beside the data: dataset card, croissant, statistics and schemas."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING

from internav_data.dataset.card import card_text
from internav_data.dataset.croissant import croissant
from internav_data.dataset.jsonschemas import write_schemas
from internav_data.dataset.stats import stats_of

if TYPE_CHECKING:
    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import Manifest


def write_metadata(store: Store, manifest: Manifest) -> None:
    """Write README.md, croissant.json, stats.json and schemas/ beside files already in place."""
    stats = stats_of(store, manifest)
    store.put("stats.json", (json.dumps(asdict(stats), indent=1) + "\n").encode())
    store.put("README.md", card_text(manifest, stats).encode())
    description = json.dumps(croissant(manifest), indent=1, ensure_ascii=False) + "\n"
    store.put("croissant.json", description.encode())
    write_schemas(store, "schemas/")
