"""Lattice of a house from a seed: free nodes, steps to a goal, and what each obstacle changes.

python examples/paths_in_a_house.py --seed 7 --scene 3
"""

from __future__ import annotations

import argparse

import numpy as np

from internav_data import generate_episodes, generate_house
from internav_data.catalog import catalogue
from internav_data.geometry import footprint
from internav_data.navigation import Lattice


def main() -> None:
    """Build a house and count steps on its lattice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--scene", type=int, default=3)
    options = parser.parse_args()

    house = generate_house(seed=options.seed, scene=options.scene)
    print(f"{house.scene_id}: {', '.join(room.type for room in house.rooms)}")

    lattice = Lattice.of(house)
    print(f"{np.count_nonzero(lattice.free)} free nodes of {lattice.free.size}")

    (episode,) = generate_episodes(house, count=1)
    start, goal = (episode.start.i, episode.start.j), (episode.goal.i, episode.goal.j)
    print(f"{episode.episode_id}: {lattice.distance(start, goal)} steps without obstacles")
    assets = catalogue().assets
    for obstacle in episode.obstacles:
        lattice.add(footprint(assets[obstacle.asset_id], obstacle.pose))
        print(f"  with {obstacle.type}: {lattice.distance(start, goal)}")


if __name__ == "__main__":
    main()
