"""Obstacles stand in nothing: not in what footprints leave out, either."""

from dataclasses import replace

import builders
import numpy as np
import pytest
from builders import crate, scene_object, screen

from internav_data.catalog import catalogue
from internav_data.episodes import EpisodeConfig, build_episodes
from internav_data.episodes import spawn as module
from internav_data.episodes.build import _draw_endpoints
from internav_data.episodes.pool import ObstaclePool
from internav_data.episodes.site import SpawnSite
from internav_data.episodes.spawn import _solids, settled_at, spawn
from internav_data.geometry import clearance, footprint
from internav_data.houses import HouseConfig, build_house
from internav_data.physics import wall_body
from internav_data.physics.fall_clearance import touches
from internav_data.physics.narrow_phase import prisms_of
from internav_data.records import Pose
from internav_data.records.errors import QuarantineError
from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.overlaps import Solids, intrusions
from internav_data.verification.shapes import Shapes

SHELF = crate("Shelf_0", (0.8, 0.3, 1.2), spawnable=False, pushable=False)
LEGGED = builders.table("SideTable_0", (0.5, 0.5, 0.5), leg_m=0.04)
ASSETS = builders.by_id(SHELF, LEGGED, screen())
INNER = (2.0, 1.2, 2.1, 2.0), (0.9, 1.5, 1.0, 2.2)
HOUSE = replace(
    builders.one_room(5.0, 3.0, *INNER),
    objects=(
        scene_object(0, "Shelf_0", 0, 1.5, 0.3),
        scene_object(1, "Screen_0", 0, 3.6, 0.3),
    ),
    assets=ASSETS,
)


@pytest.fixture(scope="module")
def drafts():
    """Drafts with as many screens and side tables as find room."""
    site, config = SpawnSite.of(HOUSE), EpisodeConfig(max_obstacles=(12, 12, 12), lateral_std_m=1.0)
    made = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        draft = _draw_endpoints(site, "lengthened" if seed % 2 else "blocked", config, rng)
        spawn(draft, ObstaclePool((screen(), LEGGED), None), rng)
        made.append(draft)
    return made


def test_no_part_of_an_obstacle_is_in_anything(drafts):
    shapes = Shapes(ASSETS)
    still, count = CheckedLayout(HOUSE, shapes).solids, 0
    for draft in drafts:
        own = Solids.of(
            (k, shapes.slabs(o.asset.asset_id, o.settled.pose))
            for k, o in enumerate(draft.obstacles)
        )
        count += len(draft.obstacles)
        assert intrusions(own, still) == []
        assert intrusions(own, own) == []
    assert count > 50


def test_their_footprints_alone_would_let_them_in():
    wall, spot = wall_body(HOUSE.walls[0]), Pose(3.0, 0.1, 0.0, builders.UPRIGHT)
    assert clearance(footprint(screen(), spot), footprint(wall.asset, wall.pose)) > 0.01
    shapes = Shapes(ASSETS)
    own = Solids.of([(0, shapes.slabs("Screen_0", spot))])
    assert intrusions(own, CheckedLayout(HOUSE, shapes).solids) == [(0, -1)]


def test_without_a_gap_nothing_falls_into_something(monkeypatch):
    """Physics would spend minutes on pushing apart what overlaps."""
    fell = []

    def settled_apart(draft, body):
        own = prisms_of(body.asset, body.pose)
        fell.append(not any(touches(own, solid) for solid in _solids(draft)))
        return settled_at(draft, body)

    monkeypatch.setattr(module, "settled_at", settled_apart)
    site = SpawnSite.of(HOUSE)
    config = EpisodeConfig(max_obstacles=(6, 6, 6), gap_m=0.0, lateral_std_m=1.0)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        draft = _draw_endpoints(site, "blocked", config, rng)
        spawn(draft, ObstaclePool((screen(), LEGGED), None), rng)
    assert len(fell) > 10
    assert all(fell)


@pytest.mark.slow
def test_none_of_3000_obstacles_is_in_anything(monkeypatch):
    """Over 1,000 episodes of the catalogue, whose experts and outcomes are not asked for here."""
    monkeypatch.setattr("internav_data.episodes.build.solve", lambda _: None)
    monkeypatch.setattr(
        "internav_data.episodes.build.outcomes_of",
        lambda world, *_: ((),) * len(world.obstacles),
    )
    shapes, count = Shapes(catalogue().assets), 0
    for scene in range(110):
        house = build_house(0, scene, HouseConfig(), catalogue())
        still = CheckedLayout(house, shapes).solids
        config = EpisodeConfig(keep_unsolvable=True)
        try:
            episodes = build_episodes(house, 10, catalogue().spawnable, config)
        except QuarantineError:  # a run would try other random numbers
            continue
        for episode in episodes:
            own = Solids.of(
                (k, shapes.slabs(o.asset_id, o.pose)) for k, o in enumerate(episode.obstacles)
            )
            count += len(episode.obstacles)
            assert (episode.episode_id, intrusions(own, still)) == (episode.episode_id, [])
            assert (episode.episode_id, intrusions(own, own)) == (episode.episode_id, [])
    assert count > 3000
