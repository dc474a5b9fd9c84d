"""internav: interactive-navigation episodes with physical truth.

Nothing but the standard library is imported until something here is used; the loader then needs
numpy and pyarrow alone.

Examples
--------
>>> from internav_data import load_dataset
>>> ds = load_dataset(split="train")  # doctest: +SKIP

"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from internav_data.core.compile_cache import ensure_compile_cache
from internav_data.core.lazy import lazy_imports

if TYPE_CHECKING:
    from internav_data.camp.checkpoint import export_agent, load_agent
    from internav_data.dataset import Dataset, compute_stats, load_dataset
    from internav_data.evaluation import evaluate
    from internav_data.generation import generate_episodes, generate_house
    from internav_data.records.version import __version__

__all__ = [
    "Dataset",
    "__version__",
    "compute_stats",
    "evaluate",
    "export_agent",
    "generate_episodes",
    "generate_house",
    "load_agent",
    "load_dataset",
]

# Before anything imports numba.
ensure_compile_cache()

_public, __dir__ = lazy_imports(
    __name__,
    {
        "camp.checkpoint": ["export_agent", "load_agent"],
        "dataset": ["Dataset", "compute_stats", "load_dataset"],
        "evaluation": ["evaluate"],
        "generation": ["generate_episodes", "generate_house"],
        "records.version": ["__version__"],
    },
)


def __getattr__(name: str) -> Any:  # noqa: ANN401 - as the public names are
    """Return a public name; from the first one on, notebooks show houses and episodes."""
    found = _public(name)
    import_module("internav_data.views")  # registers pictures, and imports none of what draws them
    return found
