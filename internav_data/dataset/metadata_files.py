"""Metadata files beside the data: card, croissant, evaluation tasks, statistics and schemas."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, replace
from typing import TYPE_CHECKING

from internav_data.dataset.card import card_text
from internav_data.dataset.croissant import croissant
from internav_data.dataset.eval_yaml import eval_text
from internav_data.dataset.jsonschemas import schema_text, schemas
from internav_data.dataset.manifest import MetadataFile
from internav_data.dataset.stats import stats_of
from internav_data.dataset.tables import TABLES

if TYPE_CHECKING:
    from internav_data.core.storage import Store
    from internav_data.dataset.journal import Journal
    from internav_data.dataset.manifest import Manifest

METADATA = frozenset(
    (
        "README.md",
        "croissant.json",
        "eval.yaml",
        "stats.json",
        *(
            f"schemas/{name}.schema.json"
            for name in (*(t.name for t in TABLES), "manifest", "stats")
        ),
    )
)
"""Names of all metadata files."""


def metadata_blobs(store: Store, manifest: Manifest) -> dict[str, bytes]:
    """Return all files of `METADATA` by name, for data in place."""
    stats = stats_of(store, manifest)
    description = json.dumps(croissant(manifest), indent=1, ensure_ascii=False) + "\n"
    texts = {
        "README.md": card_text(manifest, stats),
        "croissant.json": description,
        "eval.yaml": eval_text(manifest),
        "stats.json": json.dumps(asdict(stats), indent=1) + "\n",
        **{f"schemas/{name}": schema_text(schema) for name, schema in schemas().items()},
    }
    return {name: text.encode() for name, text in texts.items()}


def put_metadata(journal: Journal, store: Store, manifest: Manifest) -> Manifest:
    """Put the files beside the data and return the manifest that lists them."""
    files, blobs = [], metadata_blobs(store, manifest)
    journal.announce(*blobs)  # at once: the disk is waited for at each change of the journal
    for name, data in blobs.items():
        journal.put(name, data)
        files.append(MetadataFile(name, len(data), hashlib.sha256(data).hexdigest()))
    return replace(manifest, metadata=tuple(files))
