"""The tasks of `make test-learning` are what they are said to be."""

import numpy as np
import pytest
from small_worlds import (
    AHEAD,
    BLOCK,
    BOX,
    DONE,
    DROP,
    LEFT,
    PICKUP,
    PUSH,
    RIGHT,
    THING,
    Cue,
    Mixed,
)


def started(kind, side=1):
    """Two cells of the corridor to the thing in the way, two more to its end, one to the goal."""
    env = Mixed(1, ids=True)
    env.reset()
    env.far[:], env.lane[:], env.turns[:] = 4, 0, 0
    env.kind[:], env.at[:], env.side[:], env.there[:] = kind, 2, side, 1
    return env


def paid(env, actions):
    """Return what actions pay in all, rounded, and whether the last one succeeded."""
    rewards = []
    for action in actions:
        _, reward, ended, _, infos = env.step(np.array([action]))
        rewards.append(reward[0])
    return round(sum(rewards), 6), bool(ended[0] and infos["metrics"]["success"][0])


START_M = 0.25 * 17**0.5


@pytest.mark.parametrize(("kind", "right"), [(BOX, PUSH), (THING, PICKUP), (BLOCK, DONE)])
def test_each_kind_is_cleared_by_its_own_action_alone(kind, right):
    for action in (PUSH, PICKUP):
        whole, reached = paid(
            started(kind), [AHEAD, action, AHEAD, AHEAD, AHEAD, RIGHT, AHEAD, DONE]
        )
        assert reached == (action == right)
        if reached:
            assert whole == pytest.approx(10 + 1 + START_M - 0.08)
        elif kind != BLOCK:
            assert whole == pytest.approx(START_M - 0.25 * 10**0.5 - 0.08)


@pytest.mark.parametrize("side", [-1, 1])
def test_the_way_round_a_block_is_beside_it(side):
    out, back = (RIGHT, LEFT) if side > 0 else (LEFT, RIGHT)
    way = [out, AHEAD, back, AHEAD, AHEAD, AHEAD, AHEAD, DONE]
    whole, reached = paid(started(BLOCK, side), way)
    assert reached
    assert whole == pytest.approx(10 + START_M - 0.08)
    assert not paid(started(BLOCK, -side), way)[1]
    assert not paid(started(BOX, side), way)[1]


def test_what_is_put_down_in_the_way_closes_it_again():
    again = [AHEAD, PICKUP, DROP, PICKUP, DROP, PICKUP]
    whole, _ = paid(started(THING), again)  # one opening: the others were closed again
    assert whole == pytest.approx(START_M - 0.25 * 10**0.5 + 1 - 0.06)


def test_kinds_are_told_apart_by_sight():
    views = {kind: started(kind).look() for kind in (BOX, THING, BLOCK)}
    assert [tuple(views[k]["rgb"][0, 17, 16]) for k in (BOX, BLOCK)] == [(220, 40, 40), (150,) * 3]
    assert tuple(views[THING]["rgb"][0, 19, 16]) == (40, 200, 60)
    assert [int(views[k]["ids"].max()) for k in views] == [1, 2, 3]
    assert views[BLOCK]["rgb"][0, :, -4:].min() == 230
    assert views[BLOCK]["rgb"][0, :, :4].max() == views[BOX]["rgb"][0, :, -4:].max() == 20
    right = np.arctan(1 / 4)  # bearings to the left are positive
    assert views[BOX]["goal"][0].tolist() == pytest.approx([START_M, -right])
    turned = started(BOX)
    seen, *_ = turned.step(np.array([RIGHT]))
    assert seen["goal"][0].tolist() == pytest.approx([START_M, np.pi / 2 - right])


def test_a_cue_is_gone_after_the_first_step_and_leaves_no_trace():
    env = Cue(64)
    first, _ = env.reset()
    assert len(np.unique(first["rgb"].reshape(64, -1), axis=0)) == 2
    rng = np.random.default_rng(0)
    for _ in range(env.steps_to_fork):
        seen, *_ = env.step(rng.integers(0, DONE, 64))
        assert all(len(np.unique(what.reshape(64, -1), axis=0)) == 1 for what in seen.values())
    right = env.right.copy()
    *_, infos = env.step(np.full(64, RIGHT))
    assert (infos["metrics"]["success"] == (right > 0)).all()
