"""Bounds of settings: one place gives the check, the error and the documentation."""

from __future__ import annotations

import dataclasses
import math
import typing
from dataclasses import dataclass, field
from importlib import import_module
from typing import Annotated

import pytest

from internav_data.core.config import Bounds, bounds_of, check_bounds, config_toml, from_mapping
from internav_data.core.field_docs import descriptions
from internav_data.records.errors import UsageError

CONFIGS = {
    "generation.config": "GenerationConfig",
    "houses.config": "HouseConfig",
    "episodes.config": "EpisodeConfig",
    "world.config": "WorldConfig",
    "evaluation.evaluator": "EvaluationConfig",
    "envs.tasks": "TaskConfig",
    "camp.config": "CampConfig",
}


@dataclass(frozen=True)
class Inner:
    share: Annotated[float, Bounds(0.0, 1.0)] = 0.5
    """Share of something."""


@dataclass(frozen=True)
class Outer:
    seed: Annotated[int, Bounds(0, 10, "choose one from 0 to ten")] = 0
    """Seed."""
    length_m: Annotated[float, Bounds(0.0, exclusive=True)] = 2.0
    """Length, metres."""
    limit: Annotated[int | None, Bounds(1)] = None
    """Maximum number."""
    counts: tuple[Annotated[int, Bounds(1)], ...] = (1, 2)
    """Counts."""
    free: bool = True
    """Without bounds."""
    inner: Inner = field(default_factory=Inner)
    """Inner table."""


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"seed": 11}, "seed is 11: choose one from 0 to ten"),
        ({"length_m": 0.0}, "length_m is 0.0: expected more than 0.0"),
        ({"length_m": math.nan}, "length_m is nan: expected more than 0.0"),
        ({"limit": 0}, "limit is 0: expected 1 or more"),
        ({"limit": 10**13}, f"limit is {10**13}: expected at most {10**12}"),
        ({"counts": (3, 0)}, "counts[1] is 0: expected 1 or more"),
        ({"inner": Inner(1.5)}, "inner.share is 1.5: expected 0.0 … 1.0"),
    ],
)
def test_a_number_out_of_its_bounds_is_refused_by_its_key(values, message):
    with pytest.raises(UsageError) as caught:
        check_bounds(Outer(**values))
    assert str(caught.value) == message


def test_both_ends_are_inside():
    for seed, share in ((0, 0.0), (10, 1.0)):
        check_bounds(Outer(seed=seed, limit=1, counts=(1,), inner=Inner(share)))
    check_bounds(Outer(length_m=5e-324, counts=()))


def test_the_caller_may_word_the_error():
    with pytest.raises(UsageError, match=r"^a\.limit: 1 or more, got 0$"):
        check_bounds(Outer(limit=0), "{key}: {expected}, got {value}", "a.")


def test_bounds_are_documented_where_the_config_is_printed():
    text = config_toml(Outer())
    assert "# Seed. Range: 0 … 10.\nseed = 0\n" in text
    assert "# Length, metres. Range: more than 0.0.\n" in text
    assert "# Share of something. Range: 0.0 … 1.0.\n" in text
    assert "# Without bounds.\nfree = true\n" in text


def test_types_are_read_through_bounds():
    config = from_mapping(Outer(), {"limit": 3, "counts": [4], "inner": {"share": 1}}, "file")
    assert config == Outer(limit=3, counts=(4,), inner=Inner(1.0))
    with pytest.raises(UsageError, match="file: limit: expected a whole number, got 'x'"):
        from_mapping(Outer(), {"limit": "x"}, "file")


def numbers(hint):
    """Return whether a type hint holds whole numbers or floats."""
    hint = hint.__origin__ if hasattr(hint, "__metadata__") else hint
    return hint in {int, float} or any(map(numbers, typing.get_args(hint)))


def parts(cls):
    """Yield a config's class and those of the tables inside it."""
    yield cls
    for hint in typing.get_type_hints(cls).values():
        if dataclasses.is_dataclass(hint):
            yield from parts(hint)


@pytest.mark.parametrize("module", CONFIGS)
def test_every_setting_is_documented_and_every_number_has_bounds(module):
    pytest.importorskip("numba", reason="the extra 'generate' is not installed")
    pytest.importorskip("gymnasium", reason="the extra 'train' is not installed")
    cls = getattr(import_module(f"internav_data.{module}"), CONFIGS[module])
    for part in parts(cls):
        hints = typing.get_type_hints(part, include_extras=True)
        wanted = {f.name for f in dataclasses.fields(part) if numbers(hints[f.name])}
        assert set(bounds_of(part)) == wanted, part.__name__
        assert set(descriptions(part)) >= {f.name for f in dataclasses.fields(part)}, part.__name__
    check_bounds(cls())
