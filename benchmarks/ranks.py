"""Training on two cores: steps a second of one process and of two ranks; JSON out.

    python benchmarks/ranks.py DATASET [--methods camp,ppo] [--updates 12] [--agents RUN,RUN]
                               [--settings ppo.update_epochs=2,…] [--out FILE]

Each row trains at a learning rate of 0, from the same first observations twice: the agent does the
same again, so that the second time, which is measured, every house is loaded and every push known.
`--agents` names a run for each method, whose trained agent acts; agents that know nothing end their
episodes early. Times are of the wall, so the cores must be idle.
Targets on two cores: 1,400 (camp) and 1,800 (ppo) steps a second.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import torch

from internav_data.camp.agents.protocol import Agent
from internav_data.camp.checkpoint import TrainState, read
from internav_data.camp.config import config_of
from internav_data.camp.rollout import Collector
from internav_data.camp.train import Request, StageRun, Trainer
from internav_data.core.machine import keep_freed_memory

TARGETS = {"camp": 1400, "ppo": 1800}
MAX_STEPS = 200


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--methods", default="camp,ppo")
    parser.add_argument("--updates", type=int, default=12)
    parser.add_argument("--agents", default="")
    parser.add_argument("--settings", default="")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    settings = [setting for setting in options.settings.split(",") if setting]
    methods = options.methods.split(",")
    if os.environ.get("BENCHMARK_ROW"):
        agent = Path(options.agents) if options.agents else None
        measure(options.dataset, methods[0], settings, options.updates, agent)
        return 0
    agents = options.agents.split(",") if options.agents else [""] * len(methods)
    rows = [
        row(options.dataset, method, ranks, options, agent)
        for method, agent in zip(methods, agents, strict=True)
        for ranks in (1, 2)
    ]
    result = {
        "benchmark": "ranks", "torch": torch.__version__, "targets": TARGETS,
        "updates": options.updates, "settings": settings, "trained": bool(options.agents),
        "rows": rows,
    }  # fmt: skip
    text = json.dumps(result, indent=2)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0


def row(
    dataset: Path, method: str, ranks: int, options: argparse.Namespace, agent: str
) -> dict[str, Any]:
    """Measure a method in processes of its own, which meet as those of `torchrun` do."""
    with tempfile.TemporaryDirectory() as folder, socket.create_server(("127.0.0.1", 0)) as free:
        answer, port = Path(folder) / "row.json", free.getsockname()[1]
        free.close()
        command = [
            sys.executable, __file__, str(dataset), "--methods", method, "--agents", agent,
            "--updates", str(options.updates), "--settings", options.settings,
        ]  # fmt: skip
        environment = {**os.environ, "BENCHMARK_ROW": str(answer), "OMP_NUM_THREADS": "1"}
        if ranks > 1:
            environment |= {"MASTER_ADDR": "127.0.0.1", "MASTER_PORT": str(port)}
            environment |= {"WORLD_SIZE": str(ranks)}
        started = [
            subprocess.Popen(command, env={**environment, "RANK": str(k), "LOCAL_RANK": str(k)})
            for k in range(ranks)
        ]
        codes = [process.wait() for process in started]
        assert not any(codes), f"{method}: exit codes {codes}"
        return {"method": method, "ranks": ranks, **json.loads(answer.read_text("utf-8"))}


def measure(
    dataset: Path, method: str, settings: list[str], updates: int, run: Path | None
) -> None:
    """Train twice over the same steps, and write the times of the second to a file."""
    still = {"ppo.target_kl": 1e9, "ppo.critic_warmup_rollouts": 0, "run.max_steps": MAX_STEPS}
    still |= {"stages.learning_rate": 0.0, "stages.joint_learning_rate": 0.0}
    keep_freed_memory()
    config = config_of("small", overrides=settings, options=still)
    checkpoint = None if run is None else read(run)
    request = Request(dataset, Path(os.devnull), method, config, ("all",), device="cpu")
    trainer = Trainer(request, TrainState(("all",)), checkpoint)
    now = trainer.open(trainer.stages[0])
    repeat(trainer, now, updates)
    rows = repeat(trainer, now, updates)
    now.source.loop.env.close()
    if trainer.ranks.first:
        Path(os.environ["BENCHMARK_ROW"]).write_text(json.dumps(summary(rows)), encoding="utf-8")


def repeat(trainer: Trainer, now: StageRun, updates: int) -> list[dict[str, float]]:
    """Train from the stage's first observations; return the times of the updates."""
    source, learner = now.source, now.learner
    assert isinstance(source, Collector) and isinstance(learner, Agent)  # noqa: PT018
    source.state = learner.initial_state(len(now.local))
    source.loop.reset(seed=now.seed)
    trainer.state.done = trainer.state.updates = 0
    trainer.lap()
    return [trainer.update(now)["time"] for _ in range(updates)]


def summary(rows: list[dict[str, float]]) -> dict[str, float]:
    """Return the mean rate and the microseconds a step of environments, inference, learning."""
    environment, collection, whole = (
        sum(1e6 / row[name] for row in rows) / len(rows)
        for name in ("env_steps_per_s", "collect_steps_per_s", "steps_per_s")
    )
    return {
        "steps_per_s": round(1e6 / whole),
        "environment_us": round(environment),
        "inference_us": round(collection - environment),
        "learning_us": round(whole - collection),
        "new_push_share": round(sum(row["new_push_share"] for row in rows) / len(rows), 4),
    }


if __name__ == "__main__":
    sys.exit(main())
