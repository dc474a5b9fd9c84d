"""Settings of physics: which engine settles and pushes everything in a dataset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from internav_data.core.config import of_dataset
from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES, EngineName, second_engine
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any


@dataclass(frozen=True, slots=True)
class PhysicsConfig:
    """Settings of the physics that settling, outcomes, experts and environments share."""

    engine: EngineName = DEFAULT_ENGINE
    """Physics engine: `bullet` (pybullet) or `mujoco` (mujoco-core). Data of two engines differ;
    a dataset is of one, which its environments take too."""
    cross_check: bool = False
    """Ask the other engine for each outcome of a push too, and store whether both agree: `agrees`
    and `other_pose` of outcomes, `agreed` of episodes."""

    def check(self, prefix: str = "physics.") -> None:
        """Check all values.

        Raises
        ------
        UsageError
            No engine has the name.

        """
        if self.engine not in ENGINES:
            raise UsageError(
                f"{prefix}engine: expected one of {', '.join(ENGINES)}, got {self.engine!r}"
            )
        if self.other_engine not in (None, *ENGINES):
            raise UsageError(
                f"{prefix}cross_check: there is no second engine beside {self.engine}: expected "
                "false, got true"
            )

    @property
    def other_engine(self) -> EngineName | None:
        """Name of the engine that is asked for a second opinion; None for none."""
        return second_engine(self.engine) if self.cross_check else None

    @staticmethod
    def of_dataset(config: Mapping[str, Any]) -> PhysicsConfig:
        """Return the settings in a dataset's config; missing ones are those of `FIRST_PHYSICS`.

        Parameters
        ----------
        config
            Config of a dataset's manifest.

        Raises
        ------
        CorruptDataError
            A value that no generator writes.

        """
        return of_dataset(FIRST_PHYSICS, config, "physics")


DEFAULT_PHYSICS: Final = PhysicsConfig()
"""Settings of physics where none are named."""
FIRST_PHYSICS: Final = PhysicsConfig("bullet")
"""Settings of the datasets that name none, whatever the default is: they are older than these."""
