"""Relevant obstacles are the members of minimal sets whose removal changes the lattice distance."""

import itertools

import builders
import numpy as np

from internav_data.episodes.relevance import members_of_minimal_sets, relevant_obstacles
from internav_data.geometry import footprint
from internav_data.navigation import Lattice


def minimal_sets(count, changes):
    """Every minimal changing set, from the definition alone."""
    subsets = [
        frozenset(chosen)
        for size in range(1, count + 1)
        for chosen in itertools.combinations(range(count), size)
    ]
    changing = [chosen for chosen in subsets if changes(chosen)]
    return [chosen for chosen in changing if not any(other < chosen for other in changing)]


def random_family(rng, count):
    """A monotone family over 0 … count - 1, given by some of its sets."""
    kernels = [
        frozenset(rng.choice(count, rng.integers(1, min(4, count) + 1), replace=False).tolist())
        for _ in range(int(rng.integers(1, 6)))
    ]
    return lambda chosen: any(kernel <= chosen for kernel in kernels)


def test_up_to_six_obstacles_are_those_of_all_subsets():
    rng = np.random.default_rng(1)
    for _ in range(200):
        count = int(rng.integers(1, 7))
        changes = random_family(rng, count)
        expected = frozenset().union(*minimal_sets(count, changes))
        assert members_of_minimal_sets(count, changes) == expected


def test_of_more_obstacles_all_found_are_relevant_and_the_others_are_idle():
    rng = np.random.default_rng(2)
    equal = 0
    for _ in range(200):
        count = int(rng.integers(7, 10))
        changes = random_family(rng, count)
        found = members_of_minimal_sets(count, changes)
        exact = frozenset().union(*minimal_sets(count, changes))
        assert found <= exact
        assert not changes(frozenset(range(count)) - found)
        equal += found == exact
    assert equal > 150


def room_of_two_gaps(*places):
    """Relevance of boxes in a room that an inner wall with two gaps of 1 m divides."""
    house = builders.one_room(
        8.0, 4.0, (3.0, 0.0, 5.0, 0.5), (3.0, 1.5, 5.0, 2.5), (3.0, 3.5, 5.0, 4.0)
    )
    box = builders.crate("Box_1", (0.9, 0.9, 0.5), mass_kg=8.0)
    lattice = Lattice.of(house)
    footprints = [footprint(box, builders.obstacle(box, x, y).pose) for x, y in places]
    crowded = lattice.copy()
    for polygons in footprints:
        crowded.add(polygons)
    start, goal = (4, 4), (28, 4)
    steps = crowded.distance(start, goal)
    shape = lattice.distance(start, goal), steps
    return shape, relevant_obstacles(lattice, footprints, start, goal, steps)


def test_boxes_in_gaps():
    south, further_south, north, aside = (3.5, 1.0), (4.5, 1.0), (4.0, 3.0), (1.0, 3.4)
    assert room_of_two_gaps(south, north) == ((24, None), (True, True))
    # Two boxes one after the other in a gap are needed together.
    shape, relevant = room_of_two_gaps(south, further_south, north, aside)
    assert shape == (24, None)
    assert relevant == (True, True, True, False)
    (clear, longer), relevant = room_of_two_gaps(aside, south)
    assert longer > clear
    assert relevant == (False, True)
