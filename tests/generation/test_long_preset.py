"""The preset `long`: interactions of several actions, most of them pushes, and draws to solve."""

from collections import Counter
from itertools import groupby

import pytest

from internav_data.catalog import catalogue
from internav_data.generation import load_config
from internav_data.generation.scenes import build_scene
from internav_data.world import Action, HouseModel, World


def runs_of(world, actions):
    """Kind and length of the runs of interactions with one object; moves do not end a run."""
    acts = [(Action(a).kind, world.step(a).target) for a in actions]
    acts = [(kind, target) for kind, target in acts if kind in {"push", "pick"}]
    return [(kind, len(list(run))) for (kind, _), run in groupby(acts)]


def built(scenes, episodes):
    config, runs, redraws, count = load_config(episode_preset="long"), [], Counter(), 0
    for number in scenes:
        scene = build_scene(number, config, catalogue(), episodes)
        redraws.update(scene.redraws)
        model = HouseModel.of(scene.house)
        for episode in scene.episodes:
            count += 1
            world = World.of_episode(model, episode, catalogue().assets, config.world)
            runs += runs_of(world, episode.expert.actions)
    return runs, redraws, count


@pytest.mark.slow
def test_most_pushes_take_three_actions_and_most_draws_can_be_solved():
    runs, redraws, count = built(range(30, 50), 3)
    pushes = [length for kind, length in runs if kind == "push"]
    assert sum(length >= 3 for length in pushes) >= 0.5 * len(pushes)
    assert len(pushes) >= 0.5 * len(runs)
    solved = count + redraws["too few interactions"]
    assert solved >= 0.85 * (solved + redraws["no expert"])
