"""Policies to evaluate: reference policies by name, and trained agents from a run's folder."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.envs.sensors import DEFAULT_SENSORS
from internav_data.evaluation.archive import About
from internav_data.evaluation.evaluator import episode_generator
from internav_data.evaluation.reference_policies import REFERENCE_POLICIES, reference_policy
from internav_data.evaluation.tables import row_name
from internav_data.records.errors import UsageError
from internav_data.world.actions import ACTIONS

if TYPE_CHECKING:
    from numpy.random import Generator
    from numpy.typing import NDArray

    from internav_data.camp.config import NetworkConfig
    from internav_data.dataset import Dataset
    from internav_data.envs.types import Observations
    from internav_data.evaluation.evaluator import EvaluationConfig, Note, Policy
    from internav_data.records import Episode

_NAMES: Final = {
    len(names): names
    for names in (("Navigate", "Push", "Pick", "Done"), tuple(action.label for action in ACTIONS))
}
"""Names of options and of actions, by their number."""
_NOTED: Final = {
    "option_probs": ("option", "option"),
    "intent": ("intent", ""),
    "action_probs": ("action", "choice"),
}
"""Distributions that agents record: their title, and the field of the choice."""
_PROGRESS: Final = ("environment_steps", "cloned_frames", "training_s")
"""Counters of a run that its evaluations show."""


@dataclass(frozen=True, slots=True)
class EvaluatedPolicy:
    """Policy to evaluate, with the facts about it."""

    policy: Policy
    about: About


class AgentPolicy:
    """Trained agent as a `Policy`; torch is imported when it acts.

    Parameters
    ----------
    name
        Name of its row in tables.
    agent
        Agent with `initial_state` and `act`, as `internav_data.camp.agents` has them; a user's own
        needs no base class to be played.
    image_size
        Size of the pictures that it was trained with, pixels a side.
    greedy
        Take the most probable option and action, rather than drawn ones.
    """

    def __init__(self, name: str, agent: Any, image_size: int, *, greedy: bool) -> None:  # noqa: ANN401
        self.name, self.image_size = name, image_size
        self.sensors = getattr(agent, "sensors", DEFAULT_SENSORS)
        self._agent, self._greedy = agent, greedy
        self._seed = 0
        self._state: dict[str, Any] = {}
        self._episode_starts: NDArray[np.bool_] = np.zeros(0, np.bool_)
        self._draws: list[Generator | None] = []
        self._record: Any = None

    def begin(self, count: int, seed: int) -> None:
        """See `Policy`."""
        self._agent.eval()
        self._seed, self._state = seed, self._agent.initial_state(count)
        self._episode_starts, self._draws = np.ones(count, np.bool_), [None] * count

    def start(self, slot: int, episode: Episode) -> None:
        """See `Policy`."""
        self._episode_starts[slot] = True
        self._draws[slot] = episode_generator(self._seed, episode)

    def act(self, observations: Observations) -> NDArray[np.int64]:
        """See `Policy`. Two numbers are drawn a step, used or not: for an option, an action."""
        import torch  # noqa: PLC0415 - reference policies do without

        device = next((p.device for p in self._agent.parameters()), torch.device("cpu"))
        seen = {name: torch.tensor(array, device=device) for name, array in observations.items()}
        uniforms = None
        if not self._greedy:
            drawn = np.zeros((len(self._draws), 2), np.float32)
            for row, draw in zip(drawn, self._draws, strict=True):
                if draw is not None:
                    row[:] = draw.random(2, np.float32)
            uniforms = torch.from_numpy(drawn).to(device)
        episode_starts = torch.from_numpy(self._episode_starts).to(device)
        with torch.inference_mode():
            step = self._agent.act(seen, self._state, episode_starts, uniforms)
        self._state, self._record = step.state, step.record
        self._episode_starts = np.zeros(len(self._episode_starts), np.bool_)
        actions: NDArray[np.int64] = step.action.cpu().numpy()
        return actions

    def notes(self, slot: int) -> list[Note]:
        """Return the distributions behind a slot's last action: options, intent, actions."""
        notes: list[Note] = []
        for name, (title, taken) in _NOTED.items():
            noted = getattr(self._record, name, None)
            if noted is None:
                continue
            shares = tuple(float(share) for share in noted[slot].reshape(-1).tolist())
            names = _NAMES.get(len(shares))
            chosen = getattr(self._record, taken, None)
            if names is not None:
                notes.append((title, names, shares, -1 if chosen is None else int(chosen[slot])))
        return notes


def candidate(
    who: str,
    dataset: Dataset[Episode],
    settings: EvaluationConfig,
    *,
    greedy: bool = False,
    without_intent: bool = False,
) -> EvaluatedPolicy:
    """Return a reference policy by its name, or the agent of a run's folder.

    An agent plays on as many of torch's threads as it was trained with (`run.threads`).

    Raises
    ------
    UsageError
        There is neither, or the agent cannot be evaluated as asked.
    """
    about = About(
        name=who, method=who, dataset=dataset.fingerprint, split=dataset.split or "all",
        seed=settings.seed, max_steps=settings.max_steps, is_reference=True,
    )  # fmt: skip
    if who in REFERENCE_POLICIES:
        return EvaluatedPolicy(reference_policy(who, dataset), about)
    if not Path(who).exists():
        raise UsageError(
            f"{who}: neither a run's folder nor a reference policy; expected what `camp-train` "
            f"wrote, or some of {', '.join(REFERENCE_POLICIES)} with commas between them"
        )
    import torch  # noqa: PLC0415 - reference policies do without

    from internav_data.camp.checkpoint import load_agent  # noqa: PLC0415 - torch

    agent: Any = load_agent(who)
    # Networks of 16 small pictures are no work for two threads, which wait for each other.
    torch.set_num_threads(agent.config.run.threads)
    about = replace(_facts(agent, about), greedy=greedy, without_intent=without_intent)
    about = replace(about, name=row_name(about) + _observation(agent.config.network))
    size = agent.config.network.image_size
    if without_intent:
        agent = agent.without_intent()
    return EvaluatedPolicy(AgentPolicy(about.name, agent, size, greedy=greedy), about)


def reference_policies_beside(dataset: Dataset[Episode]) -> list[str]:
    """Return the reference policies that go beside a trained agent: those that the dataset has."""
    experts = dataset.to_table(["expert"]).column("expert")
    return ["expert", "shortest_path"] if experts.null_count < len(experts) else ["shortest_path"]


def _observation(network: NetworkConfig) -> str:
    """Return what a row's name says of an agent's map and of hidden attributes that it shows."""
    if network.observation == "camera":
        return ""
    told, seen = network.privileged, " as seen" if network.map_occlusion else ""
    return f" (map{seen}{'; privileged: ' if told else ''}{', '.join(told)})"


def _facts(agent: Any, about: About) -> About:  # noqa: ANN401 - what `load_agent` returns
    """Return `about` with the agent's `method`, `config` and `progress`."""
    from internav_data.camp.agents import AGENTS  # noqa: PLC0415 - torch

    config = agent.config
    has_intent = agent.method in AGENTS and AGENTS[agent.method].intent
    return replace(
        about,
        method=agent.method,
        is_reference=False,
        intent=config.agent.intent if has_intent else "",
        sync_every=config.agent.sync_every if has_intent else None,
        training_seed=config.seed,
        **{name: agent.progress.get(name) for name in _PROGRESS},
        parameters=sum(p.numel() for p in agent.parameters()),
    )
