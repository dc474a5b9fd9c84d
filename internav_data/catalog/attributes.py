"""Hidden attributes: mass, friction and fixedness of single objects, drawn given their type.

They are the unobserved confounder of the paper (section 3): the same chair is light here and
bolted down there, and only acting on it tells. The look stays the asset's. The random numbers of an
object are drawn before its asset is known, so that attributes and look share nothing but the type.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from statistics import median
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from internav_data.records import Dynamics, type_affordances

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

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

    def dynamics(self, mass_kg: float, friction: float, *, free: bool) -> Dynamics:
        """Return the dynamics of an object that is free or fixed."""
        # An asset of the type's minority, as the only apple that is pushed, follows the others.
        push = self.affordance == "push"
        return Dynamics(mass_kg, friction, pushable=free and push, pickable=free and not push)


@dataclass(frozen=True, slots=True, eq=False)
class HiddenAttributes:
    """Distribution of the attributes of single objects, given their asset."""

    strength: float
    """Share of the objects whose attributes do not depend on their asset, given its type."""
    types: Mapping[str, TypeAttributes]
    """Attributes by type; types that nobody can handle are not among them."""

    def affordance(self, asset: Asset) -> Affordance | None:
        """Return the interaction of which objects of an asset can be the target; None for none."""
        known = self._known(asset)
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
        known = self._known(asset)
        if known is None:
            return asset.dynamics
        independent, fixed, mass, friction = draws
        if independent >= self.strength:
            return known.dynamics(asset.mass_kg, asset.friction, free=not asset.dynamics.fixed)
        return known.dynamics(
            known.masses_kg[int(mass * len(known.masses_kg))],
            known.frictions[int(friction * len(known.frictions))],
            free=fixed >= FIXED_SHARES[known.affordance],
        )

    def possible(self, asset: Asset) -> tuple[tuple[float, Dynamics], ...]:
        """Return the dynamics that an asset's objects can have, each after its probability."""
        known = self._known(asset)
        if known is None:
            return ((1.0, asset.dynamics),)
        fixed = FIXED_SHARES[known.affordance]
        levels = tuple(product(known.masses_kg, known.frictions))
        each = self.strength / len(levels)
        own = known.dynamics(asset.mass_kg, asset.friction, free=not asset.dynamics.fixed)
        found = [(1.0 - self.strength, own)]
        for free, share in ((True, 1.0 - fixed), (False, fixed)):
            found += [(each * share, known.dynamics(*level, free=free)) for level in levels]
        return tuple(pair for pair in found if pair[0] > 0.0)

    def _known(self, asset: Asset) -> TypeAttributes | None:
        return self.types.get(asset.type) if asset.spawnable else None


@lru_cache(maxsize=4)
def _types_of(spawnable: tuple[Asset, ...]) -> Mapping[str, TypeAttributes]:
    out = {}
    for type_, affordance in type_affordances(spawnable).items():
        assets = [asset for asset in spawnable if asset.type == type_]
        middle = median(asset.mass_kg for asset in assets)
        frictions = sorted(asset.friction for asset in assets)
        out[type_] = TypeAttributes(
            affordance,
            tuple(float(f"{factor * middle:.3g}") for factor in MASS_FACTORS),
            tuple(frictions[sixth * len(frictions) // 6] for sixth in FRICTION_SIXTHS),
        )
    return out


def hidden_attributes(
    config: CatalogConfig, spawnable: tuple[Asset, ...]
) -> HiddenAttributes | None:
    """Return the distribution of attributes of a config; None where the look tells them.

    Parameters
    ----------
    config
        Settings of the attributes.
    spawnable
        All assets of the catalogue that episodes may spawn.

    """
    if config.attributes == "look":
        return None
    return HiddenAttributes(config.strength, _types_of(spawnable))
