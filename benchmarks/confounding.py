"""Strength of the confounder, and what knowing it is worth, by preset and strength. JSON out.

    python benchmarks/confounding.py [--scenes 40] [--episodes-per-scene 10] [--rate] [--out FILE]

For each preset and strength: base rate of pushes, accuracy of the best guess from asset, type and
size, I(success; asset, type, size) / H(success) (all as `stats` has them), shares of fixed and of
movable obstacles, lengths of the expert's runs of interactions with one object, and the expert
beside one that is blind to attributes. `--rate` makes each dataset twice and compares the processor
time of the second time with that of strength 0.

Targets: at strength 1 a base rate of 45 to 60 % and at most 0.35 of the information; of the rate
of strength 0 at least 0.7, all lone pushes known. In `long` half of the pushes' runs of three and
more, half of the interactions pushes, 85 % of the draws solvable. `--set world.push_model=MODEL`
reports the runs of another push model.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import sys
import tempfile
from collections import Counter
from itertools import groupby, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.dataset import compute_stats, load_dataset
from internav_data.generation import generate, load_config
from internav_data.generation.config import EPISODE_PRESETS
from internav_data.records import type_affordances
from internav_data.world import Action, HouseModel, World
from internav_data.world.actions import INTERACTION_KINDS
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from internav_data.dataset import Dataset
    from internav_data.records import Episode, Expert

STRENGTHS = (0.0, 0.5, 1.0)
TARGETS = {
    "base_rate_at_1": [0.45, 0.6],
    "information_share_at_1": 0.35,
    "rate_to_strength_0": 0.7,
    "movable_share_of_each_type": 0.5,
    "three_and_more_in_long": 0.5,
    "push_share_in_long": 0.5,
    "solvable_share_in_long": 0.85,
}
SPACING_M = 0.25


def made(out: Path, preset: str, settings: Sequence[str], scenes: int) -> float:
    """Make a dataset; return the processor time of its workers, seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    generate(out, load_config(None, settings, episode_preset=preset), scenes, workers=1)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def obstacle_shares(data: Dataset[Episode]) -> dict[str, Any]:
    """Return the shares of fixed obstacles, and by type of movable ones among the pushable."""
    obstacles = [obstacle for episode in data for obstacle in episode.obstacles]
    affordances = type_affordances(data.assets.values())
    pushed = [o for o in obstacles if affordances.get(o.type) == "push"]
    pushable, movable = Counter[str](), Counter[str]()
    for obstacle in pushed:
        pushable[obstacle.type] += obstacle.pushable
        movable[obstacle.type] += bool(obstacle.movable)
    return {
        "obstacles": len(obstacles),
        "fixed_share": _share(sum(o.dynamics.fixed for o in obstacles), len(obstacles)),
        "fixed_share_of_pushed_types": _share(sum(o.dynamics.fixed for o in pushed), len(pushed)),
        "movable_share_of_pushable": {
            type_: _share(movable[type_], count) for type_, count in sorted(pushable.items())
        },
    }


def runs_of(world: World, actions: Sequence[int]) -> Iterator[tuple[str, int]]:
    """Yield kind and length of the runs of successful interactions with one object.

    Moves between two interactions do not end a run.
    """
    acts = []
    for action in map(Action, actions):
        result = world.step(action)
        if action.kind in INTERACTION_KINDS and result.success:
            acts.append((action.kind, result.target))
    for (kind, _), run in groupby(acts):
        yield kind, len(list(run))


def run_lengths(data: Dataset[Episode]) -> dict[str, Any]:
    """Return the lengths of the expert's runs of pushes, and the share of pushes in all it does."""
    config = WorldConfig.of_dataset(data.manifest.config)
    lengths: dict[str, list[int]] = {"push": [], "pick": [], "drop": []}
    models: dict[str, HouseModel] = {}
    for episode in data:
        if episode.expert is None:
            continue
        if episode.scene_id not in models:
            models = {episode.scene_id: HouseModel.of(data.scene(episode.scene_id))}
        world = World.of_episode(models[episode.scene_id], episode, data.assets, config)
        for kind, length in runs_of(world, episode.expert.actions):
            lengths[kind].append(length)
    pushes = lengths["push"]
    interactions = len(pushes) + len(lengths["pick"])
    return {
        "interactions": interactions,
        "push_share": _share(len(pushes), interactions),
        "one_push": _share(sum(n == 1 for n in pushes), len(pushes)),
        "two_pushes": _share(sum(n == 2 for n in pushes), len(pushes)),
        "three_and_more": _share(sum(n > 2 for n in pushes), len(pushes)),
        "mean_pushes": round(statistics.fmean(pushes), 4) if pushes else None,
    }


def solvable_share(data: Dataset[Episode]) -> float | None:
    """Return the share of complete draws that the expert solves, refused ones among them."""
    redraws = data.manifest.redraws
    solved = len(data) + redraws.get("too few interactions", 0)
    return _share(solved, solved + redraws.get("no expert", 0))


def worth(data: Dataset[Episode]) -> dict[str, Any]:
    """Put the expert beside one that does not know the attributes of the obstacles."""
    episodes = [episode for episode in data if episode.expert is not None]
    both = [e for e in episodes if e.expert is not None and e.blind_expert is not None]
    return {
        "episodes": len(episodes),
        "expert": _metrics(episodes, [e.expert for e in episodes]),
        "blind": _metrics(episodes, [e.blind_expert for e in episodes]),
        "blind_steps_to_expert": round(
            statistics.fmean(e.blind_expert.steps / e.expert.steps for e in both), 4
        )
        if both
        else None,
    }


def _metrics(episodes: Sequence[Episode], experts: Sequence[Expert | None]) -> dict[str, float]:
    pairs = [(e, x) for e, x in zip(episodes, experts, strict=True) if x is not None]
    spl = sum(e.shortest_path_m / max(x.path_m, e.shortest_path_m) for e, x in pairs)
    sts = sum(e.shortest_path_m / SPACING_M / x.steps for e, x in pairs)
    return {
        "success": _share(len(pairs), len(episodes)),
        "spl": round(spl / max(1, len(episodes)), 4),
        "sts": round(sts / max(1, len(episodes)), 4),
        "interactions": round(sum(x.pushes + x.picks for _, x in pairs) / max(1, len(pairs)), 4),
    }


def _share(part: int, whole: int) -> float | None:
    return round(part / whole, 4) if whole else None


def case(preset: str, settings: list[str], scenes: int, *, rate: bool) -> dict[str, Any]:
    """Return the figures of one preset and strength."""
    with tempfile.TemporaryDirectory(prefix="internav-confounding-") as folder:
        out = Path(folder) / "dataset"
        first_s = made(out, preset, [*settings, "episodes.blind_expert=true"], scenes)
        data, stats = load_dataset(out), compute_stats(out)
        figures: dict[str, Any] = {
            **(stats["confounding"] or {}),
            "refused_share": stats["expert"]["refused_share"],
            "solvable_share": solvable_share(data),
            **obstacle_shares(data),
            "runs": run_lengths(data),
            **worth(data),
            "first_cpu_s": round(first_s, 2),
        }
        if rate:
            # Without the blind expert, and with what the first time has left in the cache.
            made(Path(folder) / "known", preset, settings, scenes)
            again_s = made(Path(folder) / "again", preset, settings, scenes)
            figures["episodes_per_cpu_s"] = round(len(data) / again_s, 3)
    return figures


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=40)
    parser.add_argument("--episodes-per-scene", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--presets", nargs="+", default=list(EPISODE_PRESETS))
    parser.add_argument("--strengths", type=float, nargs="+", default=list(STRENGTHS))
    parser.add_argument("--set", action="append", default=[], help="a config value, as a.b=c")
    parser.add_argument("--rate", action="store_true", help="measure the cost, too")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    common = [*args.set, f"seed={args.seed}", f"episodes_per_scene={args.episodes_per_scene}"]
    results: dict[str, Any] = {"targets": TARGETS}
    for preset, strength in product(args.presets, args.strengths):
        hidden = ["catalog.attributes=hidden", f"catalog.strength={strength}"]
        found = case(preset, [*common, *hidden], args.scenes, rate=args.rate)
        results.setdefault(preset, {})[f"{strength:g}"] = found
        print(
            f"{preset}, strength {strength:g}: base rate {found['base_rate']:.1%}, guess "
            f"{found['guess_accuracy']:.1%}, information {found['information_share']:.1%}",
            file=sys.stderr,
        )
    text = json.dumps(results, indent=2)
    if args.out:
        args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
