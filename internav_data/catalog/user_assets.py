"""A user's own meshes (placeholder until the reader is written)."""

from __future__ import annotations
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path
    from internav_data.records import Asset


def load_user_assets(directory: Path) -> tuple[Asset, ...]:
    """Read."""
    raise NotImplementedError(directory)
