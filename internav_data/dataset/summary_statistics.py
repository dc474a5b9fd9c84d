"""Summary statistics of many values: means, spreads, counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.compute as pc

if TYPE_CHECKING:
    import pyarrow as pa
    from numpy.typing import NDArray

    from internav_data.core.typing import Floats

    FloatsLike = float | NDArray[np.float64]


_DIGITS = 6


@dataclass(frozen=True, slots=True)
class Spread:
    """Spread of one figure over all episodes that have it; zeros without any."""

    min: float
    median: float
    mean: float
    max: float


def mean(values: NDArray[Any]) -> float:
    """Return the mean of (n,) values; 0 without any."""
    return round(float(values.mean()), _DIGITS) if len(values) else 0.0


def share(part: float, whole: float) -> float:
    """Return a part's share of a whole; 0 of nothing."""
    return round(part / whole, _DIGITS) if whole else 0.0


def path_efficiency(shortest_path_m: FloatsLike, path_m: FloatsLike) -> Floats:
    """Return L / max(P, L) of SPL for shortest paths L and paths P that were taken, (n,) float64.

    Where the start is the goal (L = 0) it is 1 of a path of length 0, and 0 of any other, as in
    AllenAct; the definition of Anderson et al. 2018 leaves 0 / 0 open.
    """
    shortest = np.asarray(shortest_path_m, np.float64)
    longest = np.maximum(path_m, shortest)
    return np.divide(shortest, longest, out=np.ones_like(longest), where=longest > 0.0)


def spread(values: NDArray[Any]) -> Spread:
    """Return the spread of (n,) values."""
    if not len(values):
        return Spread(0.0, 0.0, 0.0, 0.0)
    figures = (values.min(), np.median(values), values.mean(), values.max())
    return Spread(*(round(float(figure), _DIGITS) for figure in figures))


def counts(column: pa.ChunkedArray) -> dict[str, int]:
    """Return the number of occurrences of each value, by value as text."""
    pairs = [(c["values"], c["counts"]) for c in pc.value_counts(column).to_pylist()]
    return {str(value): count for value, count in sorted(pairs)}
