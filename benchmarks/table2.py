"""Table 2 of the paper beside what this generator makes: JSON on stdout, the table on stderr.

    python benchmarks/table2.py --scenes 1200 --episodes-per-scene 10 --seeds 0 1

Targets: every figure within 5 % over 1,200 scenes x 10 episodes on two seeds, 10 % over 300.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from internav_data.dataset import compute_stats, load_dataset
from internav_data.generation import GenerationConfig, generate, load_config

COLUMNS = ("obstacle_num", "distance_m", "cross_room_num")


def compared(config: GenerationConfig, scenes: int, workers: int) -> dict[str, object]:
    """Make a dataset and put its Table 2 beside the paper's."""
    with tempfile.TemporaryDirectory(prefix="internav-table2-") as folder:
        out = Path(folder) / "dataset"
        report = generate(out, config, scenes, workers)
        stats = compute_stats(load_dataset(out))
    rows = []
    for row in stats["table2"]:
        figures = {
            "rooms": row["rooms"],
            "ratio": row["ratio"],
            "paper_ratio": row["paper"]["ratio"],
        }
        for column in COLUMNS:
            figures[column] = row[column]
            figures[f"{column}_to_paper"] = row[column] / row["paper"][column]
        figures["sealed_share_of_blocked"] = row["sealed"] / max(1, row["blocked"])
        rows.append(figures)
    return {
        "seed": config.seed,
        "scenes": scenes,
        "episodes": report.episodes,
        "quarantined": len(report.quarantined),
        "sealed_share_of_blocked": stats["sealed_share_of_blocked"],
        "redraws": stats["redraws"],
        "expert": stats["expert"],
        "rows": rows,
        "largest_deviation": max(
            abs(row[f"{column}_to_paper"] - 1.0) for row in rows for column in COLUMNS
        ),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--episodes-per-scene", type=int, default=10)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--workers", type=int, default=0)
    parser.add_argument("--episode-preset", default="paper", help="as of internav-gen generate")
    parser.add_argument("--set", action="append", default=[], help="a config value, as a.b=c")
    args = parser.parse_args()
    results = []
    for seed in args.seeds:
        given = [
            *args.set,
            f"seed={seed}",
            f"episodes_per_scene={args.episodes_per_scene}",
            f"test_episodes_per_scene={args.episodes_per_scene}",
        ]
        result = compared(
            load_config(None, given, episode_preset=args.episode_preset), args.scenes, args.workers
        )
        results.append(result)
        refused = result["expert"]["refused_share"]
        print(
            f"seed {seed}: {result['episodes']} episodes, largest deviation "
            f"{result['largest_deviation']:.1%}, the expert refused {refused:.1%}",
            file=sys.stderr,
        )
        for row in result["rows"]:
            line = "  ".join(
                f"{c} {row[c]:.2f} ({100 * (row[f'{c}_to_paper'] - 1):+.1f} %)" for c in COLUMNS
            )
            share = row["sealed_share_of_blocked"]
            print(f"  {row['rooms']:>4}  {line}  sealed {share:.0%}", file=sys.stderr)
    json.dump(results, sys.stdout, indent=1)
    print()


if __name__ == "__main__":
    main()
