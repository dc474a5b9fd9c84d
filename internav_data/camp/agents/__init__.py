"""Agents by name, a row of `AGENTS` each, and a user's own.

An entry point of the group `internav.agents`, a function of a `CampConfig` that returns an `Agent`,
adds another.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Final

import torch

from internav_data.camp.agents.flat import PPOAgent, PPOIntentAgent
from internav_data.camp.agents.hierarchy import Hierarchy
from internav_data.camp.agents.nie import NIEAgent
from internav_data.camp.agents.protocol import Agent
from internav_data.camp.config import AgentConfig, CampConfig
from internav_data.envs.sensors import sensor_names
from internav_data.records import Purpose, TrainingStream, generator
from internav_data.records.errors import UsageError


@dataclass(frozen=True, slots=True)
class Method:
    """Row of the table of methods."""

    make: Callable[[CampConfig], Agent[Any]]
    description: str
    """Text for `docs/training.md`."""
    privileged: str = "none"
    """Privileged input: observations that a robot would not have."""
    settings: tuple[str, ...] = ()
    """Fields of `AgentConfig` that it reads and that not every method does."""

    @property
    def intent(self) -> bool:
        """Whether it has an intent, so that `--intent` and `--sync-every` make variants of it."""
        return "intent" in self.settings


AGENTS: Final = {
    "camp": Method(
        Hierarchy,
        "a global policy opens Navigate, Push or Pick, conditioned on what the whole model is "
        "about to do (section 4)",
        settings=(
            "intent",
            "sync_every",
            "hand_back_step",
            "forbidden",
            "initial_interaction_probability",
        ),
    ),
    "hrl": Method(
        partial(Hierarchy, temporally_extended=False),
        "the same policies and the same pretraining; global decides at every step, Push and Pick "
        "have no Done, no intent",
        settings=("forbidden", "initial_interaction_probability"),
    ),
    "ppo": Method(PPOAgent, "one policy over all actions"),
    "ppo-intent": Method(
        PPOIntentAgent,
        "`ppo`, conditioned on what its own copy of some rollouts ago is about to do (figure 2c)",
        settings=("intent", "sync_every"),
    ),
    "nie": Method(
        NIEAgent,
        "`ppo` that foresees what each action does to objects in sight (Zeng et al. 2021)",
        "**instance ids**",
        settings=("nie_objects", "nie_weight"),
    ),
}
"""Methods by name; trainer, documentation and tests derive their lists from it."""
GROUP: Final = "internav.agents"
"""Entry points that add methods."""


def agent_names() -> list[str]:
    """Return the names of all methods; those of entry points come last."""
    return [*AGENTS, *sorted(_own_methods())]


def _own_methods() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=GROUP)}


def check_settings(name: str, config: CampConfig) -> None:
    """Check that a method reads those settings of agents that are not as they are by default.

    A user's own method may read any of them.

    Raises
    ------
    UsageError
        The method does not read a setting that was changed.
    """
    if name not in AGENTS:
        return
    if config.mine:
        raise UsageError(
            f"mine.{min(config.mine)}: method {name!r} has no settings of its own; leave it out, "
            f"or name your own method (entry points {GROUP})"
        )
    read = {each for method in AGENTS.values() for each in method.settings}
    for setting in sorted(read - {*AGENTS[name].settings}):
        value = getattr(config.agent, setting)
        if value != getattr(AgentConfig(), setting):
            others = ", ".join(key for key, method in AGENTS.items() if setting in method.settings)
            raise UsageError(
                f"agent.{setting} is {value!r}: method {name!r} has no use for it; leave it out, "
                f"or choose the method: {others}"
            )


def make_agent(name: str, config: CampConfig) -> Agent[Any]:
    """Make an agent; its parameters are a pure function of its name and config.

    Raises
    ------
    UsageError
        There is no such method, or the config does not suit it.
    """
    if name not in agent_names():
        raise UsageError(f"method {name!r}: expected one of {', '.join(agent_names())}")
    make = AGENTS[name].make if name in AGENTS else _own_methods()[name].load()
    seed = generator(config.seed, Purpose.TRAINING, attempt=TrainingStream.PARAMETERS).integers(
        2**62
    )
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(seed))
        agent: Agent[Any] = make(config)
    observation = config.network.observation
    if observation == "map" and "map" not in sensor_names(agent.sensors):
        raise UsageError(
            f"network.observation is 'map': method {name!r} takes no map; leave it out, or let the "
            "agent's `sensors` be `observation_sensors(config.network)`"
        )
    return agent
