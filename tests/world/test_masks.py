"""What a mask leaves out fails; what it lets through is tried on copies of the world."""

from __future__ import annotations

from collections import Counter

import numpy as np
from builders import by_id, crate, episode, goal, obstacle, one_room, start

from internav_data.world import ACTIONS, HouseModel, World
from internav_data.world.masks import action_mask

BOX = crate("Box_9", (0.4, 0.4, 0.4), mass_kg=2.0, pushable=False, pickable=True)
STOOL = crate("Stool_9", (0.4, 0.4, 0.4), mass_kg=2.0, pushable=True, pickable=False)


def test_a_mask_agrees_with_what_actions_do():
    house = one_room(6.0, 3.0)
    things = [obstacle(BOX, 2.0, 1.5), obstacle(STOOL, 3.0, 1.5)]
    begun = episode(house, start(4, 6, 0), goal(20, 6), things)
    world = World.of_episode(HouseModel.of(house), begun, by_id(BOX, STOOL))
    rng, seen = np.random.default_rng(3), Counter()
    for _ in range(120):
        mask = action_mask(world)
        assert mask.shape == (len(ACTIONS),)
        for action in ACTIONS:
            result = world.copy().step(action)
            seen[action.kind, bool(mask[action]), result.success] += 1
            assert mask[action] or not result.success, (action, result)
            if action.kind in {"move", "turn", "look", "pick"}:
                assert result.success == mask[action], (action, result)
        world.step(int(rng.choice(np.flatnonzero(mask[:-1]))))
    for kind in ("move", "look", "pick", "push", "drop"):
        assert seen[kind, True, True], kind
        assert seen[kind, False, False], kind
    assert not seen["done", False, False]
