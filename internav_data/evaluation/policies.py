"""Policies that can be evaluated: what they may tell about their choices."""

from __future__ import annotations

Note = tuple[str, tuple[str, ...], tuple[float, ...], int]
"""A title, names, a share for each, and which of them was taken (-1: none)."""
