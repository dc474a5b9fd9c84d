"""Manifests edited by hand: with a digest that fits, or the old one."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from internav_data.core.files import with_sha256
from internav_data.dataset.manifest import MANIFEST

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def edit_manifest(folder: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Change a manifest as a writer would have written it: its digest fits."""
    path = folder / MANIFEST
    raw = json.loads(path.read_text())
    change(raw)
    path.write_text(json.dumps(with_sha256(raw)))
