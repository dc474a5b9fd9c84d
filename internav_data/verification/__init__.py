"""Validation of datasets by independent, slower means than the generator's."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports

if TYPE_CHECKING:
    from internav_data.verification.findings import LEVELS, Finding, Findings, Level
    from internav_data.verification.levels import validate

__all__ = ["LEVELS", "Finding", "Findings", "Level", "validate"]

# Without shapely, the error names the extra that brings it.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {"findings": ["LEVELS", "Finding", "Findings", "Level"], "levels": ["validate"]},
)
