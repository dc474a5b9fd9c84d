"""Summary statistics of many values: means, spreads, counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow.compute as pc

if TYPE_CHECKING:
    import pyarrow as pa
    from numpy.typing import NDArray


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
