"""Environments in threads of one process give what they give one after the other."""

import hashlib
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from threaded import run_in_threads

from internav_data.envs import InterNavEnv
from internav_data.envs.source import LOADED_HOUSES
from internav_data.physics.result_cache import FILE_NAME, ResultCache
from internav_data.render.camera import Camera, CameraView

SHARES = np.array([8, 2, 2, 0.5, 0.5, 2, 2, 2, 2, 1, 1, 0.05])


def play(dataset, seed, steps):
    """Return the digest of everything that an environment shows in some steps."""
    env, rng, shown = InterNavEnv(dataset, 32), np.random.default_rng(seed), hashlib.sha256()
    env.reset(seed=seed)
    for action in rng.choice(12, size=steps, p=SHARES / SHARES.sum()).tolist():
        observation, *rest, _ = env.step(action)
        for name in sorted(observation):
            shown.update(np.ascontiguousarray(observation[name]).tobytes())
        shown.update(repr(rest).encode())
        if rest[1] or rest[2]:
            env.reset()
    return shown.hexdigest()


def kept(folder):
    """Return the values of a result cache by prefix of their keys."""
    with closing(sqlite3.connect(folder / FILE_NAME)) as file:
        batches = file.execute("SELECT first, prefixes FROM batches").fetchall()
        values = dict(file.execute("SELECT id, value FROM solutions").fetchall())
    return {
        prefixes[8 * k : 8 * k + 8]: values[first + k]
        for first, prefixes in batches
        for k in range(len(prefixes) // 8)
    }


@pytest.fixture
def played(tmp_path, monkeypatch, small):
    """Play a run in which nothing is known: its digests, and what it leaves in the cache."""

    def run(name, steps, how):
        held = ResultCache(tmp_path / name)
        monkeypatch.setattr("internav_data.physics.registry.result_cache", lambda: held)
        LOADED_HOUSES.clear()
        digests = how(lambda seed: play(small, seed, steps))
        held.flush()
        return digests, kept(tmp_path / name)

    return run


def in_turn(count):
    return lambda work: [work(seed) for seed in range(count)]


def at_once(count):
    return lambda work: run_in_threads(work, count)


def test_four_threads_show_and_keep_what_one_does(played):
    alone = played("alone", 40, in_turn(4))
    assert len(alone[1]) > 5
    assert played("threads", 40, at_once(4)) == alone


@pytest.mark.slow
def test_eight_threads_show_and_keep_what_one_does_twenty_times(played):
    alone = played("alone", 150, in_turn(8))
    assert len(alone[1]) > 30
    for run in range(20):
        assert played(f"run {run}", 150, at_once(8)) == alone


def test_threads_draw_with_one_camera(hand_run):
    run = hand_run(divided=True)
    camera = Camera(128)
    views = [
        CameraView(run.loaded_house.static_scene, run.props, 1.0 + 0.25 * k, 1.5, 90.0 * k, 0.0)
        for k in range(4)
    ]
    alone = [camera.render([view]) for view in views]

    def draw(number):
        return [camera.render([views[number]]) for _ in range(30)]

    for one, many in zip(alone, run_in_threads(draw, 4), strict=True):
        for frames in many:
            assert np.array_equal(frames.rgb, one.rgb)
            assert np.array_equal(frames.depth, one.depth)
