"""Duration of the expert's search and length of its plans. JSON out.

    python benchmarks/expert.py [--scenes 30] [--episodes-per-scene 10] [--small 20] [--out FILE]

Targets: under 10 ms at the median, under 100 ms at the 99th percentile, warm; on small cases within
10 % of the best plan in steps on average.

The best plan is found by a breadth-first search over true worlds, in one-room episodes whose expert
is short enough: an episode that takes more than a fixed number of worlds is left out and counted.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import sys
import time
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.catalog import catalogue
from internav_data.episodes import build_episodes
from internav_data.houses import HouseConfig, build_house
from internav_data.planner.problem import PlanningProblem
from internav_data.planner.search import expert_of_episode
from internav_data.world import ACTION_COUNT, Action, HouseModel, World

if TYPE_CHECKING:
    from internav_data.records import Episode, Expert

Case = tuple[HouseModel, "Episode", "Expert | None", float]
MAX_WORLDS = 4000
"""Worlds that an exhaustive search may take."""


def solve_all(scenes: int, count: int, seed: int) -> list[Case]:
    """Solve every episode, each timed by itself after a warm-up."""
    pool, assets = catalogue().spawnable, catalogue().assets
    cases: list[Case] = []
    for scene in range(scenes):
        house = build_house(seed, scene, HouseConfig(), catalogue())
        model = HouseModel.of(house)
        for place, episode in enumerate(build_episodes(house, count, pool)):
            if place == 0:
                expert_of_episode(model, episode, assets)
            begin = time.perf_counter()
            expert = expert_of_episode(model, episode, assets)
            cases.append((model, episode, expert, 1e3 * (time.perf_counter() - begin)))
    return cases


def shares(cases: list[Case]) -> dict[str, Any]:
    """Share solved, times, and ceilings of the metrics, by mode and by rooms."""
    groups: dict[str, list[Case]] = defaultdict(list)
    for case in cases:
        rooms = case[1].room_count
        size = "1-2" if rooms <= 2 else "3-5" if rooms <= 5 else "6-10"
        for name in ("all", case[1].mode, f"{case[1].mode} {size} rooms"):
            groups[name].append(case)
    return {name: summary(group) for name, group in sorted(groups.items())}


def summary(cases: list[Case]) -> dict[str, float]:
    times = [ms for _, _, _, ms in cases]
    solved = [(episode, expert) for _, episode, expert, _ in cases if expert is not None]
    out = {
        "episodes": len(cases),
        "solved": round(len(solved) / len(cases), 4),
        "median_ms": round(statistics.median(times), 3),
        "mean_ms": round(statistics.fmean(times), 3),
        "p99_ms": round(float(np.percentile(times, 99)), 3),
    }
    if solved:
        out |= {
            "steps": round(statistics.fmean(x.steps for _, x in solved), 2),
            "pushes": round(statistics.fmean(x.pushes for _, x in solved), 3),
            "picks": round(statistics.fmean(x.picks for _, x in solved), 3),
            "spl": round(
                statistics.fmean(
                    e.shortest_path_m / max(x.path_m, e.shortest_path_m) for e, x in solved
                ),
                4,
            ),
            "sts": round(
                statistics.fmean(e.shortest_path_m / 0.25 / x.steps for e, x in solved), 4
            ),
        }
    return out


def fewest(world: World, bound: int) -> int | None:
    """Length of the shortest plan, `bound` where none is shorter; None if it takes too long.

    A* over true worlds: no plan is faster than one in a house without any movable thing.
    """
    problem = PlanningProblem.of(world)
    free = np.zeros_like(problem.prices(world))
    ahead = problem.costs(problem.masks(world), 0, free)
    # Layers by spent + ahead, so that the worlds that matter come first.
    layers: dict[int, list[tuple[int, World]]] = defaultdict(list)
    layers[int(ahead[problem.pose(world)]) + 1].append((0, world))
    known = {world.digest(): 0}
    for f_cost in range(bound):
        layer = layers[f_cost]
        while layer:
            spent, here = layer.pop()
            if known[here.digest()] < spent:
                continue
            for action in range(ACTION_COUNT):
                there = here.copy()
                if not there.step(action).success:
                    continue
                if action == Action.DONE:
                    return spent + 1
                f_cost_there = spent + 1 + int(ahead[problem.pose(there)]) + 1
                digest = there.digest()
                if f_cost_there < bound and known.get(digest, bound) > spent + 1:
                    known[digest] = spent + 1
                    layers[f_cost_there].append((spent + 1, there))
            if len(known) > MAX_WORLDS:
                return None
    return bound


def against_best(cases: list[Case], wanted: int) -> dict[str, float]:
    """Compare with the best plans of the shortest one-room experts that act on something."""
    assets = catalogue().assets
    small = [
        case
        for case in cases
        if case[1].room_count == 1 and case[2] is not None and case[2].pushes + case[2].picks
    ]
    small.sort(key=lambda case: (case[2].steps if case[2] else 0, case[1].episode_id))
    ratios, left_out = [], 0
    for model, episode, expert, _ in itertools.islice(small, wanted):
        assert expert is not None
        best = fewest(World.of_episode(model, episode, assets), expert.steps)
        if best is None:
            left_out += 1
        else:
            ratios.append(expert.steps / best)
    return {
        "compared": len(ratios),
        "left_out": left_out,
        "mean_ratio": round(statistics.fmean(ratios), 4) if ratios else float("nan"),
        "worst_ratio": round(max(ratios), 4) if ratios else float("nan"),
        "optimal": sum(ratio == 1.0 for ratio in ratios),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--episodes-per-scene", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--small", type=int, default=20, help="cases of the exhaustive search")
    parser.add_argument("--out", type=Path)
    arguments = parser.parse_args()
    cases = solve_all(arguments.scenes, arguments.episodes_per_scene, arguments.seed)
    result = {"experts": shares(cases), "small": against_best(cases, arguments.small)}
    text = json.dumps(result, indent=1)
    sys.stdout.write(text + "\n")
    if arguments.out:
        arguments.out.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
