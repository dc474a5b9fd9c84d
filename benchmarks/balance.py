"""Weights of `episodes.balance`: JSON of types on stdout, the table of the package on stderr.

    python benchmarks/balance.py --scenes 300 --episodes-per-scene 8 --rounds 3

Obstacles are spawned and the expert solves, as `generate` does, without outcomes. A type's weight
is the inverse of its survival: how often it stands for each time that it is drawn, over all rounds
so far, so that chance in one round is not handed on by the next.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from typing import TYPE_CHECKING

from internav_data.catalog import catalogue
from internav_data.episodes import build
from internav_data.episodes.balance import BALANCE_WEIGHTS
from internav_data.generation import load_config
from internav_data.generation.scenes import build_scene
from internav_data.records.errors import QuarantineError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from internav_data.generation import GenerationConfig


def standing(
    config: GenerationConfig, scenes: Iterable[int], episodes: int
) -> tuple[Counter[str], dict[str, list[float]]]:
    """Count the obstacles by type, and sum up the figures of Table 2 by rooms."""
    types: Counter[str] = Counter()
    table = {rooms: [0.0, 0.0, 0.0, 0.0] for rooms in ("1-2", "3-5", "6-10")}
    for scene in scenes:
        try:
            made = build_scene(scene, config, catalogue(), episodes)
        except QuarantineError:
            continue
        for episode in made.episodes:
            types.update(obstacle.type for obstacle in episode.obstacles)
            rooms = "1-2" if episode.room_count < 3 else "3-5" if episode.room_count < 6 else "6-10"
            row = table[rooms]
            row[0] += 1
            row[1] += episode.obstacle_count
            row[2] += 0.25 * episode.shortest_path_steps
            row[3] += episode.rooms_on_path
    return types, {k: [row[0], *(x / max(1, row[0]) for x in row[1:])] for k, row in table.items()}


def ratios(types: Counter[str], listed: Mapping[str, float]) -> dict[str, float]:
    """Return each type's share of what stands, divided by its share of the catalogue."""
    total = types.total()
    return {kind: types[kind] / total / share for kind, share in listed.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--episodes-per-scene", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--anew", action="store_true", help="begin with equal weights")
    parser.add_argument("--episode-preset", default="balanced", help="as of internav-gen generate")
    parser.add_argument("--set", action="append", default=[], help="a config value, as a.b=c")
    args = parser.parse_args()
    build.outcomes_of = lambda world, *_: ((),) * len(world.obstacles)
    assets = catalogue().spawnable
    counts = Counter(asset.type for asset in assets)
    listed = {kind: count / len(assets) for kind, count in sorted(counts.items())}
    weights = dict.fromkeys(listed, 1.0) | ({} if args.anew else dict(BALANCE_WEIGHTS))
    stood: Counter[str] = Counter()
    drawn = dict.fromkeys(listed, 0.0)
    for number in range(args.rounds):
        text = ", ".join(f"{kind} = {weight:.6g}" for kind, weight in weights.items())
        weighed = [f"episodes.asset_weights={{{text}}}", "episodes.balance=false"]
        config = load_config(None, [*args.set, *weighed], episode_preset=args.episode_preset)
        scenes = range(args.first + number * args.scenes, args.first + (number + 1) * args.scenes)
        types, table = standing(config, scenes, args.episodes_per_scene)
        found = ratios(types, listed)
        worst = max(abs(ratio - 1.0) for ratio in found.values())
        print(
            f"round {number}: {types.total()} obstacles, largest deviation {worst:.0%}",
            file=sys.stderr,
        )
        print("  " + ", ".join(f"{k} {r:.2f}" for k, r in found.items()), file=sys.stderr)
        print(f"  {table}", file=sys.stderr)
        stood += types
        mean = sum(weights[kind] * share for kind, share in listed.items())
        for kind, share in listed.items():
            drawn[kind] += types.total() * weights[kind] * share / mean
        weights = {kind: drawn[kind] / max(1, stood[kind]) for kind in listed}
        mean = sum(weights[kind] * share for kind, share in listed.items())
        weights = {kind: float(f"{weight / mean:.4g}") for kind, weight in weights.items()}
        print("\n".join(f'    "{k}": {w},' for k, w in weights.items()), file=sys.stderr)
    json.dump({"weights": weights, "ratios": found, "table2": table}, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
