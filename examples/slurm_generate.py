"""A dataset made by a Slurm cluster: one job a range of scenes, then one that merges them.

    python examples/slurm_generate.py data/mine --scenes 12000 --parts 40

Needs `pip install submitit` and a folder that all machines see. `--local` runs the jobs as
processes on this machine instead, which shows that all is well before a cluster is asked. Run the
same command again after a failure: finished parts are seen at once, unfinished ones go on.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

COMMAND = [sys.executable, "-c", "from internav_cli.main import main; main()"]


def ranges(scenes: int, parts: int) -> list[tuple[int, int]]:
    """Return the ranges of scenes of the parts, all of about the same length."""
    ends = [scenes * number // parts for number in range(parts + 1)]
    return [(first, end) for first, end in pairwise(ends) if first < end]


def run(*arguments: str) -> None:
    """Run a command of `internav-gen` in this job; scenes that cannot be made are no failure.

    Raises
    ------
    RuntimeError
        The command failed.

    """
    done = subprocess.run([*COMMAND, *arguments], check=False)  # noqa: S603 - our own words
    if done.returncode not in {0, 4}:
        raise RuntimeError(f"internav-gen {' '.join(arguments)}: exit code {done.returncode}")


def main() -> None:
    """Submit a job for each part, wait for them, and merge."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--scenes", type=int, default=12_000)
    parser.add_argument("--parts", type=int, default=40)
    parser.add_argument("--workers", type=int, default=16, help="processes of a job")
    parser.add_argument("--partition", help="Slurm's partition of machines")
    parser.add_argument("--local", action="store_true", help="jobs are processes here")
    options, settings = parser.parse_known_args()  # all others are those of `generate`

    import submitit  # noqa: PLC0415 - --help needs it not

    folder = options.dataset.with_name(f"{options.dataset.name}-parts")
    executor = submitit.AutoExecutor(folder / "logs", cluster="local" if options.local else None)
    executor.update_parameters(name="internav", cpus_per_task=options.workers, timeout_min=24 * 60)
    if options.partition:
        executor.update_parameters(slurm_partition=options.partition)
    parts, jobs = [], []
    for first, end in ranges(options.scenes, options.parts):
        parts.append(str(folder / f"{first:08d}"))
        asked = ["generate", "--scene-range", f"{first}:{end}", "--out", parts[-1]]
        workers = ["--workers", str(options.workers)]
        jobs.append(executor.submit(run, *asked, *workers, *settings))
    for job in jobs:
        job.result()  # raises what a job did, with the end of its log
    run("merge", *parts, "--out", str(options.dataset))
    print(f"{options.dataset} holds the scenes of {len(parts)} parts; {folder} can go")


if __name__ == "__main__":
    main()
