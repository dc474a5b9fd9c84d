"""Physics as pure functions of plain data: settle, push, the engines behind them, their cache."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports
from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES

if TYPE_CHECKING:
    from internav_data.physics.pushing import PushResult, push
    from internav_data.physics.registry import cache_disabled, get_engine
    from internav_data.physics.scene import (
        AgentCollider,
        Body,
        Engine,
        PhysicsScene,
        PushSolution,
        SettleSolution,
        wall_body,
    )
    from internav_data.physics.settling import SettleResult, settle

__all__ = [
    "DEFAULT_ENGINE",
    "ENGINES",
    "AgentCollider",
    "Body",
    "Engine",
    "PhysicsScene",
    "PushResult",
    "PushSolution",
    "SettleResult",
    "SettleSolution",
    "cache_disabled",
    "get_engine",
    "push",
    "settle",
    "wall_body",
]

# The names of the engines alone need neither numba nor Bullet.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "pushing": ["PushResult", "push"],
        "registry": ["cache_disabled", "get_engine"],
        "scene": [
            "AgentCollider",
            "Body",
            "Engine",
            "PhysicsScene",
            "PushSolution",
            "SettleSolution",
            "wall_body",
        ],
        "settling": ["SettleResult", "settle"],
    },
)
