"""What values a setting may have."""

from __future__ import annotations

import dataclasses
from typing import Any, Final

_MOST: Final = 10**12
_LIMITS: Final[dict[str, tuple[float, float]]] = {
    "seed": (0, 2**63 - 1),
    "image_size": (16, 1024),
    "hidden": (1, 8192),
    "goal_embedding": (1, 8192),
    "depth_limit_m": (0.1, 1000.0),
    "goal_scale_m": (0.1, 1000.0),
    "end_chance": (1e-6, 0.5),
    "interact_chance": (1e-6, 0.49),
    "nie_objects": (1, 64),
    "environments": (1, 65536),
    "steps": (1, _MOST),
    "kl_limit": (0.0, _MOST),
    "gamma": (0.0, 1.0),
    "lam": (0.0, 1.0),
    "auxiliary_share": (0.0, 1.0),
    "single_room_share": (0.0, 1.0),
    "critic_rollouts": (0, _MOST),
    "max_steps": (1, 10_000),
    "workers": (0, 1024),
    "threads": (1, 1024),
    "validation_episodes": (0, _MOST),
    "window": (1, 10_000),
}
"""What values a field may have, by its name; whole numbers else from 1, others from 0."""


def bounds_of(config: Any, prefix: str = "") -> dict[str, tuple[float, float, float]]:  # noqa: ANN401
    """Return value, least and most of every number of a config, by dotted key."""
    found: dict[str, tuple[float, float, float]] = {}
    for f in dataclasses.fields(config):
        value = getattr(config, f.name)
        if dataclasses.is_dataclass(value):
            found |= bounds_of(value, f"{prefix}{f.name}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            default = (1, _MOST) if isinstance(value, int) else (0.0, _MOST)
            found[prefix + f.name] = (value, *_LIMITS.get(f.name, default))
    return found
