"""Agents by name: `random`, `ppo`, `ppo-intent`, `nie`, `hrl`, `camp`, and a user's own.

An entry point of the group `internav.agents`, a function of a `CampConfig` that returns an `Agent`,
adds another.
"""

from __future__ import annotations

from functools import partial
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, Final

import torch

from internav_data.camp.agents.flat import PPOAgent, PPOIntentAgent, RandomAgent
from internav_data.camp.agents.hierarchy import AuxiliaryAgent, Hierarchy
from internav_data.camp.agents.nie import NIEAgent
from internav_data.camp.agents.protocol import (
    Agent,
    AgentStep,
    Batch,
    Evaluated,
    State,
    StepRecord,
)
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.camp.config import CampConfig

__all__ = [
    "AGENTS",
    "Agent",
    "AgentStep",
    "AuxiliaryAgent",
    "Batch",
    "Evaluated",
    "Hierarchy",
    "State",
    "StepRecord",
    "agent_names",
    "make_agent",
]

AGENTS: Final[dict[str, Callable[[CampConfig], Agent[Any]]]] = {
    "random": RandomAgent,
    "ppo": PPOAgent,
    "ppo-intent": PPOIntentAgent,
    "nie": NIEAgent,
    "hrl": partial(Hierarchy, temporally_extended=False),
    "camp": Hierarchy,
}
"""Makers of agents by method."""
GROUP: Final = "internav.agents"
"""Entry points that add methods."""


def agent_names() -> list[str]:
    """Return the names of all methods; those of entry points come last."""
    return [*AGENTS, *sorted(point.name for point in entry_points(group=GROUP))]


def make_agent(name: str, config: CampConfig) -> Agent[Any]:
    """Make an agent; its parameters are a pure function of its name and config.

    Raises
    ------
    UsageError
        There is no such method, or the config does not suit it.
    """
    make = AGENTS.get(name)
    if make is None:
        own = {point.name: point for point in entry_points(group=GROUP)}
        if name not in own:
            raise UsageError(f"method {name!r}: expected one of {', '.join(agent_names())}")
        make = own[name].load()
    seed = generator(config.seed, Purpose.TRAINING, attempt=TrainingStream.PARAMETERS).integers(
        2**62
    )
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(seed))
        agent: Agent[Any] = make(config)
    return agent
