"""What training is between two updates, as counters and tensors by name; and back again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import torch

from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from torch import Tensor
    from torch.optim import Optimizer

    from internav_data.camp.agents import State

_OPTIMISER, _STATE, _STARTS = "optimiser", "state", "starts"
_RANDOM: Final = "random"
"""States of torch's generators, bytes. (What training draws is keyed by seed and update: only a
user's own agent could draw from these.)"""


@dataclass(slots=True)
class Place:
    """Where a run is."""

    parts: list[str]
    """Stages that it is to go through."""
    clones: bool
    """Whether it clones the expert first."""
    stage: str = ""
    """Under way, or just over; none yet: empty."""
    done: int = 0
    """Updates of that stage."""
    updates: int = 0
    """Of all stages."""
    environment_steps: int = 0
    cloned_updates: int = 0
    cloned_frames: int = 0
    critics: dict[str, int] = field(default_factory=dict)
    """Rollouts that each critic has learnt from."""
    training_s: float = 0.0


def packed(optimiser: Optimizer, state: State, starts: Tensor | None = None) -> dict[str, Tensor]:
    """Return the optimiser's moments, what the agent remembers, and torch's random numbers."""
    said = {f"{_RANDOM}/cpu": torch.get_rng_state()}
    if torch.cuda.is_available():
        said[f"{_RANDOM}/cuda"] = torch.cuda.get_rng_state()
    for number, moments in optimiser.state_dict()["state"].items():
        said |= {f"{_OPTIMISER}/{number}/{name}": value for name, value in moments.items()}
    said |= {f"{_STATE}/{name}": kept for name, kept in state.items()}
    return said if starts is None else {**said, _STARTS: starts}


def unpack_optimiser(tensors: Mapping[str, Tensor], optimiser: Optimizer) -> None:
    """Put moments back.

    Raises
    ------
    CorruptDataError
        They are those of other parameters.
    """
    parameters = [p for group in optimiser.param_groups for p in group["params"]]
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in tensors.items():
        parts = key.split("/")
        if parts[0] != _OPTIMISER:
            continue
        number = int(parts[1]) if len(parts) == 3 and parts[1].isdecimal() else -1  # noqa: PLR2004 - group, number, name
        fits = 0 <= number < len(parameters)
        if not fits or value.shape not in {parameters[number].shape, torch.Size([])}:
            raise CorruptDataError(f"checkpoint: {key} is of no parameter that is trained now")
        state.setdefault(number, {})[parts[2]] = value
    optimiser.load_state_dict(
        {"state": state, "param_groups": optimiser.state_dict()["param_groups"]}
    )


def unpack_state(tensors: Mapping[str, Tensor], like: State, own: range, count: int) -> State:
    """Return what the agent remembered; `like` is what it does at a start.

    Parameters
    ----------
    tensors
        Of all `count` environments.
    like
        Of this rank's `own` ones.
    own, count
        Numbers of environments.

    Raises
    ------
    CorruptDataError
        It is another agent's, or of another number of environments.
    """
    return {
        name: _rows(tensors, f"{_STATE}/{name}", blank, own, count) for name, blank in like.items()
    }


def unpack_starts(tensors: Mapping[str, Tensor], like: Tensor, own: range, count: int) -> Tensor:
    """Return where an episode begins at the next step, (n,) bool; see `unpack_state`."""
    return _rows(tensors, _STARTS, like, own, count)


def _rows(tensors: Mapping[str, Tensor], name: str, like: Tensor, own: range, count: int) -> Tensor:
    kept, shape = tensors.get(name), (count, *like.shape[1:])
    if kept is None or tuple(kept.shape) != shape or kept.dtype != like.dtype:
        raise CorruptDataError(
            f"checkpoint: {name}: expected {like.dtype} {shape}, got "
            f"{None if kept is None else (kept.dtype, tuple(kept.shape))}"
        )
    return kept[own.start : own.stop].to(like.device)


def unpack_environments(progress: Mapping[str, Any], own: range) -> list[Any]:
    """Return what the environments with these numbers were."""
    states = progress.get("environments")
    if not isinstance(states, list):
        raise CorruptDataError("checkpoint: progress: environments: expected a list")
    return states[own.start : own.stop]


def unpack_random(tensors: Mapping[str, Tensor]) -> None:
    """Put torch's random numbers back."""
    try:
        torch.set_rng_state(tensors[f"{_RANDOM}/cpu"])
        if f"{_RANDOM}/cuda" in tensors and torch.cuda.is_available():
            torch.cuda.set_rng_state(tensors[f"{_RANDOM}/cuda"])
    except (KeyError, RuntimeError, TypeError) as error:
        raise CorruptDataError(f"checkpoint: {_RANDOM}: {error}") from error
