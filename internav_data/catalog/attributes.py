"""Hidden attributes: mass, friction and fixedness of single objects, drawn given their type.

They are the unobserved confounder of the paper (section 3): the same chair is light here and
bolted down there, and only acting on it tells. The look stays the asset's. The random numbers of an
object are drawn before its asset is known, so that attributes and look share nothing but the type.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from statistics import median
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from internav_data.records import Dynamics, type_affordances

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.catalog.collection import Catalogue
    from internav_data.catalog.config import CatalogConfig
    from internav_data.records import Affordance, Asset

FIXED_SHARES: Final[Mapping[Affordance, float]] = MappingProxyType({"push": 0.5, "pick": 0.1})
"""Share of fixed objects, by the affordance of their type, of those whose attributes are drawn: a
quarter of all obstacles, of which more are picked up than pushed."""
MASS_FACTORS: Final = (0.5, 0.8, 1.25, 2.0)
"""Masses over the median mass of the type's assets. Few levels: pushes on free floor recur, and are
solved once for each."""
FRICTION_SIXTHS: Final = (1, 3, 5)
"""Sixths of the type's assets that are smoother than each level of friction."""
DRAWS: Final = 4
"""Random numbers of one object: whether it is independent of its asset, whether it is fixed, the
levels of mass and friction."""


@dataclass(frozen=True, slots=True)
class TypeAttributes:
    """Attributes that objects of one type can have."""

    affordance: Affordance
    masses_kg: tuple[float, ...]
    frictions: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class HiddenAttributes:
    """Distribution of the attributes of single objects, given their asset."""

    strength: float
    """Share of the objects whose attributes do not depend on their asset, given its type."""
    types: Mapping[str, TypeAttributes]
    """Attributes by type; types that nobody can handle are not among them."""

    def affordance(self, asset: Asset) -> Affordance | None:
        """Return the interaction of which objects of an asset can be the target; None for none."""
        known = self.types.get(asset.type) if asset.spawnable else None
        return None if known is None else known.affordance

    def dynamics(self, asset: Asset, draws: Sequence[float]) -> Dynamics:
        """Return the dynamics of one object.

        Parameters
        ----------
        asset
            The object's asset.
        draws
            `DRAWS` numbers, uniform in [0, 1).
        """
        known = self.types.get(asset.type) if asset.spawnable else None
        if known is None:
            return asset.dynamics
        independent, fixed, mass, friction = draws
        drawn = independent < self.strength
        free = fixed >= FIXED_SHARES[known.affordance] if drawn else not asset.dynamics.fixed
        # An asset of the type's minority, as the only apple that is pushed, follows the others.
        pushable = free and known.affordance == "push"
        pickable = free and known.affordance == "pick"
        if not drawn:
            return Dynamics(asset.mass_kg, asset.friction, pushable, pickable)
        return Dynamics(
            known.masses_kg[int(mass * len(known.masses_kg))],
            known.frictions[int(friction * len(known.frictions))],
            pushable,
            pickable,
        )


@lru_cache(maxsize=4)
def _types_of(catalogue: Catalogue) -> Mapping[str, TypeAttributes]:
    out = {}
    for type_, affordance in type_affordances(catalogue.spawnable).items():
        assets = [asset for asset in catalogue.of_type(type_) if asset.spawnable]
        middle = median(asset.mass_kg for asset in assets)
        frictions = sorted(asset.friction for asset in assets)
        out[type_] = TypeAttributes(
            affordance,
            tuple(float(f"{factor * middle:.3g}") for factor in MASS_FACTORS),
            tuple(frictions[sixth * len(frictions) // 6] for sixth in FRICTION_SIXTHS),
        )
    return out


def hidden_attributes(config: CatalogConfig, catalogue: Catalogue) -> HiddenAttributes | None:
    """Return the distribution of attributes of a config; None where the look tells them."""
    if config.attributes == "look":
        return None
    return HiddenAttributes(config.strength, _types_of(catalogue))
