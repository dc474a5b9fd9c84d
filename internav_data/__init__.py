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

if TYPE_CHECKING:
    from internav_data.camp.checkpoint import load_agent
    from internav_data.dataset import Dataset, compute_stats, load_dataset
    from internav_data.generation import generate_episodes, generate_house
    from internav_data.records.version import __version__

_HOMES = {
    "__version__": "internav_data.records.version",
    "Dataset": "internav_data.dataset",
    "compute_stats": "internav_data.dataset",
    "generate_episodes": "internav_data.generation",
    "generate_house": "internav_data.generation",
    "load_agent": "internav_data.camp.checkpoint",
    "load_dataset": "internav_data.dataset",
}

__all__ = [
    "Dataset",
    "__version__",
    "compute_stats",
    "generate_episodes",
    "generate_house",
    "load_agent",
    "load_dataset",
]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever stands there
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'internav_data' has no attribute {name!r}")
    return getattr(import_module(home), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
