"""Datasets of the physics engines side by side: JSON on stdout.

    python benchmarks/engine_datasets.py --scenes 40 --presets paper dense --push-models force step

The same seed, preset and push model on each engine. Figures are means over episodes. The error of a
ratio is that of the mean difference of two scenes of one seed: houses are the same, and episodes
until a pose or a push is not. Target: within 5 %.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.dataset import load_dataset
from internav_data.generation import generate, load_config
from internav_data.records.physics import FORCE_N

if TYPE_CHECKING:
    from internav_data.records import Episode

ENGINES = ("bullet", "mujoco")
TARGET = 0.05


def figures_of(episode: Episode) -> dict[str, float]:
    """Return the figures of one episode."""
    pushes = [
        outcome.success
        for obstacle in episode.obstacles
        if obstacle.pushable
        for outcome in (obstacle.outcomes or ())
        if outcome.action != "pick"
    ]
    found = {
        "obstacles": float(episode.obstacle_count),
        "distance_m": episode.shortest_path_m,
        "rooms_on_path": float(episode.rooms_on_path),
        "sealed": float(episode.sealed),
    }
    if pushes:
        found["push_success"] = float(np.mean(pushes))
    if episode.expert is not None:
        found["run_steps"] = float(episode.expert.steps)
    return found


def made(engine: str, args: argparse.Namespace, preset: str, push_model: str) -> dict[str, Any]:
    """Make a dataset and return its figures: means over episodes, and over those of each scene."""
    given = [
        f"seed={args.seed}",
        f"episodes_per_scene={args.episodes_per_scene}",
        f"test_episodes_per_scene={args.episodes_per_scene}",
        f"physics.engine={engine}",
        f"world.push_model={push_model}",
        # A kick has no force; `dense` sets one.
        *([f"world.force_n={FORCE_N}"] if push_model == "kick" else []),
    ]
    with tempfile.TemporaryDirectory(prefix="internav-engines-") as folder:
        out = Path(folder) / "dataset"
        config = load_config(None, given, episode_preset=preset)
        report = generate(out, config, args.scenes, args.workers)
        scenes: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
        for episode in load_dataset(out):
            for name, value in figures_of(episode).items():
                scenes[name][episode.scene_id].append(value)
    means = {
        name: round(float(np.mean([value for values in groups.values() for value in values])), 4)
        for name, groups in scenes.items()
    }
    of_scenes = {
        name: {scene: float(np.mean(values)) for scene, values in groups.items()}
        for name, groups in scenes.items()
    }
    return {
        "episodes": report.episodes,
        "seconds": round(report.seconds, 1),
        "quarantined": len(report.quarantined),
        "means": means | {"solvable": round(1.0 - report.refused_share, 4)},
        "scenes": of_scenes,
    }


def ratios(bullet: dict[str, Any], mujoco: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Return each figure of MuJoCo's dataset by Bullet's, and the ratio's standard error."""
    found = {}
    for name, mean in bullet["means"].items():
        if not mean or name not in mujoco["means"]:
            continue
        ours, theirs = mujoco["scenes"].get(name, {}), bullet["scenes"].get(name, {})
        differences = [ours[scene] - theirs[scene] for scene in ours.keys() & theirs.keys()]
        error = float(np.std(differences, ddof=1)) / len(differences) ** 0.5 if differences else 0.0
        ratio = mujoco["means"][name] / mean
        found[name] = {"ratio": round(ratio, 4), "error": round(error / mean, 4)}
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--episodes-per-scene", type=int, default=4)
    parser.add_argument("--presets", nargs="+", default=["paper", "balanced", "dense", "long"])
    parser.add_argument("--push-models", nargs="+", default=["force", "kick", "step"])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    rows: list[dict[str, Any]] = []
    for preset in args.presets:
        for push_model in args.push_models:
            both = {engine: made(engine, args, preset, push_model) for engine in ENGINES}
            compared = ratios(both["bullet"], both["mujoco"])
            for one in both.values():
                del one["scenes"]
            rows.append({"preset": preset, "push_model": push_model, **both, "ratios": compared})
            print(preset, push_model, both["bullet"]["episodes"], compared, file=sys.stderr)
            text = json.dumps({"target": TARGET, "scenes": args.scenes, "rows": rows}, indent=1)
            if args.out:
                args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
