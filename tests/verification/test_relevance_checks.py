"""The validator finds the same relevant obstacles as the generator, by code of its own."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scenery import small_scenes, write_dataset

from internav_data.episodes.relevance import members_of_minimal_sets
from internav_data.verification import validate
from internav_data.verification.relevance import relevant


@dataclass
class Family:
    """Removals whose changing sets are those that hold one of some masks."""

    count: int
    kernels: tuple[int, ...]

    def changes(self, removed):
        return any(kernel & removed == kernel for kernel in self.kernels)


def test_validator_and_generator_find_the_same_sets():
    rng = np.random.default_rng(3)
    for _ in range(300):
        count = int(rng.integers(1, 11))
        kernels = [
            sum(
                1 << k
                for k in rng.choice(
                    count, rng.integers(1, min(4, count) + 1), replace=False
                ).tolist()
            )
            for _ in range(int(rng.integers(1, 7)))
        ]
        family = Family(count, tuple(kernels))

        def changes(chosen, family=family):
            return family.changes(sum(1 << k for k in chosen))

        expected = members_of_minimal_sets(count, changes)
        assert relevant(family) == tuple(k in expected for k in range(count))


def stating(*values):
    """Scenes whose first episode has these values in its one obstacle or two."""
    house, episodes = small_scenes()[0]
    first = episodes[1]
    (bar,) = first.obstacles
    idle = replace(bar, x=1.0, y=3.3)
    obstacles = tuple(
        replace(obstacle, relevant=value)
        for obstacle, value in zip((bar, idle), values, strict=False)
    )
    changed = replace(first, obstacles=obstacles, obstacle_count=len(obstacles))
    return [(house, [episodes[0], changed])]


@pytest.mark.parametrize(
    ("values", "found"),
    [
        ((True, False), False),
        ((None, None), False),
        ((True, True), True),
        ((True, None), True),
    ],
)
def test_what_is_stated_is_checked(tmp_path, values, found):
    write_dataset(tmp_path / "ds", stating(*values))
    findings = validate(tmp_path / "ds")
    assert ("obstacle.relevant" in findings.by_predicate) == found
    assert found or findings.ok, findings.summary()
