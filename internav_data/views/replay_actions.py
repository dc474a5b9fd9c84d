"""Action lists in JSON files, as `internav-gen replay --actions` reads them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from internav_data.core.files import FileLimits, read_json
from internav_data.records.errors import UsageError
from internav_data.views.replay_story import MAX_ACTIONS
from internav_data.world import ACTION_COUNT, ACTIONS, Action

if TYPE_CHECKING:
    from pathlib import Path

_KEYS: Final = {"episode_id", "actions"}
_NAMES: Final = {action.name.replace("_", "").lower(): action for action in Action}
_EXAMPLE: Final = '["MoveAhead", "PushAhead", 0, 11] or {"episode_id": ..., "actions": [...]}'
_FILE: Final = FileLimits(error=UsageError, remedy=f"expected {_EXAMPLE}")


@dataclass(frozen=True, slots=True)
class ActionList:
    """Actions of an episode."""

    episode_id: str | None
    """Id of the episode, None if the file names none."""
    actions: tuple[int, ...]
    """Numbers of `Action`; -1 waits."""


def read_actions(path: Path) -> ActionList:
    """Read actions from a JSON file.

    The file holds a list of actions, or an object with `actions` and, optionally, their
    `episode_id`. An action is its number (0 MoveAhead to 11 Done; -1 waits) or its name:
    MoveAhead, move_ahead and MOVE_AHEAD are one.

    Raises
    ------
    UsageError
        The file cannot be read, or does not hold such a list.
    """
    data = read_json(path, _FILE)
    episode_id = None
    if isinstance(data, dict):
        if not {"actions"} <= set(data) <= _KEYS:
            keys = ", ".join(map(repr, data)) or "none"
            raise UsageError(f"{path}: the keys are {keys}; expected {_EXAMPLE}")
        episode_id, data = data.get("episode_id"), data["actions"]
        if episode_id is not None and not isinstance(episode_id, str):
            raise UsageError(f"{path}: episode_id: expected a string, got {episode_id!r}")
    if not isinstance(data, list):
        raise UsageError(f"{path}: expected a list of actions, as in {_EXAMPLE}")
    if not 0 < len(data) <= MAX_ACTIONS:
        raise UsageError(f"{path}: {len(data)} actions; expected 1 to {MAX_ACTIONS}")
    return ActionList(episode_id, tuple(_action(path, k, entry) for k, entry in enumerate(data)))


def _action(path: Path, place: int, entry: object) -> int:
    if isinstance(entry, str):
        found = _NAMES.get(entry.replace("_", "").lower())
        if found is not None:
            return int(found)
    elif type(entry) is int and Action.WAIT <= entry < ACTION_COUNT:
        return entry
    names = ", ".join(f"{int(a)} {a.label}" for a in ACTIONS)
    raise UsageError(f"{path}: action {place} is {str(entry)[:40]!r}; expected one of {names}, -1")
