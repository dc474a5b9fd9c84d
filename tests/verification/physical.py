"""Hand-made scenes whose obstacles have settled, with outcomes and experts."""

from __future__ import annotations

from dataclasses import replace

import scenery
from builders import scene_object
from scenery import ASSETS, Grid, obstacle, small_scenes

from internav_data.episodes.outcomes import outcomes_of
from internav_data.physics import DEFAULT_ENGINE, Body, get_solver, settle
from internav_data.planner.search import expert_of_episode
from internav_data.records import Pose
from internav_data.world import HouseModel, World
from internav_data.world.config import DEFAULT_WORLD


def settled(one, engine):
    """An obstacle where it comes to rest."""
    asset = ASSETS[one.asset_id]
    spot = Pose(one.x, one.y, 0.0, one.quaternion)
    rest = settle(Body.of(asset, spot), 0.01, list, engine)
    assert not rest.refusal
    return replace(
        one,
        x=rest.pose.x,
        y=rest.pose.y,
        z=rest.pose.z,
        quaternion=rest.pose.quaternion,
        settle_s=rest.seconds,
        settle_penetration_m=rest.penetration_m,
    )


def played(house, episode, config=DEFAULT_WORLD, other_engine=None, engine=DEFAULT_ENGINE):
    """An episode with settled obstacles, outcomes and expert."""
    engine = get_solver(engine)
    resting = tuple(settled(one, engine.name) for one in episode.obstacles)
    episode = replace(
        episode,
        obstacles=resting,
        physics=replace(
            episode.physics,
            engine=engine.name,
            build=engine.build,
            other_engine=other_engine,
            other_build=None if other_engine is None else get_solver(other_engine).build,
            settle_s=max(o.settle_s for o in resting),
            penetration_m=max(o.settle_penetration_m for o in resting),
        ),
    )
    stage = HouseModel.of(replace(house, assets=ASSETS))
    world = World.of_episode(stage, episode, ASSETS, config)
    # A tenth of a millimetre of settling may show in the way.
    episode = replace(
        episode,
        obstructed_path_steps=world.path_steps(),
        obstructed_path_m=world.obstructed_path_m(),
    )
    outcomes = outcomes_of(world, other_engine=other_engine)
    return replace(
        episode,
        obstacles=tuple(
            replace(o, outcomes=five) for o, five in zip(resting, outcomes, strict=True)
        ),
        expert=expert_of_episode(stage, episode, ASSETS, config),
        agreed=(
            None
            if other_engine is None
            else all(o.agrees is not False for five in outcomes for o in five)
        ),
    )


def crowded_house():
    """A table, and furniture where a pot before the door goes when it is pushed."""
    things = (scene_object(0, "Table_1", 0, 1.0, 0.6), scene_object(1, "Box_2", 0, 3.4, 2.7))
    return Grid(2, 1).house(2, things)


def crowded():
    """A safe and a pot before the door of `crowded_house`."""
    house = crowded_house()
    pot = obstacle("Pot_1", 3.4, 2.1)
    safe = obstacle("Safe_1", 3.4, 1.4)
    shut = scenery.episode(
        house, 0, (4, 8), (28, 8), [safe, pot], shortest_path_m=6.0, obstructed_path_m=None
    )
    box = obstacle("Box_1", 2.5, 2.0)
    obstructed_path_m = small_scenes()[0][1][1].obstructed_path_m
    longer = scenery.episode(
        house, 1, (4, 8), (28, 8), [box], shortest_path_m=6.0, obstructed_path_m=obstructed_path_m
    )
    return house, [shut, longer]


def physical_scenes(config=DEFAULT_WORLD, other_engine=None):
    """Three scenes: a bar in a door, a box on the way, and `crowded`."""
    raw = [*small_scenes()[:2], crowded()]
    return [
        (house, [played(house, e, config, other_engine) for e in episodes])
        for house, episodes in raw
    ]
