"""Hidden attributes: levels within bounds, as independent of the look as the config says."""

from __future__ import annotations

import math
import statistics
from collections import Counter
from functools import cache

import numpy as np
import pytest
from builders import crate

from internav_data.catalog import catalogue
from internav_data.catalog.attributes import (
    DRAWS,
    FIXED_SHARES,
    HiddenAttributes,
    hidden_attributes,
)
from internav_data.catalog.config import CatalogConfig
from internav_data.records import Dynamics, type_affordances
from internav_data.records.errors import UsageError


@cache
def hidden(strength=1.0):
    found = hidden_attributes(CatalogConfig("hidden", strength), catalogue().spawnable)
    assert isinstance(found, HiddenAttributes)
    return found


def test_the_look_tells_all_unless_attributes_are_hidden():
    assert hidden_attributes(CatalogConfig(), catalogue().spawnable) is None


def test_levels_lie_within_a_factor_of_two_of_the_types_mass():
    for type_, known in hidden().types.items():
        assets = [a for a in catalogue().of_type(type_) if a.spawnable]
        middle = statistics.median(a.mass_kg for a in assets)
        assert len(set(known.masses_kg)) == 4
        for mass in known.masses_kg:
            assert 0.5 * middle - 0.01 * mass <= mass <= 2.0 * middle + 0.01 * mass, type_
        smooth, middling, rough = known.frictions
        assert min(a.friction for a in assets) <= smooth <= middling <= rough
        assert rough <= max(a.friction for a in assets)


def test_each_obstacle_type_is_pushed_or_picked_up_as_most_of_its_assets_are():
    types = hidden().types
    assert {a.type for a in catalogue().spawnable} == set(types)
    assert types["Apple"].affordance == types["Pillow"].affordance == "pick"
    assert types["Chair"].affordance == types["Television"].affordance == "push"


def test_a_type_that_nobody_can_handle_affords_nothing():
    block = crate("Block_1", (1.0, 1.0, 1.0), mass_kg=9.0, pushable=False)
    alone = crate("Lamp_1", (1.0, 1.0, 1.0), mass_kg=9.0, pushable=True, spawnable=False)
    assert type_affordances([block, alone]) == {}
    assert hidden().affordance(block) is None
    assert hidden().dynamics(block, [0.0] * DRAWS) == block.dynamics


def test_at_full_strength_attributes_are_the_same_whatever_the_asset():
    rows = np.random.default_rng(0).random((40, DRAWS)).tolist()
    for type_ in ("Chair", "Sofa", "Bread"):
        first, *others = catalogue().of_type(type_)
        expected = [hidden().dynamics(first, row) for row in rows]
        for other in others:
            assert [hidden().dynamics(other, row) for row in rows] == expected


def test_without_strength_attributes_are_those_of_the_asset():
    rows = np.random.default_rng(0).random((5, DRAWS)).tolist()
    for asset in catalogue().spawnable:
        affordance = hidden(0.0).affordance(asset)
        free = not asset.dynamics.fixed
        wanted = Dynamics(
            asset.mass_kg,
            asset.friction,
            free and affordance == "push",
            free and affordance == "pick",
        )
        assert {hidden(0.0).dynamics(asset, row) for row in rows} == {wanted}


@pytest.mark.parametrize("strength", [0.25, 1.0])
def test_shares_are_as_the_strength_says(strength):
    rows = np.random.default_rng(1).random((4000, DRAWS)).tolist()
    asset = next(a for a in catalogue().of_type("Chair") if a.pushable)
    known, drawn = hidden().types["Chair"], hidden(strength)
    made = [drawn.dynamics(asset, row) for row in rows]
    own = sum(d == asset.dynamics for d in made) / len(made)
    assert own == pytest.approx(1.0 - strength, abs=4 * math.sqrt(0.25 / 4000))
    fixed = sum(d.fixed for d in made) / len(made)
    assert fixed == pytest.approx(strength * FIXED_SHARES["push"], abs=0.035)
    levels = Counter((d.mass_kg, d.friction) for d in made if d != asset.dynamics)
    assert set(levels) == {(m, f) for m in known.masses_kg for f in known.frictions}
    assert max(levels.values()) < 1.5 * min(levels.values())


@pytest.mark.parametrize(
    ("config", "message"),
    [
        (CatalogConfig("seen"), "catalog.attributes: expected 'look' or 'hidden', got 'seen'"),
        (CatalogConfig("hidden", 1.5), "catalog.strength: expected 0.0 … 1.0, got 1.5"),
        (
            CatalogConfig("look", 0.5),
            (
                "catalog.strength: 0.5 has no effect where the look tells the attributes; set "
                "catalog.attributes = 'hidden', or leave it out"
            ),
        ),
    ],
)
def test_bad_values_get_one_line(config, message):
    with pytest.raises(UsageError) as error:
        config.check()
    assert str(error.value) == message
