"""Settings of the catalogue: what the look of an object tells about its attributes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from internav_data.core.config import Bounds, check_bounds
from internav_data.records.errors import UsageError

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

    def check(self) -> None:
        """Check all values.

        Raises
        ------
        UsageError
            A value is out of its bounds, `attributes` is no such word, or a strength is given where
            the look tells the attributes.

        """
        check_bounds(self, "{key}: expected {expected}, got {value}", "catalog.")
        if self.attributes not in get_args(Attributes):
            words = " or ".join(map(repr, get_args(Attributes)))
            raise UsageError(f"catalog.attributes: expected {words}, got {self.attributes!r}")
        if self.attributes == "look" and self.strength != 1.0:
            raise UsageError(
                f"catalog.strength: {self.strength} has no effect where the look tells the "
                "attributes; set catalog.attributes = 'hidden', or leave it out"
            )
