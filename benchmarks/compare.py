"""internav against the baseline of `naive.py`: the same houses, the same answers, side by side.

    python benchmarks/compare.py [--scenes 7] [--episodes 20] [--seed 0] [--out FILE]

Both make the same number of episodes in the same houses in one process; the preparation of a house
counts, that of a process (`internav_start_s`) is reported apart. Then each judges the
obstacle sets of the other: lattice steps must be equal, Euclidean paths agree within 1 % (the
baseline's grown corners are polygons, so a gap a few millimetres too narrow is open to it).
Exits 1 if they don't.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import naive
import numpy as np
import shapely

from internav_data.catalog import catalogue
from internav_data.episodes import EpisodeConfig, SpawnSite, build_episodes
from internav_data.geometry import Polygons, footprint
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import Body, settle
from internav_data.records import Pose

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.records import Asset, Episode, House

TOLERANCE = 0.01
ROOMS = ("1", "2", "3", "4", "5", "7", "9")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=len(ROOMS))
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    pool = catalogue().spawnable
    houses = [
        build_house(options.seed, scene, HouseConfig(rooms=ROOMS[scene % len(ROOMS)]), catalogue())
        for scene in range(options.scenes)
    ]
    config = EpisodeConfig()
    _, start_s = _timed(lambda: _start(houses[0], pool, config))
    rows = [_row(house, options.episodes, pool, config, options.seed) for house in houses]
    result = _summary(rows, options.episodes, start_s)
    text = json.dumps(result, indent=1)
    if options.out is not None:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0 if result["agree"] else 1


def _start(house: House, pool: tuple[Asset, ...], config: EpisodeConfig) -> None:
    """Prepare a process as a worker is prepared: load kernels, settle every asset alone."""
    build_episodes(house, 2, pool, config)
    for asset in pool:
        settle(Body.of(asset, Pose(0.0, 0.0, 0.0, (0.0, 0.0, 0.0, 1.0))), math.inf, tuple)


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    begin = time.perf_counter()
    done = work()
    return done, time.perf_counter() - begin


def _row(
    house: House, count: int, pool: tuple[Asset, ...], config: EpisodeConfig, seed: int
) -> dict[str, Any]:
    ours, our_s = _timed(lambda: build_episodes(house, count, pool, config))
    rng = np.random.default_rng([seed, house.scene])
    limit = config.max_obstacles_for(len(house.rooms))
    site, house_s = _timed(lambda: naive.SharedHouse.of(house))
    theirs, their_s = _timed(lambda: naive.build_episodes(site, count, pool, limit, rng))
    checked = [
        *(_theirs_on(site, e) for e in ours),
        *(_ours_on(SpawnSite.of(house), e) for e in theirs),
    ]
    row = {
        "rooms": len(house.rooms),
        "internav_s": our_s,
        "baseline_s": house_s + their_s,
        "baseline_house_s": house_s,
        "ratio": (house_s + their_s) / our_s,
        "obstacles_internav": sum(e.obstacle_count for e in ours),
        "obstacles_baseline": sum(len(e.obstacles) for e in theirs),
        "steps_differ": sum(not steps for steps, _ in checked),
        "paths_differ": sum(not paths for _, paths in checked),
        "checked": len(checked),
    }
    print(json.dumps(row), file=sys.stderr)
    return row


def _theirs_on(site: naive.SharedHouse, episode: Episode) -> tuple[bool, bool]:
    """Let the baseline judge one of our episodes."""
    assets = catalogue().assets
    shapes = [
        shapely.union_all(naive.plan_of(assets[o.asset_id], o.pose)) for o in episode.obstacles
    ]
    start, goal = (episode.start.i, episode.start.j), (episode.goal.i, episode.goal.j)
    steps, path = naive.judge(site, start, goal, shapes)
    clear = naive.steps_between(site.grid, start, goal)
    paths = _near(path, episode.obstructed_path_m) and _near(
        naive.length(site.sight.path(naive._metres(start), naive._metres(goal)) or []),
        episode.shortest_path_m,
    )
    return steps == episode.obstructed_path_steps and clear == episode.shortest_path_steps, paths


def _ours_on(site: SpawnSite, episode: naive.NaiveEpisode) -> tuple[bool, bool]:
    """Judge one of the baseline's episodes."""
    lattice = site.lattice.copy()
    shapes = [footprint(o.asset, o.rest.pose) for o in episode.obstacles]
    for shape in shapes:
        lattice.add(shape)
    steps = lattice.distance(episode.start, episode.goal)
    ends = naive._metres(episode.start), naive._metres(episode.goal)
    path = site.tangent_graph.distance(*ends, Polygons.joined(shapes))
    clear = site.lattice.distance(episode.start, episode.goal)
    paths = _near(path, episode.obstructed_path_m) and _near(
        site.tangent_graph.distance(*ends), episode.shortest_path_m
    )
    return steps == episode.obstructed_path_steps and clear == episode.shortest_path_steps, paths


def _near(first: float | None, second: float | None) -> bool:
    if first is None or second is None:
        return first is second
    return abs(first - second) <= TOLERANCE * max(first, second)


def _summary(rows: list[dict[str, Any]], episodes: int, start_s: float) -> dict[str, Any]:
    our_s, their_s = (sum(row[k] for row in rows) for k in ("internav_s", "baseline_s"))
    total = len(rows) * episodes
    checked = sum(row["checked"] for row in rows)
    differing = sum(row["paths_differ"] for row in rows)
    return {
        "benchmark": "compare",
        "python": platform.python_version(),
        "scenes": len(rows),
        "episodes": total,
        "internav_start_s": start_s,
        "internav_episodes_per_s": total / our_s,
        "baseline_episodes_per_s": total / their_s,
        "ratio": their_s / our_s,
        "target": 20.0,
        "checked": checked,
        "steps_differ": sum(row["steps_differ"] for row in rows),
        "paths_differ": differing,
        # Gaps within a millimetre of the disc's width are open to one and shut to the other.
        "agree": all(row["steps_differ"] == 0 for row in rows) and differing <= checked * 0.02,
        "rows": rows,
    }


if __name__ == "__main__":
    sys.exit(main())
