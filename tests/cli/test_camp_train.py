"""`camp-train` from the outside: exit codes, one line for what goes wrong, nothing lost."""

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import psutil
import pytest
from stderr_lines import beside_the_dataset

pytest.importorskip("torch")

from internav_cli.camp_train import main

from internav_data.core.files import with_sha256

TRAIN = Path(sys.executable).with_name("camp-train")
TINY = (
    "--device", "cpu", "--method", "ppo", "--set", "network.image_size=16",
    "--set", "network.hidden=8", "--set", "ppo.num_envs=4", "--set", "ppo.num_minibatches=1",
    "--set", "ppo.num_steps=8", "--set", "run.validation_episodes=1", "--set", "run.max_steps=10",
    "--set", "run.tensorboard=false", "--set", "run.checkpoint_every=1",
)  # fmt: skip


@pytest.fixture
def dataset(three_houses):
    return three_houses


@pytest.fixture
def call(calling):
    return calling(main)


def test_help_is_fast_and_has_examples():
    script = (
        "import sys\nfrom internav_cli.camp_train import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit as e:\n    assert not e.code\n"
        "print(sorted({'torch', 'numpy', 'numba', 'pyarrow'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert "Examples:" in done.stdout
    assert done.stdout.splitlines()[-1] == "[]"


def test_a_bug_names_a_command_that_shows_where(call, dataset, monkeypatch, capsys):
    """`camp-train` takes `--debug` as the other commands do, wherever it stands."""
    import internav_data.camp.run

    def broken(*_):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(internav_data.camp.run, "begin", broken)
    code, _, err = call(dataset, *TINY, "--out", "a run")
    assert code == 1
    shown = err.split("this is a bug: `")[1].split("`")[0]
    program, *words = shlex.split(shown)
    assert program == "camp-train"
    for asked in (words, [*words[1:], words[0]]):
        with pytest.raises(SystemExit, match="1"):
            main(asked)
        assert 'raise ZeroDivisionError("a bug")' in capsys.readouterr().err
    assert call("--version")[:2] == (0, f"camp-train, version {version('internav-data')}\n")


def test_no_run_is_written_into_a_dataset(call, dataset):
    before = sorted(path.name for path in dataset.iterdir())
    code, _, err = call(dataset, *TINY, "--steps", 32, "--out", dataset)
    assert code == 2
    assert f"{dataset}: --out: a dataset is there" in err
    assert sorted(path.name for path in dataset.iterdir()) == before


def test_the_command_that_measures_a_run_can_be_pasted(call, dataset):
    code, _, err = call(dataset, *TINY, "--steps", 32, "--out", "my run")
    assert code == 0, err
    (named,) = [line for line in err.splitlines() if line.startswith("measure it: ")]
    words = shlex.split(named.removeprefix("measure it: "))
    assert words == ["camp-eval", "my run", str(dataset)]


def test_a_run_is_trained_and_measured(call, dataset, tmp_path):
    code, out, err = call(dataset, *TINY, "--steps", 96, "--json")
    assert code == 0, err
    assert json.loads(out)["step"] == 96
    assert "camp-eval runs/ppo-0" in err
    run = tmp_path / "runs" / "ppo-0"
    assert sorted(p.name for p in run.iterdir()) == [
        "checkpoints", "checkpoints.json", "config.toml", "log.jsonl",
    ]  # fmt: skip
    code, out, err = call(dataset, "--config", run / "config.toml", "--print-config")
    assert code == 0, err
    assert out == (run / "config.toml").read_text()
    before = (run / "checkpoints.json").read_bytes()
    assert call(dataset, *TINY)[0] == 2
    assert (run / "checkpoints.json").read_bytes() == before


@pytest.mark.parametrize(
    ("words", "code", "expected"),
    [
        (("DATA", "--nonsense"), 2, ["--nonsense"]),
        ((), 5, ["internav-dataset", "internav-gen generate"]),
        (("DATA", "--method", "sarsa"), 2, ["sarsa", "ppo-intent"]),
        (("DATA", "--set", "ppo.num_step=3"), 2, ["ppo.num_step", "ppo.num_steps"]),
        (("DATA", "--set", "ppo.num_steps=zero"), 2, ["ppo.num_steps", "whole number"]),
        (("DATA", "--set", "ppo.num_minibatches=5"), 2, ["minibatches", "divide"]),
        (("DATA", "--steps", "10"), 2, ["--steps", "update of 1024", "as many"]),
        (("DATA", "--workers", "99"), 2, ["run.workers is 99", "16 processes at most"]),
        (("DATA", "--set", "cloning.frames=99"), 2, ["cloning.frames is 99", "256 frames"]),
        (("DATA", "--method", "ppo", "--intent", "none"), 2, ["agent.intent", "camp, ppo-intent"]),
        (("DATA", "--config", "nowhere.toml"), 2, ["nowhere.toml"]),
        (("DATA", "--set", "ppo.steps=9"), 2, ["no key 'ppo.steps'; did you mean 'ppo.num_steps'"]),
        (("DATA", "--where", "room_count=1"), 2, ["No such option '--where'"]),
        (("DATA", "--stages", "all,single"), 2, ["--stages", "order"]),
        (("DATA", "--filter", "shortest_path_m<=0"), 2, ["no training episodes", "--filter"]),
        (("DATA", "--filter", "room=1"), 2, ["room"]),
        (("DATA", "--device", "cuda"), 2, ["no GPU"]),
        (("DATA", "--resume", "--out", "nothing"), 2, ["nothing", "no last checkpoint"]),
        (("NOTHING",), 5, ["NOTHING", "manifest.json"]),
    ],
)
def test_errors_of_camp_train_are_one_line(call, dataset, tmp_path, words, code, expected):
    given = [dataset if word == "DATA" else word for word in words]
    found, out, err = call(*given)
    assert (found, out) == (code, ""), err
    assert len(beside_the_dataset(err)) == 1
    for word in expected:
        assert word in err
    assert not list(tmp_path.iterdir()), "nothing is written"


def test_a_checkpoint_that_is_no_checkpoint_is_refused(call, dataset, tmp_path):
    assert call(dataset, *TINY, "--steps", 96)[0] == 0
    (about,) = (tmp_path / "runs" / "ppo-0" / "checkpoints").glob("*/checkpoint.json")
    values = json.loads(about.read_text())
    for change, words in (
        ({"format": 99}, "format 99"),
        ({"config": values["config"] | {"network": values["config"]["network"] | {"hidden": 16}}},
         "another agent's weights"),
        ({"method": "camp"}, "another agent's weights"),
        ({"config": {"nothing": 1}}, "nothing"),
        ({"progress": values["progress"] | {"log": "x"}}, "log"),
        ({"progress": values["progress"] | {"critics": {"main": -1}}}, "critics"),
        ({"progress": values["progress"] | {"window": 3}}, "window"),
        ({"progress": values["progress"] | {"parts": [1]}}, "parts[0]"),
        ({"progress": values["progress"] | {"parts": ["all", "single"]}}, "--stages"),
    ):  # fmt: skip
        about.write_text(json.dumps(with_sha256(values | change)))
        code, _, err = call(dataset, "--out", "runs/ppo-0", "--resume")
        assert code == 5, err
        assert words in err


def test_a_resumed_run_may_be_given_more_steps_and_other_workers(call, dataset, tmp_path):
    assert call(dataset, *TINY, "--steps", 96)[0] == 0
    again = (dataset, "--out", "runs/ppo-0", "--resume")
    assert call(*again, *TINY, "--steps", 192, "--set", "run.threads=1")[0] == 0
    rows = (tmp_path / "runs" / "ppo-0" / "log.jsonl").read_text().splitlines()
    assert json.loads(rows[-1])["step"] == 192
    code, _, err = call(*again, "--set", "ppo.gamma=0.5")
    assert code == 2
    assert "run.workers, " in err, "it says what may change"
    for words in ((), ("--steps", 96), ("--steps", 192)):
        code, _, err = call(*again, *words)
        assert (code, "was finished already" in err) == (0, True)


def started(run, dataset, *more):
    """A run in two processes more, in a group of its own, that has made some updates."""
    words = [TRAIN, dataset, *TINY, "--out", run, "--steps", 320_000, "--workers", 2, *more]
    process = subprocess.Popen(
        [str(word) for word in words], stderr=subprocess.PIPE, text=True,
        env=os.environ | {"OMP_NUM_THREADS": "1"}, start_new_session=True,
    )  # fmt: skip
    lines = _rows(run)
    deadline = time.monotonic() + 300
    while _rows(run) < lines + 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    return process, psutil.Process(process.pid).children()


def said(stderr):
    """Lines but those of progress, of which a slow machine has some."""
    return [line for line in beside_the_dataset(stderr) if " steps/s " not in line]


@pytest.mark.parametrize(
    "signum", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.slow)]
)
def test_a_signal_to_the_group_saves_and_a_second_one_leaves_the_last_checkpoint(
    dataset, tmp_path, signum
):
    run = tmp_path / "run"
    for signals, extra in ((1, []), (2, ["--resume"])):
        process, children = started(run, dataset, *extra)
        assert len(children) == 2
        for _ in range(signals):
            os.killpg(process.pid, signum)
        _, err = process.communicate(timeout=300)
        assert process.returncode == 128 + signum, err
        assert psutil.wait_procs(children, 300)[1] == []
        if signals == 1:
            assert said(err) == [f"camp-train: {run}: saved; go on with --resume"]
    done = subprocess.run(
        [str(word) for word in [TRAIN, dataset, "--out", run, "--resume", "--dry-run"]],
        check=False, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 2, "a run is gone on with, not predicted"
    from internav_data.camp.checkpoint import read

    assert read(run).progress["environment_steps"] >= 32


def test_an_environments_process_that_is_killed_ends_the_run_in_one_line(dataset, tmp_path):
    process, children = started(tmp_path / "run", dataset)
    children[-1].kill()
    _, err = process.communicate(timeout=300)
    assert process.returncode == 1
    (line,) = said(err)
    assert "of 2 was killed by SIGKILL; the system may be short of memory" in line
    assert psutil.wait_procs(children, 300)[1] == []


@pytest.mark.parametrize("more", [(), ("--resume",)])
def test_two_runs_in_one_folder_are_refused_and_the_first_is_named(call, dataset, tmp_path, more):
    from internav_data.core.storage import FolderStore

    run = tmp_path / "run"
    with FolderStore(run).lock("busy"):
        code, _, err = call(dataset, *TINY, "--steps", 32, "--out", run, *more)
    assert code == 1
    (line,) = beside_the_dataset(err)
    assert "another camp-train trains this run; wait for it to end" in line
    assert f"held by process {os.getpid()} on " in line
    assert list(run.iterdir()) == []
    code, _, err = call(dataset, *TINY, "--out", tmp_path / "new", "--filter", "room_count=9")
    assert code == 2
    assert not (tmp_path / "new").exists(), "nothing came of it, and nothing is left"


def _rows(run):
    log = run / "log.jsonl"
    return log.read_bytes().count(b"\n") if log.exists() else 0
