"""Generation of datasets: runs, executors, worker processes, resume and progress."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports

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

# Worker processes and `--help` need little of this.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "config": ["GenerationConfig", "load_config"],
        "progress": ["GenerationProgress"],
        "report": ["Report"],
        "run": ["generate"],
        "single": ["generate_episodes", "generate_house"],
    },
)
