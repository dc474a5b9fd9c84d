"""Beliefs about objects from what can be seen: averages of their type, and what failing taught.

Mass, friction and fixedness of an object cannot be seen; its type and its geometry can.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from functools import lru_cache
from math import fsum
from typing import TYPE_CHECKING, Final

from internav_data.core.arithmetic import plain_sum
from internav_data.planner.push_heuristic import GRAVITY
from internav_data.records import Dynamics

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from internav_data.catalog.attributes import HiddenAttributes
    from internav_data.records import Asset, PushSpec
    from internav_data.world import MovableObject, World

UNKNOWN: Final = Dynamics(mass_kg=1000.0, friction=1.0, pushable=False, pickable=False)
"""Belief about an object of an unknown type: that it is fixed."""
PRIOR_WEIGHT: Final = 2.0
"""Weight of a type's share of movable objects, in objects tried."""


@dataclass(frozen=True, slots=True)
class TypeBelief:
    """Belief about all objects of a type before any of them was touched."""

    dynamics: Dynamics
    """Mean mass and friction of the objects that can be moved, and what most of these allow."""
    movable_share: float
    """Share of the type's objects that the agent can push or pick up."""


def type_beliefs(
    assets: Iterable[Asset], spec: PushSpec, hidden: HiddenAttributes | None = None
) -> Mapping[str, TypeBelief]:
    """Return the belief about each type: averages over its assets, under a dataset's settings.

    Parameters
    ----------
    assets
        Assets of a catalogue.
    spec
        Parameters of a push, whose force decides what is too heavy.
    hidden
        Distribution of the objects' attributes; None where they are those of their asset.

    """
    by_type: dict[str, list[tuple[float, Dynamics]]] = defaultdict(list)
    for asset in sorted(assets, key=lambda asset: asset.asset_id):
        possible = ((1.0, asset.dynamics),) if hidden is None else hidden.possible(asset)
        by_type[asset.type] += possible
    return {kind: _belief(group, spec) for kind, group in by_type.items()}


def _belief(group: Sequence[tuple[float, Dynamics]], spec: PushSpec) -> TypeBelief:
    """Return the belief about objects from the dynamics they can have, with their weights."""
    able = [(w, d) for w, d in group if d.pickable or (d.pushable and _yields(d, spec))]
    counted = able or group
    weight = fsum(w for w, _ in counted)
    picked, pushed = fsum(w * d.pickable for w, d in able), fsum(w * d.pushable for w, d in able)
    dynamics = Dynamics(
        mass_kg=fsum(w * d.mass_kg for w, d in counted) / weight,
        friction=fsum(w * d.friction for w, d in counted) / weight,
        pushable=pushed > picked,
        pickable=0 < picked >= pushed,
    )
    return TypeBelief(dynamics, fsum(w for w, _ in able) / fsum(w for w, _ in group))


def _yields(dynamics: Dynamics, spec: PushSpec) -> bool:
    """Return whether a push overcomes an object's friction on the floor."""
    return dynamics.friction * dynamics.mass_kg * GRAVITY < spec.force_n


class Experience:
    """Experience of acting in one world: which objects moved, and which did not.

    Parameters
    ----------
    beliefs
        Beliefs by type; a type without one is believed to be fixed.
    """

    def __init__(self, beliefs: Mapping[str, TypeBelief]) -> None:
        self._beliefs = beliefs
        self._moved: dict[str, dict[int, bool]] = defaultdict(dict)

    def note(self, world: World, index: int, *, moved: bool) -> None:
        """Note whether an object, given by its index, yielded to a push or a pick."""
        self._moved[world.items[index].asset.type][index] = moved

    @property
    def immovable(self) -> frozenset[int]:
        """Indices of the objects that did not yield."""
        return frozenset(
            k for tried in self._moved.values() for k, moved in tried.items() if not moved
        )

    def success(self, world: World, index: int) -> float:
        """Return the believed probability that an object yields.

        That of its type, of which the objects tried so far are a sample; 1 once it has yielded.
        """
        kind = world.items[index].asset.type
        tried = self._moved.get(kind, {})
        if index in tried:
            return float(tried[index])
        belief = self._beliefs.get(kind)
        prior = 0.0 if belief is None else belief.movable_share
        return (PRIOR_WEIGHT * prior + plain_sum(tried.values())) / (PRIOR_WEIGHT + len(tried))

    def believed(self, world: World) -> World:
        """Return a world as it is believed to be: all poses, and the types' dynamics."""
        other = world.copy()
        other.items = tuple(_believed(item, self._belief(item)) for item in world.items)
        return other

    def _belief(self, item: MovableObject) -> Dynamics:
        belief = self._beliefs.get(item.asset.type)
        if belief is None:
            return UNKNOWN
        if item.affordance is None:
            return belief.dynamics
        # Where attributes are hidden, everybody knows what can be tried with a type.
        push = item.affordance == "push"
        return replace(belief.dynamics, pushable=push, pickable=not push)


@lru_cache(maxsize=2048)
def _believed(item: MovableObject, dynamics: Dynamics) -> MovableObject:
    # Cached: searches keep what they know of an object by its identity.
    return replace(item, dynamics=dynamics)
