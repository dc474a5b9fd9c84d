"""The study of docs/training.md: whether hierarchy and intent help where the way is blocked.

    python benchmarks/study.py FOLDER [--seeds 3] [--jobs 2]

Makes two datasets in FOLDER (houses to train on, other houses to measure on), trains every method
on every seed, one thread each, measures it after cloning and at the end, and lays all of it side by
side: FOLDER/results (tables.md, tables.json, report.html). What is there already is not done again,
so an interrupted study goes on. Settings were fixed by a pilot on seed 100, which is not among the
seeds of the study.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

DATA = {
    "houses": ("--seed", 41, "--scenes", 612, "--episodes-per-scene", 20),
    "unseen": ("--seed", 42, "--scenes", 254, "--episodes-per-scene", 6),
}
"""Both of 1-3 rooms and at most three obstacles."""
DATA_BOTH = ("--rooms", "1-3", "--set", "episodes.max_obstacles=[3,3,3]")
NEAR = ("--filter", "shortest_path_m<=6")
"""Episodes to train and to measure on; shortest_path_m is 2 m at least."""
METHODS = {
    "ppo": ("--method", "ppo"),
    "ppo-intent": ("--method", "ppo-intent"),
    "hrl": ("--method", "hrl"),
    "camp-none": ("--method", "camp", "--intent", "none"),
    "camp": ("--method", "camp"),
}
TRAINING = (
    "--device", "cpu", "--preset", "small", "--pretrain", "bc", *NEAR,
    "--steps", 60_000, "--set", "run.max_steps=200", "--set", "cloning.frames=100000",
    "--set", "cloning.epochs=1", "--set", "run.validate_every=1000",
    "--set", "run.validation_episodes=32", "--set", "run.tensorboard=false",
    "--set", "ppo.critic_warmup_rollouts=4", "--set", "stages.joint_learning_rate=3e-4",
)  # fmt: skip
LEAST_EPISODES = 50
MEASURE = ("--split", "all", *NEAR, "--max-steps", 200, "--limit", 400, "--no-reference-policies")


def tool(name: str, *words: object) -> None:
    """Run one of the project's commands on one thread.

    Raises
    ------
    SystemExit
        The command fails.
    """
    command = [str(Path(sys.executable).with_name(name)), *map(str, words)]
    environment = os.environ | {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr[-2000:]}")


def one_run(folder: Path, name: str, seed: int) -> None:
    """Clone, evaluate, train, evaluate."""
    run, results = folder / "runs" / f"{name}-{seed}", folder / "results"
    houses, unseen = folder / "houses", folder / "unseen"
    cloned, final = (results / kind / f"{name}-{seed}" for kind in ("cloned", "final"))
    if not (cloned / "tables.md").exists():
        again = ("--resume",) if (run / "checkpoints.json").exists() else ()
        words = (houses, "--out", run, "--seed", seed, *METHODS[name], *TRAINING)
        tool("camp-train", *words, "--stages", "cloning", *again)
        tool("camp-eval", run, unseen, *MEASURE, "--out", cloned, "--force")
    if not (final / "tables.md").exists():
        tool("camp-train", houses, "--out", run, "--resume", "--stages", "auxiliary,single,all")
        tool("camp-eval", run, unseen, *MEASURE, "--out", final, "--force")
    sys.stderr.write(f"{name}-{seed} is done\n")


def draw_curves(folder: Path) -> None:
    """Draw training success against steps, a line a method: means over its seeds."""
    from internav_data.views.curves import Curve, curves_svg

    curves = []
    for name in METHODS:
        logs = sorted((folder / "runs").glob(f"{name}-?/log.jsonl"))
        found: dict[float, list[float]] = {}
        for log in logs:
            ended = 0
            for row in map(json.loads, log.open()):
                # All scenes alone: hierarchies spend the first stage on tasks of their own. The
                # first episodes to end are the short ones, so a mean is over 50 at least.
                if row.get("stage") == "all" and "episode" in row:
                    ended += row["episode"]["ended"]
                    if ended >= LEAST_EPISODES:
                        success = 100.0 * row["episode"]["success"]
                        found.setdefault(row["step"], []).append(success)
        whole = {step: values for step, values in found.items() if len(values) == len(logs)}
        curves.append(Curve(name, tuple((s, sum(v) / len(v)) for s, v in sorted(whole.items()))))
    title = "Success of the last 100 training episodes, %"
    picture = curves_svg(title, "environment steps after cloning", curves)
    style = "<style>text{font:11px sans-serif}.grid{stroke:#ddd}.left,.name{text-anchor:end}"
    style += ".below{text-anchor:middle}.title{font-weight:bold}</style>"
    head, rest = picture.split(">", 1)
    head = head.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg" width="920"')
    ground = '<rect width="100%" height="100%" fill="white"/>'
    (folder / "results" / "curves.svg").write_text(f"{head}>{style}{ground}{rest}\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=2)
    args = parser.parse_args()
    folder: Path = args.folder
    for name, words in DATA.items():
        if not (folder / name / "manifest.json").exists():
            tool("internav-gen", "generate", "--out", folder / name, *words, *DATA_BOTH)
    runs = [(name, seed) for seed in range(args.seeds) for name in METHODS]
    with ThreadPoolExecutor(args.jobs) as pool:
        list(pool.map(lambda run: one_run(folder, *run), runs))
    unseen, results = folder / "unseen", folder / "results"
    references = results / "reference-policies"
    if not (references / "tables.md").exists():
        tool("camp-eval", "expert,shortest_path,random", unseen, *MEASURE[:-1], "--out", references)
    for kind in ("cloned", "final"):
        found = sorted((results / kind).iterdir())
        tool("camp-eval", "compare", *found, references, "--dataset", unseen,
             "--out", results / f"all-{kind}", "--force")  # fmt: skip
    draw_curves(folder)


if __name__ == "__main__":
    main()
