"""Physics as pure functions of plain data: settle, push, the engines behind them, their cache."""

from internav_data.physics.push import PushResult, push
from internav_data.physics.registry import DEFAULT_ENGINE, ENGINES, cache_disabled, get_engine
from internav_data.physics.scene import (
    AgentCollider,
    Body,
    Engine,
    PhysicsScene,
    PushSolution,
    SettleSolution,
    wall_body,
)
from internav_data.physics.settle import SettleResult, settle

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
