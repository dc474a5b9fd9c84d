"""`validate --workers`: signals, deaths and orphans, in real processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from checker_stubs import STARTED
from scenery import small_scenes, write_dataset

from internav_data.dataset import read_manifest
from internav_data.records.errors import InternavError
from internav_data.verification import levels
from internav_data.verification.findings import FindingCollector

LIMIT_S = 120.0
SCRIPT = """
import sys
sys.path.insert(0, {here!r})
import checker_stubs
from internav_data.verification import levels
from internav_cli.main import main
levels.SCENES_A_UNIT = 1
levels._unit_checker = checker_stubs.{stub}
main(["validate", sys.argv[1], "--workers", "2"])
"""


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    folder = tmp_path_factory.mktemp("good") / "ds"
    write_dataset(folder, small_scenes())
    return folder


def started(dataset, stub, tmp_path):
    script = SCRIPT.format(here=str(Path(__file__).parent), stub=stub)
    return subprocess.Popen(
        [sys.executable, "-c", script, str(dataset)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {STARTED: str(tmp_path)},
        start_new_session=True,
    )


def workers_of(process, tmp_path):
    """Wait until both workers are at work; return them."""
    deadline = time.monotonic() + LIMIT_S
    while len(list(tmp_path.iterdir())) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    workers = psutil.Process(process.pid).children()
    assert len(workers) == 2
    return workers


def lines_of(error):
    lines = error.splitlines()
    return [line for line in lines if line and not line.startswith("dataset: ")]


@pytest.mark.parametrize(
    ("to", "signum", "code"),
    [
        (os.kill, signal.SIGINT, 130),
        (os.killpg, signal.SIGINT, 130),
        (os.killpg, signal.SIGTERM, 143),
        (os.kill, signal.SIGKILL, -9),
    ],
)
def test_a_signal_ends_validation_in_one_line_and_its_workers(good, tmp_path, to, signum, code):
    process = started(good, "hanging", tmp_path)
    workers = workers_of(process, tmp_path)
    to(process.pid, signum)
    _, error = process.communicate(timeout=LIMIT_S)
    assert process.returncode == code
    said = [] if signum == signal.SIGKILL else ["internav-gen: interrupted"]
    assert lines_of(error) == said
    assert psutil.wait_procs(workers, LIMIT_S)[1] == []


@pytest.mark.parametrize("sample", [None, 2])
def test_what_nobody_looked_at_is_not_called_valid(good, monkeypatch, sample):
    monkeypatch.setattr(levels, "SCENES_A_UNIT", 1)
    assert levels.validate(good, sample=sample).ok
    monkeypatch.setattr(levels, "check_unit", lambda _: FindingCollector())
    with pytest.raises(InternavError, match=f"0 of {sample or 3} scenes were checked"):
        levels.validate(good, sample=sample)


@pytest.mark.parametrize("missing", ["files", "episodes", "replayed"])
def test_whatever_was_left_out_is_noticed(good, monkeypatch, missing):
    counts = read_manifest(good).counts.values()
    episodes = sum(count.episodes for count in counts)
    report = FindingCollector()
    report.counts.update(scenes=3, episodes=episodes, replayed=episodes)
    monkeypatch.setattr(levels, "check_unit", lambda _: report)
    assert levels.validate(good, "physics").ok
    del report.counts[missing]
    if missing == "files":
        monkeypatch.setattr(levels, "check_file", lambda *_: FindingCollector())
    with pytest.raises(InternavError, match=rf"\d of \d+ {missing} were checked"):
        levels.validate(good, "physics")


def test_scenes_whose_workers_are_killed_again_and_again_are_named(good, tmp_path):
    process = started(good, "dying", tmp_path)
    _, error = process.communicate(timeout=LIMIT_S)
    (line,) = lines_of(error)
    assert process.returncode == 1
    assert "could not be checked: its worker was killed by SIGKILL" in line
    assert "scene-00000" in line
