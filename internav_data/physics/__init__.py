"""Physics as pure functions of plain data: settle, push, the engines behind them, their cache."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports
from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES

if TYPE_CHECKING:
    from internav_data.physics.cache import Solver
    from internav_data.physics.engines.protocol import Engine, Simulation
    from internav_data.physics.pushing import PushResult, push
    from internav_data.physics.registry import cache_disabled, get_solver
    from internav_data.physics.scene import (
        AgentCollider,
        Body,
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
    "Simulation",
    "Solver",
    "cache_disabled",
    "get_solver",
    "push",
    "settle",
    "wall_body",
]

# The names of the engines alone need neither numba nor Bullet.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "cache": ["Solver"],
        "engines.protocol": ["Engine", "Simulation"],
        "pushing": ["PushResult", "push"],
        "registry": ["cache_disabled", "get_solver"],
        "scene": [
            "AgentCollider",
            "Body",
            "PhysicsScene",
            "PushSolution",
            "SettleSolution",
            "wall_body",
        ],
        "settling": ["SettleResult", "settle"],
    },
)
