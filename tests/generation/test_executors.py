"""Executors: who runs the scenes changes no byte of the dataset."""

from __future__ import annotations

import json
import sys

import pytest
import worker_stubs
from scene_stubs import CATALOGUE, InProcess, stub

from internav_data.core.machine import available_cores
from internav_data.core.messages import Done, Recipe
from internav_data.generation.config import load_config
from internav_data.generation.executors import (
    EXECUTORS,
    Executor,
    ProcessExecutor,
    get_executor,
)
from internav_data.generation.ray_executor import RayExecutor
from internav_data.generation.run import generate
from internav_data.records.errors import InternavError, QuarantineError, UsageError

CONFIG = load_config(overrides=["episodes_per_scene=3"])


def made(out, executor, scenes=12, **orders):
    out.parent.mkdir(parents=True, exist_ok=True)
    (out.parent / "stub.json").write_text(json.dumps(orders))
    report = generate(out, CONFIG, scenes, assets=CATALOGUE, executor=executor, setup=stub)
    files = sorted(path for path in out.rglob("*") if path.is_file())
    return report, {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


def test_another_executor_makes_the_same_bytes(tmp_path):
    one, local = made(tmp_path / "a" / "d", "processes", quarantine=[5])
    two, here = made(tmp_path / "b" / "d", InProcess(), quarantine=[5])
    assert here == local
    assert one.quarantined == two.quarantined == (("scene-000005", "nothing can be blocked"),)


def test_an_executor_is_closed_when_the_run_fails(tmp_path):
    executor = InProcess()
    with pytest.raises(QuarantineError, match="none of 20 scenes could be made"):
        made(tmp_path / "d", executor, scenes=100, hopeless=True)
    assert executor.closed


def test_an_error_that_ends_the_run_is_the_callers(tmp_path):
    with pytest.raises(InternavError, match="No space left on device"):
        made(tmp_path / "d", InProcess(), full=3)


def test_executors_are_chosen_by_name():
    executor = get_executor("processes", 3)
    assert isinstance(executor, Executor)
    assert executor == ProcessExecutor(3)
    assert executor.slots == 3
    assert get_executor("processes").slots == available_cores()
    assert isinstance(RayExecutor("auto", 2), Executor)
    with pytest.raises(UsageError, match=r"executor is 'cluster': expected one of processes, ray"):
        get_executor("cluster")
    with pytest.raises(UsageError, match=r"workers is -1: ask for 1 or more"):
        get_executor("processes", -1)


def test_a_cluster_is_refused_before_anything_is_written(tmp_path, monkeypatch):
    with pytest.raises(UsageError, match="--ray-address a:1: is for --executor ray"):
        generate(tmp_path / "d", CONFIG, 2, assets=CATALOGUE, setup=stub, ray_address="a:1")
    monkeypatch.setattr("internav_data.generation.ray_executor.require", lambda _: None)
    for wrong in ("ray://head:10001", "local", "head", "head:x"):
        with pytest.raises(UsageError, match=r"expected host:port of a cluster's head, or auto"):
            get_executor("ray", 1, wrong)
    monkeypatch.undo()
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'internav-data\[ray\]'"):
        generate(tmp_path / "d", CONFIG, 2, assets=CATALOGUE, executor="ray", setup=stub)
    assert list(tmp_path.iterdir()) == []


def test_local_workers_end_once_tick_says_so():
    seen = []
    results = ProcessExecutor(2).run(Recipe(worker_stubs.slow, 0.2), range(1000), lambda: not seen)
    for result in results:
        assert isinstance(result, Done)
        seen.append(result.task)
    assert 1 <= len(seen) <= 4


def test_the_command_offers_every_executor():
    from internav_cli.generate import command

    (option,) = (option for option in command.params if option.name == "executor")
    assert set(option.type.choices) == set(EXECUTORS)
