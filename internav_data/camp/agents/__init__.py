"""Agents by name: `random`, `ppo`, `ppo-intent`, `nie`, `hrl`, `camp`, and a user's own.

One's own joins by an entry point of the group `internav.agents`: a callable that makes an `Agent`
of a `CampConfig`.
"""

from __future__ import annotations

from functools import partial
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Final

import torch

from internav_data.camp.agents.auxiliary import Auxiliary
from internav_data.camp.agents.flat import PPOAgent, PPOIntentAgent, RandomAgent
from internav_data.camp.agents.hierarchy import Hierarchy
from internav_data.camp.agents.nie import NIEAgent
from internav_data.camp.agents.protocol import Agent, AgentStep, Batch, Evaluated, State
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.camp.config import CampConfig

__all__ = [
    "AGENTS",
    "Agent",
    "AgentStep",
    "Auxiliary",
    "Batch",
    "Evaluated",
    "Hierarchy",
    "State",
    "agent_names",
    "make_agent",
    "without_intent",
]

AGENTS: Final[dict[str, Callable[[CampConfig], Agent]]] = {
    "random": RandomAgent,
    "ppo": PPOAgent,
    "ppo-intent": PPOIntentAgent,
    "nie": NIEAgent,
    "hrl": partial(Hierarchy, keeps=False),
    "camp": Hierarchy,
}
"""What makes the agent of each method."""
GROUP: Final = "internav.agents"


def agent_names() -> list[str]:
    """Return the names of all methods, a user's own last."""
    return [*AGENTS, *sorted(point.name for point in entry_points(group=GROUP))]


def make_agent(name: str, config: CampConfig) -> Agent:
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
        agent: Agent = make(config)
    return agent


def without_intent(agent: Agent) -> Agent:
    """Return the same networks fed the plane vector: Table 4's test without intent.

    Raises
    ------
    UsageError
        The agent has no intent.
    """
    if not isinstance(agent, PPOIntentAgent | Hierarchy) or not agent.told:
        raise UsageError("this agent has no intent to be evaluated without")
    return agent.without_intent()
