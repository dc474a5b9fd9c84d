"""Many houses: seeds, plan of work, worker processes, resume and progress."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from internav_data.generation.config import GenerationConfig, load_config
    from internav_data.generation.progress import GenerationProgress
    from internav_data.generation.report import Report
    from internav_data.generation.run import generate
    from internav_data.generation.single import generate_episodes, generate_house

__all__ = [
    "GenerationConfig",
    "GenerationProgress",
    "Report",
    "generate",
    "generate_episodes",
    "generate_house",
    "load_config",
]

_HOMES = {
    "GenerationConfig": "config",
    "GenerationProgress": "progress",
    "Report": "report",
    "generate": "run",
    "generate_episodes": "single",
    "generate_house": "single",
    "load_config": "config",
}


def __getattr__(name: str) -> object:
    """Import what is asked for: worker processes and `--help` need little of it."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
