"""Intent: what the agent is about to do, as the deciding policy is told (section 4.2)."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Final

import torch
from torch import Tensor, nn

from internav_data.camp.networks import RecurrentActorCritic

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from internav_data.camp.networks import EpisodeSegments


EMBEDDED: Final = 12
"""Length of an embedded intent (section 5.2)."""


class IntentConditionedPolicy(RecurrentActorCritic):
    """A policy that is told an intent, through the linear layer E (equation 5).

    Parameters
    ----------
    inputs, hidden, chances
        As `RecurrentActorCritic` has them; inputs without the intent.
    intents
        Length of an intent: of what it distributes over.
    """

    def __init__(self, inputs: int, hidden: int, chances: Sequence[float], intents: int) -> None:
        super().__init__(inputs + EMBEDDED, hidden, chances)
        self.embed = nn.Linear(intents, EMBEDDED)

    def told(self, features: Tensor, intent: Tensor) -> Tensor:
        """Return the GRU's inputs."""
        return torch.cat([features, self.embed(intent)], -1)


class IntentPolicy(nn.Module):
    """pi' of equation 6: a copy of the deciding policy's E, GRU and actor, made now and then.

    It is fed the plane vector, keeps its own hidden state, and is never trained.

    Parameters
    ----------
    deciding
        Whom it copies.
    recursive
        Run twice in a step from the same hidden state, the second time on the first intent; the
        hidden state goes on from the first run.
    """

    def __init__(self, deciding: IntentConditionedPolicy, *, recursive: bool) -> None:
        super().__init__()
        self.embed = copy.deepcopy(deciding.embed)
        self.gru = copy.deepcopy(deciding.gru)
        self.actor = copy.deepcopy(deciding.actor)
        self._recursive = recursive
        self.requires_grad_(requires_grad=False)

    @torch.no_grad()
    def synchronise(self, deciding: IntentConditionedPolicy) -> None:
        """Copy the parameters, not the hidden states."""
        self.embed.load_state_dict(deciding.embed.state_dict())
        self.gru.load_state_dict(deciding.gru.state_dict())
        self.actor.load_state_dict(deciding.actor.state_dict())

    @torch.no_grad()
    def forward(
        self,
        features: Tensor,
        hidden: Tensor,
        course: EpisodeSegments,
        mix: Callable[[Tensor], Tensor],
        mask: Tensor,
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Work out intents.

        Parameters
        ----------
        features : (T, n, inputs)
            What the deciding policy sees, without the intent.
        hidden : (n, hidden)
            Before the first step.
        course
            Where episodes begin.
        mix
            Makes P(i) of P(omega'), both (T, n, …): equation 7.
        mask : (options,)
            0, or minus infinity for what cannot be chosen.

        Returns
        -------
        meant : (T, n, options)
            P(omega') of equation 6.
        intent : (T, n, intents)
            P(i).
        hidden : (n, hidden)
            After the last step.
        """
        inputs = torch.cat(
            [features, self.embed(uniform_intent(features, self.embed.in_features))], -1
        )
        out, after = course.run(self.gru, inputs, hidden)
        meant = torch.softmax(self.actor(out) + mask, -1)
        intent = mix(meant)
        if self._recursive:
            inputs = torch.cat([features, self.embed(intent)], -1)
            out = course.again(self.gru, inputs, hidden, out)
            meant = torch.softmax(self.actor(out) + mask, -1)
            intent = mix(meant)
        return meant, intent, after


def uniform_intent(features: Tensor, count: int) -> Tensor:
    """Return the intent without any inclination, (T, n, count)."""
    return features.new_full((*features.shape[:2], count), 1.0 / count)
