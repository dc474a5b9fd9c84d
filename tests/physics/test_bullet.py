"""Bullet's world serves many scenes, and none of them is told from a scene in an empty world."""

import os

import numpy as np
import pytest
from builders import UPRIGHT
from engines import of_bullet
from scenes import THINGS, answer, scenes

from internav_data.physics import Body, PhysicsScene
from internav_data.physics.solving import solve_push
from internav_data.records import PUSH_SPECS, Pose

pybullet = of_bullet("pybullet")
engine_of_bullet = of_bullet("internav_data.physics.engines.bullet")
bullet_scene = of_bullet("internav_data.physics.engines.bullet_scene")


@pytest.fixture
def fresh(tmp_path):
    """Bullet with an empty world for every scene."""
    client = pybullet.connect(pybullet.DIRECT)
    yield engine_of_bullet.Bullet(bullet_scene.Builder(client, tmp_path, scenes_per_world=1))
    pybullet.disconnect(client)


def test_an_emptied_world_is_as_good_as_new(fresh):
    asked = scenes(60)
    expected = [answer(fresh, *scene) for scene in asked]
    for seed in range(4):
        for k in np.random.default_rng(seed).permutation(len(asked)):
            assert answer(engine_of_bullet.bullet(), *asked[k]) == expected[k]


def test_what_an_interrupt_left_in_a_world_is_swept_away(fresh, monkeypatch):
    asked = [scene for scene, falls in scenes(60) if not falls]
    lone = next(scene for scene in asked if len(scene.bodies) == 1)
    crowded = next(scene for scene in asked if len(scene.bodies) > 1)
    expected = solve_push(fresh, lone, PUSH_SPECS["force"])
    real = pybullet.createMultiBody

    def interrupted(*args, **where):
        real(*args, **where)
        raise KeyboardInterrupt

    for _ in range(2):
        # A body stands where the next scene's would go, and nobody knows its number.
        with monkeypatch.context() as patch:
            patch.setattr(pybullet, "createMultiBody", interrupted)
            with pytest.raises(KeyboardInterrupt):
                solve_push(engine_of_bullet.bullet(), crowded, PUSH_SPECS["force"])
        assert solve_push(engine_of_bullet.bullet(), lone, PUSH_SPECS["force"]) == expected


def test_a_world_is_given_up_before_it_leaks_much(monkeypatch):
    begun = []
    real = pybullet.resetSimulation
    monkeypatch.setattr(
        pybullet, "resetSimulation", lambda *args, **kw: begun.append(real(*args, **kw))
    )
    engine = engine_of_bullet.bullet()
    lone = PhysicsScene((Body.of(THINGS[2], Pose(0.0, 0.0, 0.001, UPRIGHT)),))
    for _ in range(3 * bullet_scene.SCENES_PER_WORLD):
        engine.builder.build(lone)
    assert len(begun) == 3
    assert pybullet.getNumBodies(engine.builder.client) == 1 + len(lone.bodies)


def test_what_a_users_own_client_sets_changes_nothing():
    asked = [scene for scene, falls in scenes(30) if not falls]
    expected = [
        solve_push(engine_of_bullet.bullet(), scene, PUSH_SPECS["force"]) for scene in asked
    ]
    client = pybullet.connect(pybullet.DIRECT)
    # Bullet's own global, whichever client it is set by.
    pybullet.setPhysicsEngineParameter(contactBreakingThreshold=0.02, physicsClientId=client)
    answers = [solve_push(engine_of_bullet.bullet(), scene, PUSH_SPECS["force"]) for scene in asked]
    pybullet.disconnect(client)
    assert answers == expected


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_has_a_client_and_files_of_its_own():
    here = engine_of_bullet.bullet()
    child = os.fork()
    if child == 0:
        there = engine_of_bullet.bullet()
        os._exit(0 if there is not here and there.builder.folder != here.builder.folder else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert here.builder.folder.is_dir()


def test_its_margin_is_that_of_its_hulls():
    assert engine_of_bullet.bullet().contact_margin_m == 0.001
