"""Physics as pure functions of plain data: settle, push, the engines behind them, their cache."""

from internav_data.physics.push import PushModel, PushResult, push
from internav_data.physics.registry import cache_disabled, engine_of_this_process
from internav_data.physics.scene import (
    AgentCollider,
    Body,
    Engine,
    PhysicsScene,
    PushSolution,
    PushSpec,
    SettleSolution,
    wall_body,
)
from internav_data.physics.settle import SettleResult, settle

__all__ = [
    "AgentCollider",
    "Body",
    "Engine",
    "PhysicsScene",
    "PushModel",
    "PushResult",
    "PushSolution",
    "PushSpec",
    "SettleResult",
    "SettleSolution",
    "cache_disabled",
    "engine_of_this_process",
    "push",
    "settle",
    "wall_body",
]
