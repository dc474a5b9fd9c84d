"""`camp-eval` from the outside: exit codes, one line for what goes wrong, nothing overwritten."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from internav_cli.camp_eval import main
from stderr_lines import beside_the_dataset

from internav_data import load_dataset
from internav_data.core import progress
from internav_data.physics import engines

EVAL = Path(sys.executable).with_name("camp-eval")


@pytest.fixture
def dataset(three_houses):
    return three_houses


@pytest.fixture
def call(calling):
    return calling(main)


def test_reference_policies_are_measured_and_compared(call, dataset, tmp_path):
    code, out, err = call("expert,shortest_path,random", dataset, "--split", "val", "--out", "a")
    assert code == 0, err
    assert "| expert | 100.0 |" in out
    assert "No episode is N >= 4 rooms: n = 0." in out
    names = ["expert", "random", "report.html", "shortest_path", "tables.json", "tables.md"]
    assert sorted(p.name for p in (tmp_path / "a").iterdir()) == names
    assert (tmp_path / "a" / "tables.md").read_text().strip() == out.strip()
    code, out, err = call("compare", "a", "--json")
    assert code == 0, err
    rows = json.loads(out)["tables"][0]["rows"]
    measured = [row["name"] for row in rows if row["source"] == "reference"]
    assert sorted(measured) == ["expert", "random", "shortest_path"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a"], "compare writes into --out alone"
    code, out, err = call("compare", "a", "--dataset", dataset, "--out", "b")
    assert code == 0, err
    assert "<figure" in (tmp_path / "b" / "report.html").read_text()


def test_nothing_is_overwritten_without_force(call, dataset, tmp_path):
    words = ("random", dataset, "--split", "val", "--max-steps", 5)
    assert call(*words)[0] == 0
    before = (tmp_path / "evaluation-val" / "tables.json").read_bytes()
    code, out, err = call(*words, "--seed", 3)
    assert (code, out) == (2, "")
    assert "--force" in err
    assert (tmp_path / "evaluation-val" / "tables.json").read_bytes() == before
    assert call("shortest_path", dataset, "--split", "val", "--force")[0] == 0
    kept = [p.parent.name for p in (tmp_path / "evaluation-val").glob("*/evaluation.json")]
    assert kept == ["shortest_path"], "what was there before is no part of what is there now"


@pytest.mark.parametrize("words", [("evaluate", "random", "DATA"), ("compare", "a")])
def test_two_commands_in_one_folder_are_refused_and_the_first_is_named(
    call, dataset, tmp_path, words
):
    from internav_data.core.storage import FolderStore

    with FolderStore(tmp_path / "out").lock("busy"):
        given = [dataset if word == "DATA" else word for word in words]
        code, _, err = call(*given, "--out", tmp_path / "out")
    assert code == 1
    assert f"held by process {os.getpid()} on " in beside_the_dataset(err)[-1]
    assert call("random", dataset, "--split", "none-such", "--out", tmp_path / "new")[0] == 2
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    "signum", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)]
)
def test_a_signal_to_the_group_ends_it_in_one_line_with_all_its_processes(
    dataset, tmp_path, signum
):
    words = [EVAL, "random", dataset, "--split", "all", "--workers", "2", "--out", tmp_path / "out"]
    process = subprocess.Popen(words, stderr=subprocess.PIPE, text=True, start_new_session=True)
    children, deadline = [], time.monotonic() + 300
    while len(children) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
        children = psutil.Process(process.pid).children()
    os.killpg(process.pid, signum)
    _, err = process.communicate(timeout=300)
    assert process.returncode == 128 + signum, err
    assert [line for line in beside_the_dataset(err) if line] == ["camp-eval: interrupted"]
    assert psutil.wait_procs(children, 300)[1] == []
    assert not (tmp_path / "out").exists()


def test_a_log_says_how_far_an_evaluation_is(call, dataset, monkeypatch):
    monkeypatch.setattr(progress, "LOG_EVERY_S", 0.0)
    code, _, err = call("random", dataset, "--split", "all", "--out", "out", "--max-steps", 20)
    assert code == 0, err
    counts = re.findall(
        r"random: (\d+)/(\d+) episodes \(\d+%\), [\d.]+ episodes/s, \d+ s left", err
    )
    done = [int(number) for number, _ in counts]
    assert done
    assert done == sorted(done)
    assert {total for _, total in counts} == {str(len(load_dataset(dataset)))}


def test_the_same_call_gives_the_same_files(call, dataset, tmp_path):
    for out, batch in (("a", 1), ("b", 7)):
        words = ("random,shortest_path", dataset, "--split", "val", "--out", out, "--batch", batch)
        assert call(*words)[0] == 0
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*.*"))
    assert len(files) == 7
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes(), file


def test_episodes_can_be_chosen(call, dataset, tmp_path):
    def count(*words):
        code, out, err = call(
            "shortest_path", dataset, "--split", "val", "--json", "--force", *words
        )
        assert code == 0, err
        return json.loads(out)["tables"][0]["episodes"]

    assert count()["all"] == 4
    assert count("--limit", 3)["all"] == 3
    assert count("--episodes-per-scene", 2) == {
        "all": 2, "N >= 4 rooms": 0, "non-interactive": 1, "blocked": 1,
    }  # fmt: skip
    assert count("--filter", "mode=blocked", "--filter", "room_count<=3")["non-interactive"] == 0


@pytest.mark.parametrize(
    ("words", "code", "expected"),
    [
        (("best", "DATA"), 2, ["best", "expert, blind, shortest_path, random"]),
        (("random,best", "DATA"), 2, ["random,best"]),
        (("random", "nowhere"), 5, ["nowhere"]),
        (("random", "DATA", "--split", "dev"), 2, ["--split"]),
        (("random", "DATA", "--filter", "room_count>7"), 2, ["room_count", "stats"]),
        (("random", "DATA", "--filter", "rooms=1"), 2, ["rooms"]),
        (("random", "DATA", "--filter", "rooms"), 2, ["COLUMN=VALUE"]),
        (("random", "DATA", "--limit", "0"), 2, ["1 or more"]),
        (("random", "DATA", "--batch", "0"), 2, ["batch"]),
        (("random", "DATA", "--max-steps", "-1"), 2, ["max_steps"]),
        (("random", "DATA", "--seed", "-1"), 2, ["seed"]),
        (("random", "DATA", "--unknown"), 2, ["--unknown"]),
        (("random",), 5, ["internav-dataset", "internav-gen generate"]),
        (("compare",), 2, ["RUNS"]),
        (("compare", "nowhere"), 2, ["nowhere", "camp-eval RUN DATASET"]),
        (("DATA", "DATA"), None, ["data"]),
    ],
)
def test_errors_of_camp_eval_are_one_line(call, dataset, tmp_path, words, code, expected):
    got, out, err = call(*[dataset if word == "DATA" else word for word in words])
    assert got == code or (code is None and got in {2, 5})
    assert out == ""
    (line,) = beside_the_dataset(err)
    assert line.startswith("camp-eval: ")
    for word in expected:
        assert word in line
    assert not list(tmp_path.iterdir()), "nothing is written"


def test_evaluations_of_other_episodes_are_not_compared(call, dataset):
    assert call("random", dataset, "--split", "val", "--out", "a")[0] == 0
    assert call("shortest_path", dataset, "--split", "test", "--out", "b")[0] == 0
    code, out, err = call("compare", "a", "b")
    assert (code, out) == (2, "")
    assert "dataset" in err or "split" in err
    code, _, err = call("compare", "a", "--dataset", dataset.parent / "none")
    assert code == 5


def test_damaged_evaluations_exit_with_5(call, dataset, tmp_path):
    assert call("random", dataset, "--split", "val", "--out", "a")[0] == 0
    path = tmp_path / "a" / "random" / "episodes.parquet"
    path.write_bytes(path.read_bytes()[:100])
    code, out, err = call("compare", "a")
    assert (code, out) == (5, "")
    assert len(err.strip().splitlines()) == 1


def test_a_dataset_without_experts_says_so(call, tmp_path_factory, dataset):
    from dataclasses import replace

    from internav_data.dataset import Identity, assemble, load_dataset, open_staging, stage_scene

    whole = load_dataset(dataset)
    out = tmp_path_factory.mktemp("bare") / "data"
    identity = Identity("test", "1", 0, 4, "0", {"physics": {"engine": engines.DEFAULT_ENGINE}})
    for scene in range(3):
        scene_id = f"scene-{scene:06d}"
        episodes = [replace(e, expert=None) for e in whole if e.scene_id == scene_id]
        stage_scene(open_staging(out, identity), scene, whole.scene(scene_id), episodes)
    assemble(out, identity, tuple(whole.assets.values()), 3)
    code, text, err = call("expert", out, "--split", "val")
    assert (code, text) == (2, "")
    (line,) = beside_the_dataset(err)
    assert "no episode has an expert" in line
    assert call("shortest_path", out, "--split", "val")[0] == 0


def test_help_is_fast_and_has_examples():
    for words in ((), ("evaluate",), ("compare",)):
        done = subprocess.run(
            [EVAL, *words, "--help"], capture_output=True, text=True, check=False, timeout=300
        )
        assert done.returncode == 0
        assert "Examples:" in done.stdout
    heavy = "import sys, internav_cli.camp_eval as c; c.cli.commands; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", heavy], capture_output=True, text=True, check=True)
    assert not {"numpy", "torch", "numba", "cv2", "pyarrow"} & set(done.stdout.split())


def test_commands_in_the_docs_exist_with_their_options(capsys):
    """`internav-gen`'s are held by tests/test_docs.py."""
    import re

    from internav_cli.camp_eval import cli

    root = Path(__file__).resolve().parents[2]
    pages = [root / "README.md", *sorted((root / "docs").glob("*.md"))]
    lines = [
        line
        for page in pages
        for line in re.findall(r"^camp-eval .*$", page.read_text(), re.MULTILINE)
    ]
    assert len(lines) > 4
    for line in lines:
        words = line.split("#")[0].split()[1:]
        command = cli.commands["compare" if words[0] == "compare" else "evaluate"]
        known = {name for parameter in command.params for name in parameter.opts}
        assert {word for word in words if word.startswith("--")} <= known, line
