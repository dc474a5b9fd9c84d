"""Episodes of a house: start, goal, obstacles on the path, outcomes and an expert."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports
from internav_data.episodes.config import EpisodeConfig

if TYPE_CHECKING:
    from internav_data.episodes.build import EpisodeBatch, build_batch, build_episodes, mode_of
    from internav_data.episodes.site import SpawnSite

__all__ = ["EpisodeBatch", "EpisodeConfig", "SpawnSite", "build_batch", "build_episodes", "mode_of"]

# A config alone needs neither numba nor Bullet.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "build": ["EpisodeBatch", "build_batch", "build_episodes", "mode_of"],
        "site": ["SpawnSite"],
    },
)
