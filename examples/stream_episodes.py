"""Streaming in training code: read a rank's share, stop, and resume.

    python examples/stream_episodes.py data/mine

Needs numpy and pyarrow only. With torch, hand `ds` or `ds.iterable(...)` to a DataLoader.
"""

from __future__ import annotations

import argparse
from itertools import islice
from pathlib import Path

from internav_data import load_dataset


def main() -> None:
    """Read a dataset in three ways."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    options = parser.parse_args()

    # By number, filtered: only the row groups that may hold such episodes are read.
    blocked = load_dataset(options.dataset, filters=[("mode", "=", "blocked")])
    episode = blocked[0]
    house = blocked.scene(episode.scene_id)
    print(f"{len(blocked)} blocked episodes; the first plays in {len(house.rooms)} rooms")
    for obstacle in episode.obstacles:
        print(f"  {obstacle.type} of {obstacle.mass_kg} kg at ({obstacle.x}, {obstacle.y})")

    # As a stream: shuffled by (seed, epoch), this is rank 1's share of two.
    ds = load_dataset(options.dataset)
    stream = ds.iterable(seed=1, epoch=0, rank=1, world_size=2)
    first = [episode.episode_id for episode in islice(stream, 3)]
    state = stream.state_dict()  # plain numbers: goes into a checkpoint

    again = ds.iterable(seed=1, epoch=0, rank=1, world_size=2)
    again.load_state_dict(state)
    rest = [episode.episode_id for episode in again]
    print(f"read {first}, then went on with {len(rest)} more")

    # As columns.
    table = ds.to_table(["room_count", "obstacle_count", "shortest_path_m"])
    mean = table["shortest_path_m"].to_numpy().mean()
    print(f"{table.num_rows} rows; mean shortest_path_m {mean:.2f}")


if __name__ == "__main__":
    main()
