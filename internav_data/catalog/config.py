"""Settings of the catalogue: what the look of an object tells about its attributes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from internav_data.core.config import Bounds, check_bounds, of_dataset
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

Attributes = Literal["look", "hidden"]
"""Source of mass, friction and fixedness: the asset's look, or hidden draws for each object."""


@dataclass(frozen=True, slots=True)
class CatalogConfig:
    """Settings of the objects' attributes: mass, friction, and whether they are fixed."""

    attributes: Attributes = "look"
    """`look`: all objects of an asset have the asset's mass, friction and abilities; `hidden`:
    these are drawn for each object, and targets and reasons do not tell them."""
    strength: Annotated[float, Bounds(0.0, 1.0)] = 1.0
    """Share of the objects whose attributes do not depend on their asset, given its type; the
    others have their asset's. `hidden` only."""

    def check(self, prefix: str = "catalog.") -> None:
        """Check all values.

        Raises
        ------
        UsageError
            A value is out of its bounds, `attributes` is no such word, or a strength is given where
            the look tells the attributes.

        """
        check_bounds(self, "{key}: expected {expected}, got {value}", prefix)
        if self.attributes not in get_args(Attributes):
            words = " or ".join(map(repr, get_args(Attributes)))
            raise UsageError(f"{prefix}attributes: expected {words}, got {self.attributes!r}")
        if self.attributes == "look" and self.strength != 1.0:
            raise UsageError(
                f"{prefix}strength: {self.strength} has no effect where the look tells the "
                f"attributes; set {prefix}attributes = 'hidden', or leave it out"
            )

    @staticmethod
    def of_dataset(config: Mapping[str, Any]) -> CatalogConfig:
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
        return of_dataset(CatalogConfig(), config, "catalog")
