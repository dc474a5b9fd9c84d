"""The validator holds every episode to the settings of the manifest's config."""

from dataclasses import replace

import pytest
from scenery import small_scenes

from internav_data.generation import GenerationConfig
from internav_data.records import Expert
from internav_data.records.errors import CorruptDataError
from internav_data.verification.episode_config import (
    EpisodeRequest,
    check_episode_config,
    episode_request,
)
from internav_data.verification.findings import FindingCollector

LENGTHENED = small_scenes()[0][1][1]
"""An episode whose path takes 26 steps, or 24 without its one obstacle."""


def found(config, **changes):
    start = replace(LENGTHENED.start, faces_wall=False, reachable_nodes=9)
    obstacles = tuple(replace(o, relevant=True) for o in LENGTHENED.obstacles)
    expert = Expert((5, 11), 2, 1, 0, 0.0)
    episode = replace(LENGTHENED, start=start, obstacles=obstacles, expert=expert)
    episode = replace(episode, **changes)
    report = FindingCollector()
    check_episode_config(episode, episode_request({"episodes": config}), report)
    return {name.removeprefix("schema.episodes.config-") for name in report.by_predicate}


DETOUR = LENGTHENED.obstructed_path_steps - LENGTHENED.shortest_path_steps
START = replace(LENGTHENED.start, faces_wall=True, reachable_nodes=3)
IDLE = tuple(replace(o, relevant=False) for o in LENGTHENED.obstacles)


@pytest.mark.parametrize(
    ("config", "changes", "name"),
    [
        ({"idle_obstacles": "drop"}, {"obstacles": IDLE}, "idle-obstacles"),
        ({"idle_obstacles": "drop"}, {"obstacles": LENGTHENED.obstacles}, "idle-obstacles"),
        ({"min_detour_steps": DETOUR + 1}, {}, "min-detour-steps"),
        ({"min_interactions": 2}, {}, "min-interactions"),
        ({"refuse_facing_wall": True}, {"start": START}, "facing-wall"),
        ({"refuse_facing_wall": True}, {"start": LENGTHENED.start}, "facing-wall"),
        ({"asset_weights": {LENGTHENED.obstacles[0].type: 0}}, {}, "asset-weights"),
        ({"min_start_nodes": 4}, {"start": START}, "min-start-nodes"),
    ],
)
def test_an_episode_against_the_config_is_found(config, changes, name):
    assert found(config, **changes) == {name}
    assert found(config | {"idle_obstacles": "keep"}, **changes) in ({name}, set())
    assert found({}, **changes) == set()


def test_what_the_config_asks_for_is_fine():
    config = {"idle_obstacles": "drop", "min_detour_steps": DETOUR, "min_interactions": 1}
    assert found(config | {"refuse_facing_wall": True, "min_start_nodes": 9}) == set()
    assert found({"min_interactions": 2}, expert=None) == set()


def test_defaults_refuse_what_the_generator_does():
    episodes = GenerationConfig().resolved()["episodes"]
    assert episode_request({"episodes": episodes}) == EpisodeRequest(min_detour_steps=2)
    assert episode_request({}) == EpisodeRequest()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("idle_obstacles", "hide"),
        ("min_detour_steps", "2"),
        ("min_interactions", -1),
        ("refuse_facing_wall", "yes"),
        ("min_start_nodes", 0),
        ("asset_weights", [1]),
    ],
)
def test_values_that_no_generator_writes_are_refused(key, value):
    with pytest.raises(CorruptDataError, match=f"config.episodes.{key}: expected .* got "):
        episode_request({"episodes": {key: value}})
