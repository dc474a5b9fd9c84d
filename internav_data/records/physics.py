"""Physical properties of objects, and the pushes that an agent gives them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Final, Literal

PushModel = Literal["force", "kick", "step"]
"""Name of a push in configs and options: a key of `PUSH_SPECS`."""


Affordance = Literal["push", "pick"]
"""Interaction by which agents try to move objects of a type."""


@dataclass(frozen=True, slots=True)
class Dynamics:
    """Properties of one object that decide what happens when an agent acts on it.

    Two objects of one asset share its geometry; their dynamics may differ.
    """

    mass_kg: float
    """Mass, kilograms."""
    friction: float
    """Coulomb friction coefficient on floor, walls and other objects."""
    pushable: bool
    """Whether the agent's push can act on it."""
    pickable: bool
    """Whether the agent can pick it up."""

    @property
    def fixed(self) -> bool:
        """Whether it is bolted down: nothing can act on it, and it stays whatever strikes it."""
        return not (self.pushable or self.pickable)


@dataclass(frozen=True, slots=True)
class PushSpec:
    """Parameters of a push at an object's centre of mass, parallel to the floor.

    The force acts until the object has reached the speed (the last impulse is scaled to give
    exactly this speed) or the time is over; then the object is let go. An infinite force gives the
    speed at once, whatever the mass. With a distance, the push goes on: it holds the object at the
    speed, by a part of the force, until the object has moved that far.
    """

    force_n: float
    """Largest force, newtons."""
    speed_m_s: float
    """Largest speed that the push gives, m/s."""
    seconds: float
    """Time after which the object is let go at the latest, seconds."""
    distance_m: float = 0.0
    """Distance along the push after which it is let go, metres; 0 to let it go at the speed."""


FORCE_N: Final = 200.0
"""Force of a push, newtons, unless a config names another."""
PUSH_SPECS: Final[Mapping[PushModel, PushSpec]] = MappingProxyType(
    {
        "force": PushSpec(force_n=FORCE_N, speed_m_s=2.0, seconds=0.5),
        "kick": PushSpec(force_n=math.inf, speed_m_s=2.0, seconds=0.5),
        "step": PushSpec(force_n=FORCE_N, speed_m_s=0.5, seconds=1.0, distance_m=0.22),
    }
)
"""Parameters by push model: the paper's constant force, the released code's 2 m/s for every mass,
and a slow push that ends about a lattice step (0.25 m) away."""


@lru_cache(maxsize=64)
def push_spec(model: PushModel, force_n: float = FORCE_N) -> PushSpec:
    """Return the parameters of a push model, with another force where it has a finite one.

    Parameters
    ----------
    model
        Name of the push model.
    force_n
        Force, newtons.

    """
    spec = PUSH_SPECS[model]
    return spec if math.isinf(spec.force_n) else replace(spec, force_n=force_n)
