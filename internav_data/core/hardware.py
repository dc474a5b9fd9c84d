"""Name of the arithmetic of this machine: what floating-point results depend on besides code."""

from __future__ import annotations

import hashlib
import math
import platform
import struct
from contextlib import suppress
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

_FEATURES: Final = ("avx2", "avx512f", "fma", "neon", "sve")
"""Instructions by which mathematical libraries choose their variants."""
_EXPONENTS: Final = (-8, -3, -1, 0, 1, 3, 8)
_POINTS: Final = 200
"""Points for each exponent: variants differ in the last bit of some."""


@lru_cache(maxsize=1)
def hardware() -> str:
    """Return architecture, processor features, and a digest of results of mathematical functions.

    Machines of the same name compute the same to the last bit. The digest tells apart what features
    do not: libraries choose by the environment too (`GLIBC_TUNABLES`), and differ by version.
    """
    numbers = [*_scalars(), *_arrays()]
    digest = hashlib.sha256(struct.pack(f"<{len(numbers)}d", *numbers)).hexdigest()[:8]
    return f"{' '.join([platform.machine(), *_features()])}, arithmetic {digest}"


def _features() -> list[str]:
    with suppress(ImportError, RuntimeError):
        from llvmlite.binding import get_host_cpu_features  # noqa: PLC0415 - heavy

        found = get_host_cpu_features()
        return [name for name in _FEATURES if found.get(name)]
    return []


def _points() -> list[float]:
    fractions = [1.0 + k * 0.6180339887498949 % 1.0 for k in range(_POINTS)]
    return [math.ldexp(fraction, exponent) for exponent in _EXPONENTS for fraction in fractions]


def _scalars() -> Iterator[float]:
    for x in _points():
        yield from (math.sin(x), math.cos(x), math.tan(x), math.atan2(x, 1.3), math.hypot(x, 1.3))
        yield from (math.exp(-x), math.log(x), math.pow(x, 1.7), math.asin(x % 1), math.acos(x % 1))


def _arrays() -> Iterator[float]:
    points = np.array(_points())
    for results in (np.sin(points), np.cos(points), np.arctan(points), np.exp(-points)):
        yield from results.tolist()
