"""A reward of one's own: `examples/own_reward.py` trains on it, and a resumed run keeps it."""

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.checkpoint import read  # noqa: E402
from internav_data.camp.config import config_of  # noqa: E402
from internav_data.camp.run import begin, resume  # noqa: E402
from internav_data.camp.train import Request  # noqa: E402
from internav_data.envs.tasks import InteractiveNavigation  # noqa: E402
from internav_data.envs.vector import InterNavVectorEnv  # noqa: E402
from internav_data.records.errors import NotFiniteError, UsageError  # noqa: E402
from internav_data.world.actions import Action  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_reward.py"
TINY = [
    "network.image_size=16", "network.hidden=8", "ppo.num_envs=4", "ppo.num_steps=8",
    "stages.total_timesteps=64", "run.max_steps=8",
    "run.validation_episodes=2", "run.tensorboard=false", "run.workers=2",
]  # fmt: skip


@pytest.fixture(scope="module")
def frugal():
    spec = importlib.util.spec_from_file_location("own_reward", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.FrugalNavigation


def test_the_example_is_short_and_its_interactions_cost(scenes, frugal):
    assert len(EXAMPLE.read_text().splitlines()) < 40
    envs = [InterNavVectorEnv(2, scenes, 16, task=task) for task in ("interactive", [frugal] * 2)]
    for env in envs:
        env.reset(seed=0)
    for action, price in ((Action.MOVE_AHEAD, 0.0), (Action.PICKUP, 0.05), (Action.DONE, 0.0)):
        ours, theirs = (env.step(np.full(2, action)) for env in envs)
        np.testing.assert_allclose(ours[1] - theirs[1], price)
    metrics = [each[4]["metrics"]["return"] for each in (ours, theirs)]
    np.testing.assert_allclose(metrics[0] - metrics[1], 0.05)


def test_the_example_trains_over_processes_and_no_other_task_goes_on(scenes, tmp_path, frugal):
    out = tmp_path / "run"
    command = [sys.executable, EXAMPLE, scenes, out, *TINY]
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, timeout=300,
        env=os.environ | {"OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in (out / "log.jsonl").read_text().splitlines()]
    assert any("pushes_tried" in row.get("episode", ()) for row in rows)
    progress = read(out).progress
    assert (progress["task"], progress["environment_steps"]) == ("frugal", 64)
    request = Request(scenes, out, parts=("all",))
    with pytest.raises(UsageError, match="run of task 'frugal', asked for 'interactive'"):
        resume(request, {})
    resume(replace(request, task=frugal), {})


def test_training_pays_what_the_task_pays(scenes, tmp_path, frugal):
    class Counted(frugal):
        name, steps = "counted", 0

        def step(self, result):
            Counted.steps += 1
            return super().step(result)

    config = config_of("small", overrides=[*TINY, "run.workers=0"])
    begin(Request(scenes, tmp_path / "run", "ppo", config, ("all",), task=Counted))
    assert Counted.steps == 64


def test_a_task_needs_a_name_of_its_own(scenes, tmp_path):
    class Nameless(InteractiveNavigation):
        pass

    with pytest.raises(UsageError, match="'interactive' is another task's"):
        begin(Request(scenes, tmp_path / "run", task=Nameless))
    assert not (tmp_path / "run" / "checkpoints.json").exists()


def test_a_metric_of_ones_own_that_is_no_number_ends_the_run_in_one_line(scenes, tmp_path):
    class Undefined(InteractiveNavigation):
        name = "undefined"

        def metrics(self):
            return {**super().metrics(), "own": float("nan")}

    config = config_of("small", None, [*TINY, "run.workers=0"])
    request = Request(scenes, tmp_path / "run", "ppo", config, task=Undefined)
    with pytest.raises(NotFiniteError, match=r"log\.jsonl: episode/own: no finite number"):
        begin(request)
    assert read(request.out).progress["updates"] == 0, "the last checkpoint stands"
