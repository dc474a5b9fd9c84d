"""Runs: gone on with to the last bit, over ranks, and what stops them."""

import json
import os
import subprocess
import sys
from collections import Counter
from dataclasses import replace

import pytest

torch = pytest.importorskip("torch")

from safetensors.torch import load_file  # noqa: E402

from internav_data.camp import data as data_module  # noqa: E402
from internav_data.camp import train as train_module  # noqa: E402
from internav_data.camp.agents import AGENTS, Method, make_agent  # noqa: E402
from internav_data.camp.agents.flat import PPOAgent  # noqa: E402
from internav_data.camp.checkpoint import find, load_agent, read  # noqa: E402
from internav_data.camp.config import (  # noqa: E402
    config_of,
    from_mapping,
    preset,
)
from internav_data.camp.data import TrainingData  # noqa: E402
from internav_data.camp.run import begin, forecast, resume  # noqa: E402
from internav_data.camp.train import Request  # noqa: E402
from internav_data.core.interrupts import InterruptedRunError  # noqa: E402
from internav_data.records.errors import (  # noqa: E402
    CorruptDataError,
    NotFiniteError,
    UsageError,
)

SMALL = {
    "network": {"image_size": 16, "hidden": 12},
    "ppo": {
        "num_envs": 4, "num_minibatches": 2, "num_steps": 8, "chunk_steps": 4, "update_epochs": 2,
        "critic_warmup_rollouts": 1,
    },
    "cloning": {"frames": 64, "epochs": 2, "num_envs": 4, "num_steps": 8, "sync_every": 2},
    "stages": {
        "total_timesteps": 320, "auxiliary_share": 0.3, "single_room_share": 0.3,
        "min_auxiliary_timesteps": 0,
    },
    "run": {
        "max_steps": 12, "checkpoint_every": 3, "validate_every": 2, "validation_episodes": 2,
        "tensorboard": False,
    },
}  # fmt: skip


@pytest.fixture
def request_for(scenes, tmp_path):
    def make(name, method="camp", **changes):
        config = from_mapping(from_mapping(preset("small"), SMALL, "test"), changes, "test")
        return Request(scenes, tmp_path / name, method, config, clones=True)

    return make


def written(run):
    """Return the files of a run, without durations."""
    folder = find(run)
    rows = [json.loads(line) for line in (run / "log.jsonl").read_text().splitlines()]
    for row in rows:
        row.pop("time", None)
        row.get("cloning", {}).pop("frames_per_s", None)
    about = json.loads((folder / "checkpoint.json").read_text())
    about["progress"].pop("training_s")
    about["progress"].pop("log")  # bytes: rates have more or fewer digits
    about.pop("files")
    about.pop("sha256")
    names = ("weights.safetensors", "training.safetensors")
    return rows, about, *((folder / name).read_bytes() for name in names)


def after(count):
    """Ask to stop after so many updates, cloning included."""
    left = [count]

    def asked():
        left[0] -= 1
        return 2 if left[0] == 0 else 0

    return asked


@pytest.mark.parametrize(
    ("method", "stops"), [("camp", (2, 3, 2, 3)), ("ppo", (5, 3)), ("nie", (6,))]
)
def test_resumed_runs_are_unbroken_ones_to_the_last_byte(request_for, method, stops):
    """Stopped in cloning, in auxiliary tasks, in single rooms and at the end of a stage."""
    begin(request_for("whole", method))
    broken = request_for("broken", method)
    with pytest.raises(InterruptedRunError):
        begin(replace(broken, interrupted=after(stops[0])))
    for stop in stops[1:]:
        with pytest.raises(InterruptedRunError):
            resume(replace(broken, interrupted=after(stop)), {})
    resume(broken, {})
    whole, again = written(request_for("whole").out), written(broken.out)
    assert whole[0] == again[0]
    assert whole[1] == again[1]
    assert whole[2:] == again[2:]
    assert len({row.get("stage") for row in whole[0]}) == 4  # cloning has none


def test_an_agent_that_draws_from_torch_is_resumed_to_the_last_bit(request_for, monkeypatch):
    class Noisy(PPOAgent):
        """It has a loss beside PPO's of random weights."""

        def evaluate(self, batch):
            found = super().evaluate(batch)
            return replace(found, loss=torch.rand_like(found.value) * found.value)

    monkeypatch.setitem(AGENTS, "noisy", Method(Noisy, "ppo with noise"))
    begin(request_for("whole", "noisy"))
    broken = request_for("broken", "noisy")
    with pytest.raises(InterruptedRunError):
        begin(replace(broken, interrupted=after(5)))
    torch.rand(7)  # another history
    resume(broken, {})
    assert written(request_for("whole").out)[2:] == written(broken.out)[2:]


def test_a_finished_run_is_left_as_it_is(request_for):
    asked = request_for("done", "ppo")
    begin(asked)
    before = written(asked.out)
    resume(asked, {})
    assert written(asked.out) == before


def test_a_finished_run_goes_on_with_more_steps(request_for):
    """They go to the last stage; broken off again, it ends with the same bytes."""

    def resumed(name, *stops):
        given = request_for(name, "ppo")
        begin(given)
        before = written(given.out)
        more = {"config": request_for(name, stages={"total_timesteps": 480}).config,
                "keys": ["stages.total_timesteps"]}  # fmt: skip
        for stop in stops:
            with pytest.raises(InterruptedRunError):
                resume(replace(given, interrupted=after(stop)), more)
        resume(given, more)
        resume(given, more)  # the same command once more: all is done
        return before, written(given.out)

    before, whole = resumed("whole")
    assert whole == resumed("broken", 2, 1)[1]
    assert whole[0][: len(before[0])] == before[0]
    assert whole[1]["progress"]["environment_steps"] == 480
    lengths = Counter(row["stage"] for row in whole[0] if "ppo" in row)
    assert lengths == Counter(row["stage"] for row in before[0] if "ppo" in row) + Counter(all=5)
    told = (request_for("whole").out / "config.toml").read_text()
    assert "extra_timesteps = 160" in told


def test_more_steps_need_the_last_stage_and_fewer_are_refused(request_for):
    given = request_for("some", "ppo")
    given = replace(given, parts=("auxiliary",))
    begin(given)
    for name, steps, words in (
        ("total_timesteps", 100, "320 in this run, asked for 100.*not fewer"),
        ("total_timesteps", 480, "'all'"),
        ("extra_timesteps", 160, "'all'"),
    ):
        config = request_for("some", stages={name: steps}).config
        with pytest.raises(UsageError, match=words):
            resume(given, {"config": config, "keys": [f"stages.{name}"]})


def test_other_workers_change_no_bit_of_a_resumed_run(request_for):
    short = {"validation_episodes": 0}
    begin(request_for("whole", "ppo", run=short))
    given = request_for("other", "ppo", run=short)
    with pytest.raises(InterruptedRunError):
        begin(replace(given, interrupted=after(12)))
    run = {"workers": 2, "checkpoint_every": 1, "threads": 1}
    other = request_for("other", "ppo", run=short | run).config
    resume(given, {"config": other, "keys": [f"run.{name}" for name in run]})
    whole, again = written(request_for("whole").out), written(given.out)
    assert again[1]["config"]["run"]["workers"] == 2
    assert whole[0] == again[0]
    assert whole[1]["progress"] == again[1]["progress"]
    assert whole[2:] == again[2:]


def test_parts_follow_from_the_last_ones_checkpoint(request_for):
    """`--stages` one after another is the run in one go."""
    begin(request_for("whole"))
    parts = request_for("parts")
    begin(Request(parts.dataset, parts.out, "camp", parts.config, ("auxiliary",), clones=True))
    with pytest.raises(UsageError, match="follow each other"):
        resume(parts, {"parts": ("all", "single")})
    resume(parts, {"parts": ("single", "all")})
    whole, again = (load_file(find(run) / "weights.safetensors")
                    for run in (request_for("whole").out, parts.out))  # fmt: skip
    for name, value in whole.items():
        torch.testing.assert_close(again[name], value, atol=0, rtol=0)


def test_last_and_best_are_kept_and_play(request_for):
    asked = request_for("kept")
    begin(asked)
    pointer = json.loads((asked.out / "checkpoints.json").read_text())
    assert {path.name for path in (asked.out / "checkpoints").iterdir()} == {
        pointer["last"], pointer["best"],
    }  # fmt: skip
    assert load_agent(asked.out, "best").method == "camp"
    with pytest.raises(UsageError, match="--resume"):
        begin(asked)


def test_a_dry_run_tells_the_stages_and_writes_nothing(request_for):
    asked = request_for("dry")
    told = forecast(asked)
    assert [name for name, _, _ in told] == ["cloning", "auxiliary", "single", "all"]
    assert sum(steps for _, steps, _ in told) == 320
    assert all(seconds > 0.0 for _, _, seconds in told)
    assert not asked.out.exists()


def test_what_is_not_finite_stops_and_leaves_the_last_checkpoint(request_for, monkeypatch):
    asked = request_for("nan", "ppo")
    real, calls = train_module.ppo.update, []

    def poisoned(agent, *given, **named):
        calls.append(1)
        if len(calls) == 5:
            with torch.no_grad():
                next(agent.parameters()).fill_(torch.nan)
        return real(agent, *given, **named)

    monkeypatch.setattr(train_module.ppo, "update", poisoned)
    with pytest.raises(NotFiniteError, match=r"environment \d.*seed \d+.*last checkpoint"):
        begin(asked)
    for value in load_agent(asked.out).state_dict().values():
        assert value.isfinite().all()
    monkeypatch.undo()
    resume(asked, {})


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"method": "ppo"}, "run of method 'camp', asked for 'ppo'"),
        ({"config": {"ppo": {"num_steps": 12}}}, "ppo.num_steps is 8 in this run, asked for 12"),
        ({"parts": ("all",)}, "stage auxiliary is not finished"),
    ],
)
def test_resume_refuses_another_run(request_for, asked, words):
    given = request_for("other")
    with pytest.raises(InterruptedRunError):
        begin(replace(given, interrupted=after(6)))
    if "config" in asked:
        asked = {"config": from_mapping(given.config, asked["config"], "test")}
    with pytest.raises(UsageError, match=words):
        resume(given, asked)


def test_resume_refuses_another_dataset_and_damage(request_for, scenes, houses):
    given = request_for("moved", "ppo")
    with pytest.raises(InterruptedRunError):
        begin(replace(given, interrupted=after(6)))
    with pytest.raises(UsageError, match="no training episodes; of every 120 scenes the first two"):
        resume(Request(houses, given.out, "ppo", given.config), {})
    log = given.out / "log.jsonl"
    kept = log.read_bytes()
    log.write_bytes(kept[:10])
    with pytest.raises(CorruptDataError, match="the checkpoint knows of"):
        resume(given, {})
    log.write_bytes(kept)
    training = find(given.out) / "training.safetensors"
    training.write_bytes(training.read_bytes()[:-1])
    with pytest.raises(CorruptDataError, match="copy the checkpoint again"):
        resume(given, {})


def test_episodes_are_those_that_are_asked_for(scenes):
    near = TrainingData(scenes, ["shortest_path_m<=3"]).episodes()
    assert 0 < len(near) < len(TrainingData(scenes).episodes())
    assert all(episode.shortest_path_m <= 3.0 for episode in near)
    with pytest.raises(UsageError, match="for which --filter holds"):
        TrainingData(scenes, ["shortest_path_m<=0"])
    with pytest.raises(UsageError, match="COLUMN=VALUE"):
        TrainingData(scenes, ["near"])


def test_an_agent_without_parameters_has_nothing_to_learn(request_for, monkeypatch):
    given = request_for("idle", "ppo")
    monkeypatch.setattr(PPOAgent, "optimised", lambda _: [])
    with pytest.raises(UsageError, match="nothing to learn; expected one of camp, "):
        begin(given)
    assert not given.out.exists()


def test_a_dataset_without_outcomes_is_refused(scenes, monkeypatch):
    from dataclasses import replace

    class Bare:
        def __init__(self, dataset):
            self._dataset, self.fingerprint = dataset, dataset.fingerprint

        def __len__(self):
            return len(self._dataset)

        def __getitem__(self, number):
            episode = self._dataset[number]
            bare = tuple(replace(obstacle, outcomes=None) for obstacle in episode.obstacles)
            return replace(episode, obstacles=bare)

    load = data_module.load_dataset
    monkeypatch.setattr(data_module, "load_dataset", lambda *given: Bare(load(*given)))
    with pytest.raises(UsageError, match="no outcomes"):
        TrainingData(scenes)


def test_settings_come_from_preset_file_options_and_overrides(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[ppo]\nnum_steps = 32\nupdate_epochs = 2\n")
    config = config_of(
        "small", file, ["ppo.update_epochs=5"], {"seed": 3, "data.filter": ("mode=blocked",)}
    )
    assert (config.ppo.num_steps, config.ppo.update_epochs, config.seed) == (32, 5, 3)
    assert config.data.filter == ("mode=blocked",)
    with pytest.raises(UsageError, match=r"ppo\.num_stepz.*ppo\.num_steps"):
        config_of("small", None, ["ppo.num_stepz=1"])
    with pytest.raises(UsageError, match="expected 0"):
        config_of("small", None, [], {"seed": -1})


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"gamma": 2.0}, r"ppo\.gamma is 2\.0"), ({"chunk_steps": 3}, r"ppo\.chunk_steps is 3")],
)
def test_a_config_made_by_hand_is_checked_before_anything_is_written(request_for, changes, words):
    given = request_for("odd", "ppo")
    config = replace(given.config, ppo=replace(given.config.ppo, **changes))
    with pytest.raises(UsageError, match=words):
        begin(replace(given, config=config))
    assert not given.out.exists()


def test_an_agent_whose_replay_differs_is_refused_at_its_first_rollout(request_for, monkeypatch):
    class Forgetful(PPOAgent):
        """It computes other probabilities than it drew from."""

        def evaluate(self, batch):
            found = super().evaluate(batch)
            return replace(found, log_prob=1.01 * found.log_prob)

    monkeypatch.setattr(train_module, "make_agent", lambda _, config: Forgetful(config))
    given = replace(request_for("odd", "ppo"), clones=False)
    with pytest.raises(UsageError, match=r"'ppo': replayed before any step.*evaluate\(\)"):
        begin(given)
    assert read(given.out).progress["updates"] == 0, "nothing of it is saved"


def test_without_validations_in_between_a_stage_of_the_main_task_still_ends_with_one(request_for):
    given = replace(request_for("rare", "ppo", run={"validate_every": 0}), clones=False)
    begin(given)
    rows = [json.loads(line) for line in (given.out / "log.jsonl").read_text().splitlines()]
    stages = [row["stage"] for row in rows if "validation" in row]
    assert stages == ["auxiliary", "single", "all"]


BY_GRADIENTS = """
import atexit
import os
import torch
from internav_cli.camp_train import main

@atexit.register  # registered first, so called last
def check():
    if torch.distributed.is_initialized():
        os._exit(9)

torch.optim.Adam = lambda parameters, rate, **_: torch.optim.SGD(parameters, rate)
main()
"""
"""`camp-train` that must leave its process group, and whose steps are the gradients.

Adam divides by |g| + epsilon, so that the last bits of tiny gradients would decide on its steps.
"""


def test_two_ranks_train_what_one_does(scenes, tmp_path):
    """Half of the environments each, over gloo; every update, every log row, every checkpoint."""
    file, script = tmp_path / "small.toml", tmp_path / "by_gradients.py"
    script.write_text(BY_GRADIENTS)
    file.write_text(
        "[network]\nimage_size = 16\nhidden = 12\n"
        "[ppo]\nnum_envs = 6\nnum_minibatches = 1\nnum_steps = 8\n"
        "update_epochs = 2\ncritic_warmup_rollouts = 1\n"
        "[cloning]\nframes = 48\nepochs = 1\nnum_envs = 6\nnum_steps = 8\nlearning_rate = 0.5\n"
        "[stages]\ntotal_timesteps = 288\nauxiliary_share = 0.3\nsingle_room_share = 0.3\n"
        "min_auxiliary_timesteps = 0\n"
        "learning_rate = 0.5\njoint_learning_rate = 0.5\n"
        "[run]\nmax_steps = 12\nvalidation_episodes = 0\ntensorboard = false\n"
    )
    words = [scenes, "--config", file, "--pretrain", "bc"]
    words += ["--device", "cpu", "--preset", "small", "--out"]
    torchrun = ["-m", "torch.distributed.run", "--standalone", "--nproc-per-node", "2"]
    for out, start in (("one", []), ("two", torchrun)):
        command = [sys.executable, *start, script, *words, tmp_path / out]
        done = subprocess.run(
            [str(word) for word in command], capture_output=True, text=True, check=False,
            timeout=300, env=os.environ | {"OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
    one, two = written(tmp_path / "one"), written(tmp_path / "two")
    for mine, other in zip(one[0], two[0], strict=True):
        assert mine.keys() == other.keys()
        for name in ("episode", "decision"):
            assert mine.get(name) == pytest.approx(other.get(name), abs=1e-5)
    assert one[1]["progress"]["environments"] == two[1]["progress"]["environments"]
    weights = [load_file(find(tmp_path / out) / "weights.safetensors") for out in ("one", "two")]
    untrained = make_agent("camp", config_of("small", file)).state_dict()
    start, mine, other = (
        torch.cat([found[name].flatten() for name in untrained]) for found in (untrained, *weights)
    )
    moved = (mine - start).norm()
    assert moved > 0.1
    assert (mine - other).norm() < 1e-5 * moved
