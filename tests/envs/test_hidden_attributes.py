"""Hidden attributes stay hidden: nothing tells them until an interaction succeeds."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
from builders import by_id, chair, crate, episode, goal, obstacle, one_room, scene_object
from builders import start as start_of

from internav_data.envs.auxiliary import auxiliary_starts
from internav_data.envs.episode import EpisodeRun, TaskConfig
from internav_data.envs.sensors import SENSORS
from internav_data.envs.slot import step_info
from internav_data.envs.source import LoadedHouse
from internav_data.envs.spaces import ObservationBuffer
from internav_data.envs.tasks import TaskStep
from internav_data.records import Dynamics
from internav_data.render.camera import Camera
from internav_data.views.replay_story import Moment, Story, describe
from internav_data.world import ACTIONS, Action, HouseModel, World
from internav_data.world.masks import action_mask

BOX = crate("Box_9", (0.3, 0.3, 0.3), mass_kg=2.0, pushable=False, pickable=True)
STOOL = crate("Stool_9", (0.4, 0.4, 0.4), mass_kg=4.0)
CHAIR = chair("Chair_9")
ASSETS = by_id(BOX, STOOL, CHAIR)
AFFORDANCES = {"Box": "pick", "Stool": "push", "Chair": "push"}
SPOTS = ((1.0, 0.3), (1.8, 2.7), (2.2, 1.2), (3.1, 1.8), (3.9, 2.7), (4.1, 0.3), (4.9, 1.6))
"""Places of objects in a room of 6 x 3 m, the goal at its end."""


def drawn(rng, affordance):
    """Attributes of one object: heavy, light, fixed or free."""
    free = rng.random() < 0.5
    return Dynamics(
        float(rng.choice([1.0, 40.0])),
        float(rng.choice([0.4, 0.8])),
        free and affordance == "push",
        free and affordance == "pick",
    )


def run_of(layout, attributes):
    """A run in a room whose objects are drawn by one seed and their attributes by another."""
    rng, hidden = np.random.default_rng(layout), np.random.default_rng(attributes)
    spots = [SPOTS[k] for k in rng.permutation(len(SPOTS))[:6]]
    names = rng.choice(list(ASSETS), 6).tolist()
    furniture, obstacles = [], []
    for number, ((x, y), name) in enumerate(zip(spots, names, strict=True)):
        affordance = AFFORDANCES[ASSETS[name].type]
        own = drawn(hidden, affordance)
        if number < 2:
            placed = scene_object(number, name, 0, x, y)
            furniture.append(replace(placed, dynamics=own, affordance=affordance))
            continue
        changes = {
            key: getattr(own, key) for key in ("mass_kg", "friction", "pushable", "pickable")
        }
        standing = obstacle(ASSETS[name], x, y)
        obstacles.append(replace(standing, **changes, affordance=affordance))
    room = replace(one_room(6.0, 3.0), objects=tuple(furniture), assets=ASSETS)
    task = episode(room, start_of(2, 6, 0), goal(22, 6), obstacles)
    return EpisodeRun(task, LoadedHouse.of(room), ASSETS, TaskConfig(max_steps=10_000))


def seen(run, buffer):
    """All that an agent observes: every sensor, and the mask of its actions."""
    run.stale = True
    buffer.write(0, run)
    return {**buffer.copied(), "mask": action_mask(run.world)}


def placed_alike(runs, rng):
    """Put the agents of all runs on one random node near an object, with one heading."""
    item = runs[0][0].world.items[int(rng.integers(len(SPOTS) - 1))]
    free = np.argwhere(runs[0][0].world.lattice.free)
    away = np.hypot(0.25 * free[:, 0] - item.pose.x, 0.25 * free[:, 1] - item.pose.y)
    node = free[int(rng.choice(np.flatnonzero(away < 0.9)))]
    quarter = int(rng.integers(4))
    for run, _ in runs:
        run.world.i, run.world.j, run.world.quarter = int(node[0]), int(node[1]), quarter


def same_to_agents(runs):
    """Assert that nothing that an agent is given differs between runs."""
    (base, told), *others = ((seen(*pair), step_info(pair[0], STILL)) for pair in runs)
    for observed, info in others:
        assert info == told
        for name, values in observed.items():
            np.testing.assert_array_equal(values, base[name], err_msg=name)


STILL = TaskStep(0.0, terminated=False, truncated=False)


def test_worlds_are_alike_until_an_interaction_succeeds():
    camera, causes = Camera(16), Counter()
    for layout in range(4):
        rng = np.random.default_rng(layout)
        runs = [
            (run_of(layout, attributes), ObservationBuffer.of(camera, 1, list(SENSORS.values())))
            for attributes in range(4)
        ]
        for kind in rng.choice(["push", "push", "push", "pick", "look"], 60).tolist():
            placed_alike(runs, rng)
            action = int(rng.choice([action for action in ACTIONS if action.kind == kind]))
            for run, _ in runs:
                run.step(action)
            # A world in which it succeeds goes its own way; the others go on together.
            runs = [pair for pair in runs if kind == "look" or not pair[0].last.success]
            if len(runs) < 2:
                break
            same_to_agents(runs)
            told = {describe_last(run) for run, _ in runs}
            assert len(told) == 1, told
            causes.update(run.last.cause for run, _ in runs)
    assert {"too heavy", "not pushable", "not pickable", "something is in the way"} <= set(causes)
    assert causes.total() - causes[""] > 25, causes


def describe_last(run):
    """The caption of a run's last action."""
    moment = Moment(1, 2, run.world, run.last, None)
    return describe(Story(run.episode, run.loaded_house.model, (moment, moment), ()), moment)


def test_targets_go_by_type_and_only_records_know_the_cause():
    run = run_of(0, 0)
    world = run.world
    for item in world.items:
        assert item.affords(item.affordance)
        assert not item.affords("push" if item.affordance == "pick" else "pick")
        assert item.dynamics.fixed or item.dynamics.pushable != item.dynamics.pickable


def test_a_fixed_object_that_shows_is_the_target_and_did_not_move():
    def refusal(own, affordance, action):
        item = BOX if affordance == "pick" else STOOL
        standing = replace(
            obstacle(item, 1.5, 1.5), affordance=affordance, pushable=own, pickable=False
        )
        room = one_room(6.0, 3.0)
        task = episode(room, start_of(3, 6, 0), goal(22, 6), [standing])
        return World.of_episode(HouseModel.of(room), task, ASSETS).step(action)

    pushed = refusal(False, "push", Action.PUSH_AHEAD)
    assert (pushed.target, pushed.reason, pushed.cause) == (0, "did not move", "not pushable")
    picked = refusal(False, "pick", Action.PICKUP)
    assert (picked.target, picked.reason, picked.cause) == (0, "did not move", "not pickable")
    assert refusal(True, "push", Action.PUSH_AHEAD).success
    looked = refusal(False, None, Action.PUSH_AHEAD)
    assert (looked.target, looked.reason) == (-1, "nothing to push in sight and reach")


def test_auxiliary_starts_stand_beside_fixed_obstacles_too():
    runs = [run_of(3, attributes) for attributes in range(4)]
    for kind in ("push", "pick"):
        starts = [auxiliary_starts(r.loaded_house.model, r.episode, ASSETS, kind) for r in runs]
        assert starts[0]
        assert all(other == starts[0] for other in starts)


def test_worlds_with_other_targets_are_in_other_states():
    room = one_room(6.0, 3.0)
    digests = set()
    for affordance in (None, "push", "pick"):
        standing = replace(obstacle(STOOL, 1.5, 1.5), affordance=affordance)
        task = episode(room, start_of(3, 6, 0), goal(22, 6), [standing])
        digests.add(World.of_episode(HouseModel.of(room), task, ASSETS).digest())
    assert len(digests) == 3
