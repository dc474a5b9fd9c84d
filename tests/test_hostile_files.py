"""Readers of small files against hostile ones: a value, or an error for users."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import signal
from dataclasses import asdict
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from internav_data.camp import checkpoint
from internav_data.camp.config import config_of, preset
from internav_data.catalog.user_manifest import read_notes
from internav_data.core.config import config_toml
from internav_data.core.files import with_sha256
from internav_data.dataset import load_dataset
from internav_data.dataset.commit import identity_of, open_staging
from internav_data.dataset.encode import to_table
from internav_data.dataset.manifest import read_manifest
from internav_data.dataset.parquet import parquet_bytes
from internav_data.envs.slot import EpisodeSnapshot
from internav_data.evaluation.archive import read_evaluation
from internav_data.evaluation.metrics import RESULTS
from internav_data.generation import GenerationConfig, load_config
from internav_data.houses.plan_file import load_floor_plan
from internav_data.records.errors import InternavError
from internav_data.verification import validate
from internav_data.views import read_actions

ROOT = Path(__file__).parents[1]
DATASET = ROOT / "tests" / "data" / "dataset-10"
AGENT = ROOT / "examples" / "camp-small"
PLAN = {
    "rooms": [{"type": "living", "polygon": [[0, 0], [4, 0], [4, 3], [0, 3]]}],
    "doors": [{"between": ["outside", "living"], "at": [0.0, 1.5]}],
    "windows": [{"room": "living", "at": [2.0, 0.0]}],
    "ceiling_m": 2.6,
}
NO_RESULTS = parquet_bytes(to_table([], RESULTS), RESULTS)
EVALUATION = {
    "format": 3,
    "episodes": 0,
    "table_bytes": len(NO_RESULTS),
    "table_sha256": hashlib.sha256(NO_RESULTS).hexdigest(),
    "name": "camp",
    "method": "camp",
    "dataset": "d",
    "split": "val",
    "seed": 0,
    "max_steps": 500,
    "greedy": False,
    "is_reference": False,
    "intent": "integrated",
    "sync_every": 3,
    "without_intent": False,
    "training_seed": 1,
    "environment_steps": None,
    "cloned_frames": None,
    "parameters": 5,
    "training_s": 1.5,
}
HOSTILE = [
    None,
    True,
    0,
    -1,
    2**63,
    2**64 - 1,
    0.5,
    1e308,
    -1e308,
    float("nan"),
    float("inf"),
    "",
    "a|b\n`c`<b>",
    "../../etc/passwd",
    "/dev/zero",
    "\0",
    "\ud800",
    "x" * 100_000,
    [],
    {},
    [[[]]],
    [1e308, 1e308],
    {"a": {"b": []}},
    [None] * 1000,
]


TOML = [
    "1",
    "-1",
    "true",
    "nan",
    "-inf",
    "1e308",
    "9" * 30,
    "9" * 5000,
    "0x" + "f" * 5000,
    "'a|b`<b>'",
    "'" + "x" * 10_000 + "'",
    "'/dev/zero'",
    '"\\u0000"',
    "[]",
    "{}",
    "[[[]]]",
    "[1, 'a']",
    "[" * 500 + "]" * 500,
    "{a = {b = 1}}",
    "1979-05-27",
    "07:32:00",
    "",
]


def _manifest(path):
    validate(path.parent, "schema")
    load_dataset(path.parent)


def _checkpoint(path):
    found = checkpoint.read(path.parent)
    checkpoint.TrainState.from_progress(found.progress)
    checkpoint.snapshots_of(found.progress, range(1))


def _resumable():
    """Return a real checkpoint's JSON with what a run resumes from."""
    values = json.loads((AGENT / "checkpoint.json").read_text())
    snapshot = EpisodeSnapshot("scene-000001/0000", (0, 11), 0, 1, (3, 4, 0))
    counters = {**asdict(checkpoint.TrainState()), **values["progress"]}
    progress = {**counters, "environments": [asdict(snapshot)], "window": [{}], "log": 0}
    return with_sha256(values | {"progress": progress})


def _evaluation(path):
    path.with_name("episodes.parquet").write_bytes(NO_RESULTS)
    read_evaluation(path.parent)


def _pointers(path):
    checkpoint.find(path.parent)
    checkpoint.best_score(path.parent)


def _identity(path):
    open_staging(path.parents[1], identity_of(read_manifest(DATASET)))


JSON = {
    "plan.json": (load_floor_plan, PLAN),
    "actions.json": (read_actions, {"episode_id": "e", "actions": ["MoveAhead", 11]}),
    "manifest.json": (_manifest, json.loads((DATASET / "manifest.json").read_text())),
    "checkpoint.json": (_checkpoint, _resumable()),
    "checkpoints.json": (
        _pointers,
        with_sha256({"last": "3", "best": "2", "serial": 3, "best_score": 0.5}),
    ),
    "evaluation.json": (_evaluation, EVALUATION),
    ".work/identity.json": (_identity, asdict(identity_of(read_manifest(DATASET)))),
}
NOTES = '["a.obj"]\ntype = "A"\nmass_kg = 2\nfriction = 0.5\nup = "z"\nmax_parts = 3\nscale = 1'
TOMLS = {
    "config.toml": (lambda path: load_config(path).check(), config_toml(GenerationConfig())),
    "train.toml": (lambda path: config_of("small", path), config_toml(preset("small"))),
    "assets.toml": (lambda path: read_notes(path.parent, ("a.obj",)), NOTES),
    "plan.toml": (load_floor_plan, (ROOT / "examples" / "floor_plan.toml").read_text()),
}
READERS = {name: reader for name, (reader, _) in (JSON | TOMLS).items()}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Return where a reader's file goes: a folder with what stands beside it."""
    root = tmp_path_factory.mktemp("hostile")
    beside = {"manifest.json": DATASET, "checkpoint.json": AGENT}

    def of(name):
        folder = root / name.replace("/", "-")
        if name in beside and not folder.exists():
            shutil.copytree(beside[name], folder)
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    return of


def _read(name, path):
    """Read a file; return the text of its error for users, None without one."""
    try:
        READERS[name](path)
    except (InternavError, OSError) as error:
        return str(error)
    return None


def _changed(value, path, new):
    """Return a JSON value with what stands at a path replaced."""
    if not path:
        return new
    copy = list(value) if isinstance(value, list) else dict(value)
    copy[path[0]] = _changed(value[path[0]], path[1:], new)
    return copy


def _text(value, path, new):
    """Return JSON with what stands at a path replaced; where it has a digest, that fits."""
    changed = _changed(value, path, new)
    try:
        fits = isinstance(changed, dict) and "sha256" in value and path != ("sha256",)
        return json.dumps(with_sha256(changed) if fits else changed)
    except ValueError:  # NaN and infinity, which no writer writes
        return json.dumps(changed)


def _paths(value, path=()):
    """Yield the paths to all values inside a JSON value, itself included."""
    yield path
    if isinstance(value, dict | list):
        for key in value if isinstance(value, dict) else range(len(value)):
            yield from _paths(value[key], (*path, key))


@pytest.fixture
def limited_time():
    """Fail after a minute, which whoever waits for a pipe would take."""
    before = signal.signal(signal.SIGALRM, lambda *_: pytest.fail("it waits"))
    signal.alarm(60)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize("name", READERS)
def test_a_valid_file_is_read_by_every_reader(place, name):
    path, valid = place(name), (JSON | TOMLS)[name][1]
    path.write_text(valid if isinstance(valid, str) else json.dumps(valid))
    READERS[name](path)


@pytest.mark.usefixtures("limited_time")
@pytest.mark.parametrize("name", READERS)
def test_what_is_no_small_file_is_refused_by_every_reader(tmp_path, place, name):
    path = place(name)
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    assert _read(name, path) is not None
    path.unlink()
    path.symlink_to("/dev/zero")
    assert _read(name, path) is not None
    path.unlink()
    with path.open("wb") as file:
        file.truncate(1 << 40)
    assert "too large" in _read(name, path)
    for content in (b"[" * 100_000, b"\xff\xfe", b'{"a": 1, "a": 1}', b"9" * 5000):
        path.write_bytes(content)
        assert _read(name, path) is not None


@pytest.mark.parametrize("name", JSON)
@settings(max_examples=6)
@given(data=st.data())
def test_any_value_in_any_place_of_json_is_read_or_refused(place, name, data):
    path, valid = place(name), JSON[name][1]
    where = data.draw(st.sampled_from(list(_paths(valid))))
    path.write_text(_text(valid, where, data.draw(st.sampled_from(HOSTILE))))
    _read(name, path)


@pytest.mark.parametrize("name", TOMLS)
@settings(max_examples=6)
@given(data=st.data())
def test_any_value_in_any_line_of_toml_is_read_or_refused(place, name, data):
    path, lines = place(name), TOMLS[name][1].splitlines()
    k = data.draw(st.sampled_from([k for k, line in enumerate(lines) if " = " in line]))
    lines[k] = lines[k].split(" = ")[0] + " = " + data.draw(st.sampled_from(TOML))
    path.write_text("\n".join(lines))
    _read(name, path)


@pytest.mark.slow
@pytest.mark.parametrize("name", JSON)
def test_every_hostile_value_in_every_place_of_json(place, name):
    path, valid = place(name), JSON[name][1]
    for where in _paths(valid):
        for value in HOSTILE:
            path.write_text(_text(valid, where, value))
            _read(name, path)


@pytest.mark.slow
@pytest.mark.parametrize("name", TOMLS)
def test_every_hostile_value_in_every_line_of_toml(place, name):
    path, lines = place(name), TOMLS[name][1].splitlines()
    for k, line in enumerate(lines):
        for value in TOML if " = " in line else ():
            changed = [*lines[:k], f"{line.split(' = ')[0]} = {value}", *lines[k + 1 :]]
            path.write_text("\n".join(changed))
            _read(name, path)
