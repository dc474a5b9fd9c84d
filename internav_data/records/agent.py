"""The agent's body on the floor: an upright disc, and how exact ties are judged."""

from __future__ import annotations

from typing import Final

SPACING_M: Final = 0.25
"""Distance between neighbouring lattice nodes: one MoveAhead."""
RADIUS_M: Final = 0.2
"""Radius of the agent's disc."""
TOLERANCE_M: Final = 1e-6
"""A wall exactly 0.2 m away is free: stored positions are multiples of 0.1 mm, so true ties are
common, and the last bit of a float must not decide them."""
CLEARANCE_M: Final = RADIUS_M - TOLERANCE_M
"""The disc is free where everything is at least this far from its centre."""
