"""House to episodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.episodes.config import EpisodeConfig

if TYPE_CHECKING:
    from internav_data.episodes.build import EpisodeBatch, build_batch, build_episodes, mode_of
    from internav_data.episodes.site import SpawnSite

__all__ = ["EpisodeBatch", "EpisodeConfig", "SpawnSite", "build_batch", "build_episodes", "mode_of"]

_HOMES = {"SpawnSite": "site"} | dict.fromkeys(
    ("EpisodeBatch", "build_batch", "build_episodes", "mode_of"), "build"
)


def __getattr__(name: str) -> object:
    """Import what is asked for: a config alone needs neither numba nor Bullet."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
