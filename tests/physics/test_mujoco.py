"""Compiled models serve many scenes, and none of them is told from a scene in a new model."""

import os
from contextlib import contextmanager
from threading import Thread
from types import MethodType

import numpy as np
import pytest
from builders import UPRIGHT, asset, crate, part
from scenes import THINGS, answer, scenes

from internav_data.physics import Body, PhysicsScene
from internav_data.physics.engines import mujoco_scene
from internav_data.physics.engines.mujoco import MuJoCo, mujoco_engine
from internav_data.physics.engines.mujoco_scene import ModelBuilder, mujoco
from internav_data.physics.engines.protocol import Simulation
from internav_data.physics.solving import solve_push
from internav_data.records import PUSH_SPECS, Pose
from internav_data.records.errors import UsageError

STANDING = Pose(0.0, 0.0, 0.001, UPRIGHT)


def test_a_used_model_is_as_good_as_a_new_one():
    asked = scenes(25)
    expected = [answer(MuJoCo(), *scene) for scene in asked]
    for seed, capacity in enumerate((3, 64)):
        engine = MuJoCo()
        engine.builder.models.capacity = capacity
        for k in np.random.default_rng(seed).permutation(len(asked)):
            assert answer(engine, *asked[k]) == expected[k]


class BySteps:
    """An engine that makes single steps, and looks at how far things move in them."""

    def __init__(self, engine):
        self.engine, self.step_s = engine, engine.step_s

    @contextmanager
    def load(self, scene):
        with self.engine.load(scene) as simulation:
            for name in ("row", "advance", "placements"):
                setattr(self, name, MethodType(getattr(Simulation, name), self))
            for name in ("step", "placement", "velocity", "set_velocity", "apply_force"):
                setattr(self, name, getattr(simulation, name))
            yield self


def test_steps_in_one_go_are_those_one_by_one():
    for scene, _ in scenes(16):
        for spec in PUSH_SPECS.values():
            one, other = (
                solve_push(BySteps(MuJoCo()), scene, spec),
                solve_push(MuJoCo(), scene, spec),
            )
            assert one == other


def test_what_moves_alone_moves_as_if_things_slept_around_it():
    alone = [scene for scene, _ in scenes(40) if sum(body.moves for body in scene.bodies) == 1]
    for scene in alone[:8]:
        engine = MuJoCo()
        option = engine.builder.build(scene).model.opt
        assert option.enableflags == 0
        option.enableflags = mujoco.mjtEnableBit.mjENBL_SLEEP
        option.disableflags = mujoco.mjtDisableBit.mjDSBL_AUTORESET
        expected = solve_push(MuJoCo(), scene, PUSH_SPECS["force"])
        assert solve_push(engine, scene, PUSH_SPECS["force"]) == expected


def test_mujocos_clock_stands_while_a_scene_is_solved():
    before = mujoco_scene.CLOCK.value
    with MuJoCo().load(scenes(2)[1][0]):
        assert mujoco_scene.CLOCK.value is None
    assert mujoco_scene.CLOCK.value == before
    assert before


def test_what_an_interrupt_left_in_a_model_is_swept_away(monkeypatch):
    asked = [scene for scene, falls in scenes(60) if not falls]
    lone = next(scene for scene in asked if len(scene.bodies) == 1)
    engine = MuJoCo()
    expected = solve_push(MuJoCo(), lone, PUSH_SPECS["force"])
    for at in (3, 40):
        calls = []
        real = mujoco.mj_step

        def interrupted(*args, calls=calls, real=real, at=at):
            real(*args)
            calls.append(1)
            if len(calls) == at:
                raise KeyboardInterrupt

        with monkeypatch.context() as patch:
            patch.setattr(mujoco, "mj_step", interrupted)
            with pytest.raises(KeyboardInterrupt):
                solve_push(engine, lone, PUSH_SPECS["force"])
        assert solve_push(engine, lone, PUSH_SPECS["force"]) == expected


def test_a_body_has_the_inertia_that_bullet_gives_it():
    pybullet = pytest.importorskip("pybullet")
    from internav_data.physics.engines.bullet import bullet

    for thing in THINGS:
        scene = PhysicsScene((Body.of(thing, STANDING),))
        (identity,) = bullet().builder.build(scene)
        inertia = pybullet.getDynamicsInfo(identity, -1, bullet().builder.client)[2]
        made = MuJoCo().builder.build(scene)
        assert made.model.body_inertia[1] == pytest.approx(inertia, rel=1e-4)
        assert made.model.body_mass[1] == thing.mass_kg


def test_a_shape_that_mujoco_refuses_is_named_in_one_line(monkeypatch):
    """It takes hulls as thin as 1e-13 m, but no mesh without faces, nor more than 200,000."""
    corners = [(x, y, z) for x in (0.0, 0.3) for y in (0.0, 0.3) for z in (0.0, 0.1)]
    sheet = asset("Sheet_3", part("hull", (0.0, 0.0, 0.0), (0.3, 0.3, 0.1), corners=corners))
    monkeypatch.setattr(mujoco_scene, "_mesh_file", lambda _: ("sheet.obj", b"v 0 0 0"))
    with pytest.raises(UsageError, match="MuJoCo refuses a shape among Sheet_3: ") as refused:
        solve_push(MuJoCo(), PhysicsScene((Body.of(sheet, STANDING),)), PUSH_SPECS["force"])
    assert "\n" not in str(refused.value)


def test_a_scene_that_mujoco_loses_is_no_solution(monkeypatch, tmp_path):
    """An unstable scene would begin anew by itself, and be told from a push that moves nothing."""
    monkeypatch.chdir(tmp_path)
    real = mujoco.mj_step

    def exploding(*args):
        args[1].qvel[0] = np.inf
        real(*args)

    monkeypatch.setattr(mujoco, "mj_step", exploding)
    scene = PhysicsScene((Body.of(crate("Box_0", (0.3, 0.3, 0.3)), STANDING),))
    with pytest.raises(RuntimeError, match=r"MuJoCo lost a scene: .*mjWARN_BADQVEL"):
        solve_push(MuJoCo(), scene, PUSH_SPECS["force"])
    assert not list(tmp_path.iterdir()), "no log of MuJoCo's"


def test_no_log_of_mujocos_is_written(monkeypatch, tmp_path):
    """It has a warning for each scene of things that touch: where it is compiled, too."""
    monkeypatch.chdir(tmp_path)
    asked = scenes(8)
    for scene, _ in asked:
        ModelBuilder().build(scene)
    assert not list(tmp_path.iterdir())
    worker = Thread(target=lambda: [answer(MuJoCo(), *one) for one in asked[:3]])
    worker.start()
    worker.join()
    assert not list(tmp_path.iterdir())


def test_a_handler_of_the_users_stays():
    told = []
    mujoco.set_mju_user_warning(told.append)
    try:
        mine = mujoco.get_mju_user_warning()
        answer(MuJoCo(), *scenes(2)[1])
        assert mujoco.get_mju_user_warning() == mine
    finally:
        mujoco.set_mju_user_warning(None)
    assert told == []


def test_too_little_memory_is_a_lost_scene_in_one_line(monkeypatch):
    monkeypatch.setattr(mujoco_scene, "ARENA_BYTES", 3000)
    scene, _ = scenes(1)[0]
    with pytest.raises(RuntimeError, match=r"MuJoCo lost a scene: .*out of memory") as lost:
        solve_push(MuJoCo(), scene, PUSH_SPECS["force"])
    assert "\n" not in str(lost.value)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_process_has_models_of_its_own():
    here = mujoco_engine()
    child = os.fork()
    if child == 0:
        os._exit(0 if mujoco_engine() is not here else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_there_is_memory_for_the_contacts_of_chairs_in_each_other():
    chairs = [crate_of_legs(0.02 * k) for k in range(3)]
    assert solve_push(mujoco_engine(), PhysicsScene(tuple(chairs)), PUSH_SPECS["force"])


def crate_of_legs(x):
    legs = [
        part("box", (0.1 * i, 0.1 * j, 0.2), (0.04, 0.04, 0.4)) for i in range(4) for j in range(4)
    ]
    return Body.of(asset("Chair_9", *legs, mass_kg=4.0), Pose(x, 0.0, 0.001, UPRIGHT))
