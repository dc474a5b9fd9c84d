"""Settings of a dataset's generation that the validator needs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Mapping

GAP_M = 0.01


@dataclass(frozen=True, slots=True)
class CheckedConfig:
    """Generation settings that decide which predicates hold."""

    push_model: Literal["force", "kick", "step"] = "force"
    force_n: float = 200.0
    """Force of the agent's pushes, newtons."""
    hands: Literal["free", "real"] = "free"
    gap_m: float = GAP_M
    """Minimum distance of a spawned obstacle from everything else, metres."""
    solvable: bool = False
    """Whether every episode must have an expert."""
    engine: str | None = None
    """Physics engine that every episode names; None where the config names none."""
    cross_check: bool = False
    """Whether a second engine was asked for each outcome of a push."""
    other_engine: str | None = None
    """Engine to compare the outcomes with, in place of the replay; None to replay."""
    same_hardware: bool = True
    """Whether this machine's arithmetic made the data: then replays equal them to the last bit."""


def checked_config(config: Mapping[str, Any]) -> CheckedConfig:
    """Read the settings from a manifest's config; missing ones have their defaults.

    Raises
    ------
    CorruptDataError
        A value that no generator writes.

    """
    values, world = _section(config, "episodes"), _section(config, "world")
    model, force = world.get("push_model", "force"), world.get("force_n", 200.0)
    gap = values.get("gap_m", GAP_M)
    if model not in ("force", "kick", "step"):
        raise CorruptDataError(
            f"manifest.json: config.world.push_model: expected force, kick or step, "
            f"got {model!r}; "
            "generate the dataset again"
        )
    if type(force) not in (int, float) or not 0 < force < math.inf:
        raise CorruptDataError(
            f"manifest.json: config.world.force_n: expected newtons, got {force!r}; generate the "
            "dataset again"
        )
    hands = world.get("hands", "free")
    if hands not in ("free", "real"):
        raise CorruptDataError(
            f"manifest.json: config.world.hands: expected free or real, got {hands!r}; generate "
            "the dataset again"
        )
    physics = _section(config, "physics")
    engine, cross_check = physics.get("engine"), physics.get("cross_check", False)
    if not isinstance(engine, str | None) or not isinstance(cross_check, bool):
        raise CorruptDataError(
            "manifest.json: config.physics: expected an engine's name and cross_check true or "
            f"false, got {engine!r} and {cross_check!r}; generate the dataset again"
        )
    return CheckedConfig(
        engine=engine,
        cross_check=cross_check,
        push_model=model,
        hands=hands,
        force_n=float(force),
        gap_m=float(gap) if isinstance(gap, int | float) else GAP_M,
        solvable=values.get("keep_unsolvable") is False,
    )


def _section(config: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    values = config.get(name)
    return values if isinstance(values, dict) else {}
