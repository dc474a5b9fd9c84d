"""Predicates of attributes: mass, friction and fixedness of obstacles and furniture.

Where the look tells them, they are those of the asset. Where they are hidden, each object has those
of its asset or levels of its type, and over a dataset the shares of both are as the config says.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from internav_data.records import Asset, Dynamics, House, Obstacle
    from internav_data.verification.findings import FindingCollector

FIXED = {"push": 0.5, "pick": 0.1}
"""Share of fixed objects among those with attributes of their own, by their type's affordance."""
MASSES = (0.5, 0.8, 1.25, 2.0)
"""Levels of mass over the median of the type's assets."""
SIXTHS = (1, 3, 5)
"""Sixths of the type's assets that are smoother than the levels of friction."""
DEVIATIONS = 6.0
"""Standard deviations by which a count may differ from its expectation."""
FEW = 3.0
"""Further objects by which it may differ: few objects are not normally distributed."""
SELECTED = 0.25
"""Share of the expected fixed obstacles that must be there: draws without a plan are discarded, and
fixed obstacles leave fewer plans."""
NAMES = ("mass_kg", "friction", "pushable", "pickable")


@dataclass(frozen=True, slots=True)
class TypeLevels:
    """Attributes that objects of a type may have."""

    affordance: Literal["push", "pick"]
    masses: tuple[float, ...]
    frictions: tuple[float, ...]


def strength_of(config: Mapping[str, Any]) -> float | None:
    """Read from a manifest's config how far attributes are hidden; None where the look tells them.

    Raises
    ------
    CorruptDataError
        A value that no generator writes.

    """
    values = config.get("catalog")
    known: Mapping[str, Any] = values if isinstance(values, dict) else {}
    attributes, strength = known.get("attributes", "look"), known.get("strength", 1.0)
    number = isinstance(strength, int | float) and 0.0 <= strength <= 1.0
    if attributes not in ("look", "hidden") or not number:
        raise CorruptDataError(
            "manifest.json: config.catalog: expected attributes look or hidden and a strength from "
            f"0 to 1, got {attributes!r} and {strength!r}; generate the dataset again"
        )
    return float(strength) if attributes == "hidden" else None


def levels_by_type(assets: Iterable[Asset]) -> dict[str, TypeLevels]:
    """Derive from all assets of a dataset the attributes that objects of each type may have."""
    members: dict[str, list[Asset]] = {}
    for asset in assets:
        if asset.spawnable:
            members.setdefault(asset.type, []).append(asset)
    out = {}
    for name, group in members.items():
        pushed, picked = sum(a.pushable for a in group), sum(a.pickable for a in group)
        if not pushed + picked:
            continue
        middle = float(np.median([a.mass_kg for a in group]))
        frictions = np.array([a.friction for a in group])
        out[name] = TypeLevels(
            "push" if pushed >= picked else "pick",
            tuple(_significant(factor * middle) for factor in MASSES),
            tuple(_at_sixth(frictions, sixth) for sixth in SIXTHS),
        )
    return out


def _significant(value: float) -> float:
    """Return a number rounded to three significant digits."""
    return round(value, 2 - math.floor(math.log10(value)))


def _at_sixth(values: np.ndarray[Any, Any], sixth: int) -> float:
    """Return the value that has so many sixths of all values below it."""
    place = sixth * len(values)
    return next(
        float(v) for v in values if 6 * (values < v).sum() <= place < 6 * (values <= v).sum()
    )


@dataclass(slots=True)
class _Count:
    """Number of objects with a property beside its expectation and variance."""

    got: int = 0
    expected: float = 0.0
    variance: float = 0.0

    def add(self, *, holds: bool, probability: float) -> None:
        self.got += holds
        self.expected += probability
        self.variance += probability * (1.0 - probability)

    @property
    def slack(self) -> float:
        return DEVIATIONS * math.sqrt(self.variance) + FEW


@dataclass(frozen=True, slots=True)
class _Shares:
    """Counts over all objects of one kind."""

    own: _Count = field(default_factory=_Count)
    """Objects with attributes that are not their asset's."""
    fixed: _Count = field(default_factory=_Count)
    masses: Counter[int] = field(default_factory=Counter)
    """Objects of the first count by level of mass."""


@dataclass(frozen=True, slots=True)
class AttributeCheck:
    """Check of the attributes of a dataset, object by object, and of their shares at the end."""

    strength: float | None
    """Strength of the hidden attributes; None where the look tells them."""
    assets: Mapping[str, Asset]
    levels: Mapping[str, TypeLevels]
    _shares: dict[str, _Shares] = field(default_factory=dict)

    @staticmethod
    def of(config: Mapping[str, Any], assets: Iterable[Asset]) -> AttributeCheck:
        """Prepare the check from a manifest's config and all assets.

        Raises
        ------
        CorruptDataError
            The config has a value that no generator writes.

        """
        known = tuple(assets)
        return AttributeCheck(
            strength_of(config), {a.asset_id: a for a in known}, levels_by_type(known)
        )

    def house(self, house: House, report: FindingCollector) -> None:
        """Check the furniture of a house."""
        for placed in house.objects:
            asset = self.assets.get(placed.asset_id)
            if asset is None:
                continue  # a finding of its own
            what = f"object {placed.object_id} ({placed.asset_id})"
            own = placed.dynamics
            report.expect(
                own is None or own != asset.dynamics,
                "object.dynamics",
                f"{what}: null where they are the asset's",
                own,
            )
            stated = own or asset.dynamics
            self._check("object", asset, stated, placed.affordance, what, report)

    def obstacle(
        self, obstacle: Obstacle, number: int, report: FindingCollector, episode: str
    ) -> None:
        """Check an obstacle of an episode."""
        asset = self.assets.get(obstacle.asset_id)
        if asset is not None:
            what = f"obstacle {number} ({obstacle.asset_id})"
            stated, affordance = obstacle.dynamics, obstacle.affordance
            self._check("obstacle", asset, stated, affordance, what, report, episode)

    def _check(
        self,
        kind: str,
        asset: Asset,
        stated: Dynamics,
        affordance: str | None,
        what: str,
        report: FindingCollector,
        episode: str = "",
    ) -> None:
        known = self.levels.get(asset.type) if asset.spawnable else None
        hidden = known is not None and self.strength is not None
        wanted = known.affordance if known is not None and hidden else None
        report.expect(
            affordance == wanted, f"{kind}.affordance", f"{what}: {wanted}", affordance, episode
        )
        if known is not None and hidden:
            self._check_hidden(kind, asset, known, stated, what, report, episode)
            return
        for name in NAMES:
            true, got = getattr(asset, name), getattr(stated, name)
            report.expect(true == got, f"{kind}.{name}", f"{what}: {true}", got, episode)

    def _check_hidden(
        self,
        kind: str,
        asset: Asset,
        known: TypeLevels,
        stated: Dynamics,
        what: str,
        report: FindingCollector,
        episode: str,
    ) -> None:
        strength = self.strength or 0.0
        able = (known.affordance == "push", known.affordance == "pick")
        abilities = (stated.pushable, stated.pickable)
        fixed, bolted = abilities == (False, False), not (asset.pushable or asset.pickable)
        report.expect(
            fixed or abilities == able,
            f"{kind}.abilities",
            f"{what}: pushable and pickable {able} or neither",
            abilities,
            episode,
        )
        as_asset = (stated.mass_kg, stated.friction) == (asset.mass_kg, asset.friction)
        as_asset &= fixed == bolted
        on_levels = stated.mass_kg in known.masses and stated.friction in known.frictions
        report.expect(
            (as_asset and strength < 1.0) or (on_levels and strength > 0.0),
            f"{kind}.attributes",
            f"{what}: those of its asset, or masses {known.masses} kg and frictions "
            f"{known.frictions}, at strength {strength}",
            (stated.mass_kg, stated.friction),
            episode,
        )
        share = FIXED[known.affordance]
        # A draw may hit upon the asset's own attributes.
        same = known.masses.count(asset.mass_kg) / len(known.masses)
        same *= known.frictions.count(asset.friction) / len(known.frictions)
        same *= share if bolted else 1.0 - share
        shares = self._shares.setdefault(kind, _Shares())
        shares.own.add(holds=not as_asset, probability=strength * (1.0 - same))
        shares.fixed.add(holds=fixed, probability=strength * share + (1.0 - strength) * bolted)
        if on_levels and not as_asset:
            shares.masses[known.masses.index(stated.mass_kg)] += 1

    def shares(self, report: FindingCollector) -> None:
        """Check that the shares over all objects are as the config says.

        Those of furniture are what was drawn; obstacles are selected, since draws of episodes are
        discarded where nobody could reach the goal.
        """
        for kind, counted in sorted(self._shares.items()):
            for name, count in (("own", counted.own), ("fixed", counted.fixed)):
                low = count.expected * (SELECTED if kind == "obstacle" else 1.0) - count.slack
                high = count.expected + count.slack
                if name == "own" and kind == "obstacle":
                    continue  # those of look and of draws are selected alike, or nearly so
                report.expect(
                    low <= count.got <= high,
                    f"{kind}.{name}-share",
                    f"{low:.0f} … {high:.0f} objects",
                    count.got,
                )
            total = counted.masses.total()
            each = total / len(MASSES)
            slack = DEVIATIONS * math.sqrt(each) + FEW
            low, high = (each, each) if kind == "object" else (SELECTED * each, each / SELECTED)
            for level in range(len(MASSES)):
                got = counted.masses[level]
                report.expect(
                    low - slack <= got <= high + slack,
                    f"{kind}.mass-share",
                    f"{low - slack:.0f} … {high + slack:.0f} objects of mass level {level}",
                    got,
                )
