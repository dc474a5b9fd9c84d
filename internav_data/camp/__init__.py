"""Trainer of CaMP and its baselines; needs torch.

Read it in the order `config`, `networks`, `agents`, `rollout`, `ppo`, `train`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports

if TYPE_CHECKING:
    from internav_data.camp.agents.protocol import (
        Agent,
        AgentStep,
        Batch,
        Evaluated,
        ForwardOutput,
        State,
        StepRecord,
    )
    from internav_data.camp.config import CampConfig, preset
    from internav_data.camp.networks import (
        Encoder,
        RecurrentActorCritic,
        drawn,
        entropy_of,
        log_prob_of,
    )
    from internav_data.camp.rollout import Collector, uniforms_of

__all__ = [
    "Agent",
    "AgentStep",
    "Batch",
    "CampConfig",
    "Collector",
    "Encoder",
    "Evaluated",
    "ForwardOutput",
    "RecurrentActorCritic",
    "State",
    "StepRecord",
    "drawn",
    "entropy_of",
    "log_prob_of",
    "preset",
    "uniforms_of",
]

__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "agents.protocol": [
            "Agent", "AgentStep", "Batch", "Evaluated", "ForwardOutput", "State", "StepRecord",
        ],
        "config": ["CampConfig", "preset"],
        "networks": ["Encoder", "RecurrentActorCritic", "drawn", "entropy_of", "log_prob_of"],
        "rollout": ["Collector", "uniforms_of"],
    },
)  # fmt: skip
