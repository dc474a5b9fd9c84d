"""Scenes made by a Ray cluster of two nodes, all of it on this machine: the bytes of processes."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("ray", reason="ray is not installed (make test-ray)")

import ray
from ray.cluster_utils import Cluster
from scene_stubs import CATALOGUE, InProcess, stub

from internav_data.core.messages import Fatal, Recipe
from internav_data.dataset import has_manifest, read_manifest
from internav_data.generation import ray_driver, ray_executor
from internav_data.generation.config import load_config
from internav_data.generation.executors import get_executor
from internav_data.generation.progress import GenerationProgress
from internav_data.generation.ray_executor import RayOrder
from internav_data.generation.run import generate
from internav_data.records.errors import UsageError

CONFIG = load_config(overrides=["episodes_per_scene=3"])
NODE = {"num_cpus": 1, "node_ip_address": "127.0.0.1", "object_store_memory": 80 << 20}
SCENES = 14
LINGERING = [6, 7]
"""Scenes in the middle of which a node is lost."""
RUN_STUB = Path(__file__).with_name("run_stub.py")


@pytest.fixture(scope="module")
def cluster():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        patch.setenv("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")  # nothing but 127.0.0.1 is bound
        patch.setattr(ray._private.ray_constants, "ENABLE_RAY_CLUSTER", False)  # noqa: SLF001 - of import time
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
        started = Cluster(initialize_head=True, head_node_args=NODE | {"include_dashboard": False})
        yield started
        started.shutdown()


def made(folder, executor, *, address=None, progress=None, **orders):
    folder.mkdir()
    (folder / "stub.json").write_text(json.dumps(orders))
    out = folder / "d"
    report = generate(
        *(out, CONFIG, SCENES, 0, progress, CATALOGUE, executor, stub), ray_address=address
    )
    return report, content(out)


def content(out):
    files = sorted(path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    return made(tmp_path_factory.mktemp("expected") / "x", InProcess(), quarantine=[5])[1]


class LoseNode(GenerationProgress):
    """Kills a node once each of the two is in the middle of a scene."""

    def __init__(self, cluster, node, folder):
        super().__init__()
        self.cluster, self.node, self.folder = cluster, node, folder

    def tick(self):
        pids = [path.read_text() for path in self.folder.glob("lingers *")]
        if self.node and all(pids) and len(pids) == len(LINGERING):
            self.cluster.remove_node(self.node, allow_graceful=False)
            self.node, deadline = None, time.monotonic() + 60.0
            # The node's process notices a moment later, and might end its scene until then.
            while all(map(lives, pids)) and time.monotonic() < deadline:
                time.sleep(0.05)
            (self.folder / "go").touch()


def lives(pid):
    try:
        return Path("/proc", pid, "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_node_is_lost_and_a_worker_dies_and_the_bytes_are_those_of_processes(
    cluster, expected, tmp_path
):
    # At another address than the head: the run's process joins a node at its own.
    node = cluster.add_node(**NODE | {"node_ip_address": "127.0.0.2"})
    cluster.wait_for_nodes()
    orders = {"quarantine": [5], "kill_once": [9], "linger": LINGERING}
    folder = tmp_path / "ray"
    lose = LoseNode(cluster, node, folder)
    report, found = made(folder, "ray", address=cluster.address, progress=lose, **orders)
    assert found == expected
    assert report.quarantined == (("scene-000005", "nothing can be blocked"),)
    begun = Counter((folder / "journal").read_text().split())
    assert set(begun) == {str(scene) for scene in range(SCENES)}
    assert begun["9"] > 1, "its worker died"
    assert begun["6"] + begun["7"] > 2, "the node of one was lost"


def test_ctrl_c_ends_it_in_order_and_the_same_command_goes_on(cluster, expected, tmp_path):
    (tmp_path / "stub.json").write_text(json.dumps({"quarantine": [5], "seconds": 0.3}))
    out, journal = tmp_path / "d", tmp_path / "journal"
    words = [sys.executable, str(RUN_STUB), str(out), str(SCENES), "0"]
    run = subprocess.Popen([*words, cluster.address], start_new_session=True)
    deadline = time.monotonic() + 120
    while not (journal.exists() and len(journal.read_text().split()) > 3):
        assert run.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.05)
    began = time.monotonic()
    os.killpg(run.pid, signal.SIGINT)  # as a terminal does
    assert run.wait(60) == 128 + signal.SIGINT
    assert time.monotonic() - began < 30
    kept = {int(path.stem.removeprefix("scene-")) for path in out.rglob("scene-*.work")}
    kept.update(read_manifest(out).scene_numbers if has_manifest(out) else ())
    assert kept
    before = Counter(journal.read_text().split())
    assert subprocess.run([*words[:-1], "1"], check=False).returncode == 0
    again = Counter(journal.read_text().split()) - before
    assert set(map(int, again)) == set(range(SCENES)) - kept, "what is finished is kept"
    assert content(out) == expected


def test_a_worker_that_dies_again_and_again_costs_its_scene(cluster, tmp_path):
    report, _ = made(tmp_path / "ray", "ray", address=cluster.address, kill_always=[2])
    assert report.quarantined == (("scene-000002", "its worker died, 3 times"),)
    assert report.died == 1


@pytest.fixture
def messages(cluster):
    """Do what the process of a run does, in this process, for an order of one scene."""

    def asked(**payload):
        ours, theirs = Pipe()
        values = {"config": CONFIG, "staging": None} | payload
        ours.send(cluster.address)
        ours.send(RayOrder(Recipe(stub, SimpleNamespace(**values)), (0,), 1))
        ray_driver.serve_cluster(theirs)
        theirs.close()
        assert ours.recv() == 1, "core"
        return ours.recv()[0]

    yield asked
    ray.shutdown()


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("__version__", "9.9", r"internav-data is 0\.1\.0 there and 9\.9 here"),
        ("source_digest", lambda: "abc", "the code of internav-data is .* there and abc here"),
        ("_version", lambda _: "0.1", r"engine \w+ is [\d.]+ there and 0\.1 here"),
    ],
)
def test_nodes_with_other_versions_are_refused_before_the_first_scene(
    messages, monkeypatch, name, value, message
):
    monkeypatch.setattr(ray_driver, name, value)
    if name == "_version":
        monkeypatch.setattr(ray_driver, "_LIBRARIES", ())
    found = messages()
    assert found.kind is UsageError
    assert re.match(
        rf"Ray's node 127\.0\.0\.1: {message}, so its scenes may differ: ", found.reason
    )


def test_a_node_that_comes_later_with_another_version_makes_no_scene(messages, monkeypatch):
    monkeypatch.setattr(ray_driver, "_unfit_node", lambda _: None)
    monkeypatch.setattr(ray_driver, "__version__", "9.9")
    found = messages()
    assert isinstance(found, Fatal)
    assert "internav-data is 0.1.0 there and 9.9 here" in found.reason


def test_where_no_cluster_runs_the_line_says_how_to_start_one(monkeypatch):
    def nobody(*_, **__):
        raise ConnectionError("Could not find any running Ray instance.")

    monkeypatch.setattr(ray, "init", nobody)
    found = ray_driver._connected("auto")  # noqa: SLF001
    assert found.reason.startswith("no Ray cluster runs on this machine: start one with `ray start")
    assert ray_driver._connected("a:1").reason.startswith("the Ray cluster at a:1: Could not")  # noqa: SLF001


def test_the_example_of_a_cluster_file_is_one():
    yaml = pytest.importorskip("yaml")
    jsonschema = pytest.importorskip("jsonschema")
    schema = Path(ray.__file__).with_name("autoscaler") / "ray-schema.json"
    example = Path(__file__).parents[2] / "examples" / "ray_cluster.yaml"
    jsonschema.validate(yaml.safe_load(example.read_text()), json.loads(schema.read_text()))


def test_a_cluster_that_does_not_answer_is_one_line(monkeypatch):
    monkeypatch.setattr(ray_executor, "CONNECT_S", 3.0)
    with pytest.raises(UsageError, match=r"the Ray cluster at 127\.0\.0\.1:1: no answer") as found:
        get_executor("ray", 1, "127.0.0.1:1")
    assert "\n" not in str(found.value)
