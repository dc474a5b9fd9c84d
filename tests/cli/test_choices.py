"""Words that options offer are those that the settings know: help must load no engine for them."""

from typing import get_args

import pytest
from internav_cli.generate import command

from internav_data.catalog.config import Attributes
from internav_data.generation.config import EPISODE_PRESETS
from internav_data.physics.engines import EngineName
from internav_data.records import PUSH_SPECS

KNOWN = {
    "catalog__attributes": get_args(Attributes),
    "episode_preset": EPISODE_PRESETS,
    "physics": get_args(EngineName),
    "world__push_model": tuple(PUSH_SPECS),
}


@pytest.mark.parametrize("name", KNOWN)
def test_options_offer_what_settings_know(name):
    (option,) = (parameter for parameter in command.params if parameter.name == name)
    assert tuple(option.type.choices) == KNOWN[name]
