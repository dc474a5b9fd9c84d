"""The agent: body, camera and steps. Each of its numbers stands here; other rooms derive theirs.

The validator alone keeps numbers of its own (`internav_data.verification`); a test compares them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class AgentSpec:
    """Body, camera and steps of the agent: an upright disc on the floor.

    Its pose is a lattice node and a quarter turn: heading k is 90 k degrees counter-clockwise from
    the x axis.
    """

    radius_m: float = 0.2
    """Radius of the disc in plan."""
    height_m: float = 1.8
    """Height of the body. Parts that begin above it are walked under."""
    step_over_m: float = 0.02
    """Height up to which parts are stepped over: they do not block."""
    collider_radius_m: float = 0.21
    """Radius of the body in physics: no pushed object ends inside the disc."""
    tie_m: float = 1e-6
    """Tolerance of the disc's clearance. A wall exactly 0.2 m away is free: stored positions are
    multiples of 0.1 mm, so exact ties are common, and the last bit of a float must not decide."""
    step_m: float = 0.25
    """Length of one MoveAhead: distance of neighbouring lattice nodes."""
    camera_height_m: float = 1.575
    """Height of the camera on the disc's axis."""
    field_of_view_deg: float = 90.0
    """Horizontal and vertical angle of view. Sight and the rasteriser are written for 90 degrees:
    at depth z a point is in view up to z to either side, up and down."""
    horizons_deg: tuple[int, ...] = (-30, 0, 30, 60)
    """Angles by which the camera can look down; negative is up."""
    start_horizon_deg: int = 30
    """Horizon at the start of an episode."""
    reach_m: float = 1.25
    """Distance in the plane, from the disc's axis, up to which an object can be acted on."""

    @property
    def clearance_m(self) -> float:
        """Distance to polygons at and above which the disc's centre is free."""
        return self.radius_m - self.tie_m


AGENT: Final = AgentSpec()
"""The agent of all datasets: its numbers are part of the dataset format, not of the config."""
SPACING_M: Final = AGENT.step_m
"""Distance of neighbouring lattice nodes, for kernels."""
CLEARANCE_M: Final = AGENT.clearance_m
"""Distance at and above which the disc's centre is free, for kernels."""
