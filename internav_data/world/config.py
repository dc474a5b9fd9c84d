"""Settings of the world: how an agent's pushes and hands act on the objects."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, Literal, get_args

from internav_data.core.config import Bounds, check_bounds, of_dataset
from internav_data.records.errors import UsageError
from internav_data.records.physics import FORCE_N, PUSH_SPECS, PushModel, push_spec

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

    from internav_data.records import PushSpec


Hands = Literal["free", "real"]
"""Part of a held object in the world: none, or that of a thing that can block."""


@dataclass(frozen=True, slots=True)
class WorldConfig:
    """Settings of the world that outcomes, experts and environments share."""

    push_model: PushModel = "force"
    """Push: `force`, `force_n` up to 2 m/s; `kick`, 2 m/s at once for every mass; or `step`, at
    most `force_n`, held at 0.5 m/s for 0.22 m."""
    force_n: Annotated[float, Bounds(1.0, 2000.0)] = FORCE_N
    """Force of the agent's pushes, newtons; `kick` has none."""
    hands: Hands = "free"
    """`free`: what the agent holds is nowhere. `real`: it is carried before the agent and can block
    steps and turns, and Done fails while it is held."""

    def check(self, prefix: str = "world.") -> None:
        """Check all values.

        Raises
        ------
        UsageError
            A value is out of its bounds, or no push model has the name.

        """
        check_bounds(self, "{key}: expected {expected}, got {value}", prefix)
        for key, value, names in (
            ("push_model", self.push_model, PUSH_SPECS),
            ("hands", self.hands, get_args(Hands)),
        ):
            if value not in names:
                raise UsageError(
                    f"{prefix}{key}: expected one of {', '.join(names)}, got {value!r}"
                )

    def check_force(self, prefix: str = "world.") -> None:
        """Check that a push model without a force is given none.

        No part of `check`: an environment may kick in a dataset whose own pushes have a force.

        Raises
        ------
        UsageError
            `force_n` is set and `push_model` has no force.

        """
        if math.isinf(PUSH_SPECS[self.push_model].force_n) and self.force_n != FORCE_N:
            raise UsageError(
                f"{prefix}force_n: {self.push_model!r} moves every mass at once and has no force, "
                f"got {self.force_n:g} N; set it to {FORCE_N:g}, or {prefix}push_model to 'force' "
                "or 'step'"
            )

    @property
    def push_spec(self) -> PushSpec:
        """Parameters of a push."""
        return push_spec(self.push_model, self.force_n)

    @staticmethod
    def of_dataset(config: Mapping[str, Any]) -> WorldConfig:
        """Return the settings in a dataset's config; missing ones have their defaults.

        Parameters
        ----------
        config
            Config of a dataset's manifest.

        Raises
        ------
        CorruptDataError
            A value that no generator writes.

        """
        return of_dataset(DEFAULT_WORLD, config, "world")


DEFAULT_WORLD: Final = WorldConfig()
"""Settings of a world that names none."""
