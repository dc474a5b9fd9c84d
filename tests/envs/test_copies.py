"""Copies, pickles and records of environments: each lives alone, wherever it is made again."""

from __future__ import annotations

import copy
import os
import pickle
import subprocess
import sys

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence

from internav_data.dataset import load_dataset
from internav_data.envs import InterNavProcesses, InterNavVectorEnv
from internav_data.records.errors import UsageError

WAY = (1, 0, 3, 1, 0, 0, 2, 0, 5, 9, 1, 10, 0)


def made(kind, dataset, **arguments):
    if kind == "single":
        return gymnasium.make("InterNav-v0", dataset=dataset, image_size=16, **arguments)
    return InterNavVectorEnv(2, dataset, 16, **arguments)


def played(env, way=WAY):
    count = getattr(env, "num_envs", None)
    return [env.step(action if count is None else [action] * count) for action in way]


@pytest.mark.parametrize("when", ["new", "reset", "stepped"])
@pytest.mark.parametrize("kind", ["single", "vector"])
@pytest.mark.parametrize("way", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])  # noqa: S301 - ours
def test_a_copy_goes_on_as_the_original_and_alone(small, kind, when, way):
    env = made(kind, small)
    if when != "new":
        env.reset(seed=4)
    if when == "stepped":
        played(env, (0, 1, 1))
    other = way(env)
    if when == "new":
        env.reset(seed=4)
        other.reset(seed=4)
    first = played(env)
    assert data_equivalence(first, played(other), exact=True)
    depths = [step[0]["depth"].tobytes() for step in first]
    assert len(set(depths)) > 2, "it moved"
    again = played(way(other), (0,))
    assert data_equivalence(again, played(other, (0,)), exact=True)


def test_an_environment_is_unpickled_in_another_process(small, tmp_path):
    env = made("single", small)
    env.reset(seed=4)
    played(env, (0, 1))
    (tmp_path / "env").write_bytes(pickle.dumps(env))
    script = (
        "import pickle, sys; sys.path.insert(0, sys.argv[2]); from test_copies import played\n"
        "env = pickle.load(open(sys.argv[1] + '/env', 'rb'))\n"
        "pickle.dump(played(env), open(sys.argv[1] + '/steps', 'wb'))"
    )
    words = [sys.executable, "-c", script, str(tmp_path), os.path.dirname(__file__)]  # noqa: PTH120
    subprocess.run(words, check=True, cwd=os.getcwd())  # noqa: PTH109 - where the package is
    steps = pickle.loads((tmp_path / "steps").read_bytes())  # noqa: S301 - ours
    assert data_equivalence(steps, played(env), exact=True)


def test_environments_in_processes_say_how_to_copy_them(small):
    env = InterNavProcesses(1, small, 1, 16)
    try:
        with pytest.raises(UsageError, match="restore"):
            copy.deepcopy(env)
    finally:
        env.close()


def test_a_split_and_filters_choose_among_a_loaded_dataset(small):
    every = load_dataset(small)
    for split in ("train", "val", "test"):
        wanted = {each.episode_id for each in every if each.split == split}
        if not wanted:
            continue
        for kind in ("single", "vector"):
            env = made(kind, every, split=split, filters=[("index", "<", 2)])
            slot = env.slots[0] if kind == "vector" else env.unwrapped._slot  # noqa: SLF001
            chosen = {each.episode_id for each in slot.source.dataset}
            assert chosen == {each for each in wanted if int(each[-4:]) < 2}
    some = load_dataset(small, filters=[[("index", "==", 0)], [("index", "==", 2)]])
    both = some.select(filters=[("room_count", "==", 1)])
    assert list(both) == [e for e in every if e.index in {0, 2} and e.room_count == 1]
    assert every.select() is every
    with pytest.raises(UsageError, match="split: expected one of"):
        made("single", every, split="nowhere")
    with pytest.raises(UsageError, match="loaded with it"):
        made("single", load_dataset(small, "train"), split="val")
    with pytest.raises(UsageError, match="without columns"):
        made("vector", load_dataset(small, columns=["episode_id"]))


def test_relative_paths_survive_a_change_of_directory(small, tmp_path, monkeypatch):
    monkeypatch.chdir(small.parent)
    env, vector = (made(kind, small.name) for kind in ("single", "vector"))
    loaded = load_dataset(small.name)
    monkeypatch.chdir(tmp_path)
    env.reset(seed=0)
    vector.reset(seed=0)
    played(copy.deepcopy(env), (0, 1))
    assert loaded.scene(loaded[0].scene_id) == load_dataset(small).scene(loaded[0].scene_id)
    assert gymnasium.make(env.spec).reset(seed=0)[1] == env.reset(seed=0)[1]


def test_a_spec_is_text_that_makes_the_environment_again(small, monkeypatch):
    for dataset in (small, load_dataset(small, filters=[("index", "<", 2)])):
        for making in (gymnasium.make, gymnasium.make_vec):
            env = making("InterNav-v0", dataset=dataset, image_size=16)
            text = env.spec.to_json()
            again = making(gymnasium.envs.registration.EnvSpec.from_json(text))
            seen = [each.reset(seed=1)[1]["episode_id"] for each in (env, again)]
            assert np.array_equal(*seen)
    env.close()
