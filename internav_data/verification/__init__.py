"""Validation of datasets by independent, slower means than the generator's."""

from internav_data.verification.findings import LEVELS, Finding, Findings, Level
from internav_data.verification.levels import validate

__all__ = ["LEVELS", "Finding", "Findings", "Level", "validate"]
