"""Episodes are pure functions of house, index and attempt, and mean what they say."""

import itertools
import math
import subprocess
import sys
from dataclasses import astuple

import networkx as nx
import pytest
import shapely

from internav_data.catalog import catalogue
from internav_data.episodes import EpisodeConfig, build_batch, build_episodes, mode_of
from internav_data.episodes.outcomes import outcomes_of
from internav_data.episodes.spawn import NEAR_M
from internav_data.geometry import asset_corners, footprint, house_footprints, transform
from internav_data.houses import HouseConfig, build_house
from internav_data.navigation import Lattice
from internav_data.physics import Body, PhysicsScene, get_solver, wall_body
from internav_data.physics.result_cache import ResultCache
from internav_data.physics.scene import UPRIGHT
from internav_data.planner.search import replay
from internav_data.records import Pose
from internav_data.records.errors import QuarantineError, UsageError
from internav_data.world import Action, HouseModel, World, WorldConfig

SCENES = (0, 1, 6)


@pytest.fixture(scope="module")
def pool():
    return catalogue().spawnable


@pytest.fixture(scope="module")
def houses():
    return {scene: build_house(0, scene, HouseConfig(), catalogue()) for scene in SCENES}


@pytest.fixture(scope="module")
def episodes(houses, pool):
    return {scene: build_episodes(house, 6, pool) for scene, house in houses.items()}


def test_what_is_kept_on_disk_changes_nothing(houses, pool, episodes, tmp_path, monkeypatch):
    counts = []
    for _ in range(2):
        held = ResultCache(tmp_path)
        monkeypatch.setattr("internav_data.physics.registry.result_cache", lambda held=held: held)
        assert build_episodes(houses[6], 3, pool) == episodes[6][:3]
        counts.append(held.count())
    assert counts[0] == counts[1] > 15  # the second time nothing was solved


def everything(house, episode):
    """Each footprint polygon of a scene, by shapely."""
    assets = {**house.assets, **catalogue().assets}
    groups = [house_footprints(house)]
    groups += [footprint(assets[o.asset_id], o.pose) for o in episode.obstacles]
    return [[shapely.Polygon(p) for p in group] for group in groups]


def steps_by_networkx(house, polygons, start, goal):
    """Lattice distance by shapely distances and networkx, plainly."""
    tree = shapely.STRtree(polygons)
    outline = shapely.Polygon(house.outline)
    wide, deep = (max(c[k] for c in house.outline) for k in (0, 1))

    def free(shape):
        near = tree.query(shape.buffer(0.2))
        return all(shape.distance(polygons[k]) >= 0.2 - 1e-6 for k in near)

    nodes = {
        (i, j)
        for i, j in itertools.product(range(int(wide / 0.25) + 1), range(int(deep / 0.25) + 1))
        if outline.contains(shapely.Point(0.25 * i, 0.25 * j))
        and free(shapely.Point(0.25 * i, 0.25 * j))
    }
    graph = nx.Graph()
    graph.add_nodes_from(nodes)
    for i, j in nodes:
        for other in ((i + 1, j), (i, j + 1)):
            line = shapely.LineString([(0.25 * i, 0.25 * j), (0.25 * other[0], 0.25 * other[1])])
            if other in nodes and free(line):
                graph.add_edge((i, j), other)
    try:
        return nx.shortest_path_length(graph, start, goal)
    except nx.NetworkXNoPath:
        return None


def test_modes_take_turns_and_hold(episodes):
    for scene, batch in episodes.items():
        for episode in batch:
            assert episode.mode == mode_of(scene, episode.index)
            if episode.mode == "blocked":
                assert episode.obstructed_path_steps is None
            else:
                assert episode.obstructed_path_steps > episode.shortest_path_steps
                assert not episode.sealed
            assert episode.sealed == (episode.obstructed_path_m is None)


def test_steps_are_those_of_networkx_and_shapely(houses, episodes):
    for scene in (0, 1):
        house = houses[scene]
        for episode in episodes[scene][:2]:
            start, goal = (episode.start.i, episode.start.j), (episode.goal.i, episode.goal.j)
            still, *obstacles = everything(house, episode)
            assert steps_by_networkx(house, still, start, goal) == episode.shortest_path_steps
            crowded = [*still, *itertools.chain(*obstacles)]
            assert steps_by_networkx(house, crowded, start, goal) == episode.obstructed_path_steps


def test_the_last_obstacle_is_what_made_the_difference(houses, episodes):
    # Spawning stops as soon as the condition holds: without the last one it must not.
    house = houses[0]
    assert {episode.mode for episode in episodes[0][:3]} == {"blocked", "lengthened"}
    for episode in episodes[0][:3]:
        start, goal = (episode.start.i, episode.start.j), (episode.goal.i, episode.goal.j)
        still, *obstacles = everything(house, episode)
        before = [*still, *itertools.chain(*obstacles[:-1])]
        steps = steps_by_networkx(house, before, start, goal)
        assert steps is not None
        assert steps == episode.shortest_path_steps or episode.mode == "blocked"


def test_obstacles_are_relevant_that_belong_to_a_minimal_set_without_which_the_path_is_shorter(
    houses, episodes
):
    stated = set()
    for scene, batch in episodes.items():
        still = house_footprints(houses[scene])
        for episode in batch:
            plans = [footprint(catalogue().assets[o.asset_id], o.pose) for o in episode.obstacles]
            before, changing = episode.obstructed_path_steps, []
            if len(plans) > 6:
                continue
            for size in range(1, len(plans) + 1):
                for removed in map(set, itertools.combinations(range(len(plans)), size)):
                    lattice = Lattice.of_polygons(still, houses[scene].outline)
                    for k in set(range(len(plans))) - removed:
                        lattice.add(plans[k])
                    ends = ((e.i, e.j) for e in (episode.start, episode.goal))
                    steps = lattice.distance(*ends)
                    if steps is not None and (before is None or steps < before):
                        changing.append(removed)
            minimal = [s for s in changing if not any(other < s for other in changing)]
            relevant = [any(k in s for s in minimal) for k in range(len(plans))]
            assert [obstacle.relevant for obstacle in episode.obstacles] == relevant
            stated |= set(relevant)
    assert stated == {True, False}


def test_obstacles_touch_nothing(houses, episodes):
    for scene, batch in episodes.items():
        for episode in batch:
            for first, second in itertools.combinations(everything(houses[scene], episode), 2):
                assert shapely.unary_union(first).distance(shapely.unary_union(second)) > 0.0


def test_start_and_goal_are_apart_and_in_two_rooms(houses, episodes):
    for scene, batch in episodes.items():
        for episode in batch:
            rooms = {r.room_id: shapely.Polygon(r.polygon) for r in houses[scene].rooms}
            for place in (episode.start, episode.goal):
                assert rooms[place.room].covers(shapely.Point(place.x, place.y))
                assert (place.x, place.y) == (0.25 * place.i, 0.25 * place.j)
            assert episode.shortest_path_m >= 2.0
            assert (episode.start.room == episode.goal.room) == (episode.room_count == 1)
            assert (
                episode.shortest_path_m
                >= math.dist((episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y))
                - 1e-4
            )


def test_an_episode_does_not_depend_on_its_neighbours(houses, episodes, pool):
    alone = build_episodes(houses[1], 1, pool, first=4)
    assert alone == (episodes[1][4],)


def test_attempts_differ(houses, episodes, pool):
    again = build_episodes(houses[0], 1, pool, attempt=1)
    assert again[0] != episodes[0][0]


def test_same_episode_in_a_fresh_process(episodes):
    script = (
        "from internav_data.catalog import catalogue\n"
        "from internav_data.houses import build_house, HouseConfig\n"
        "from internav_data.episodes import build_episodes\n"
        "house = build_house(0, 6, HouseConfig(), catalogue())\n"
        "from dataclasses import astuple\n"
        "print(repr(astuple(build_episodes(house, 1, catalogue().spawnable, first=2)[0])))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True
    )
    assert done.stdout.strip() == repr(astuple(episodes[6][2]))


def test_obstacles_stay_at_rest_in_a_whole_scene_of_bullet(houses, episodes):
    # The generator lets each thing fall as if alone; here each falls among all that is near it.
    engine = get_solver()
    assets = {**houses[1].assets, **catalogue().assets}
    for episode in episodes[1][:4]:
        for k, obstacle in enumerate(episode.obstacles):
            here = shapely.union_all(
                [shapely.Polygon(p) for p in footprint(assets[obstacle.asset_id], obstacle.pose)]
            )
            others = [o for j, o in enumerate(episode.obstacles) if j != k]
            things = [t for t in houses[1].objects if assets[t.asset_id].blocks]
            near = [
                Body.of(assets[t.asset_id], t.pose, moves=False)
                for t in (*things, *others)
                if shapely.union_all(
                    [shapely.Polygon(p) for p in footprint(assets[t.asset_id], t.pose)]
                ).distance(here)
                < NEAR_M
            ]
            walls = [wall_body(w) for w in houses[1].walls]
            lifted = Pose(obstacle.x, obstacle.y, obstacle.z + 0.005, obstacle.quaternion)
            body = Body.of(assets[obstacle.asset_id], lifted)
            rest = engine.settle(PhysicsScene((body, *near, *walls)))
            assert rest.at_rest
            assert (
                math.dist(
                    (rest.pose.x, rest.pose.y, rest.pose.z), (obstacle.x, obstacle.y, obstacle.z)
                )
                < 0.005
            )
            corners, _ = asset_corners(assets[obstacle.asset_id])
            assert transform(corners, rest.pose)[:, 2].min() > -0.002


def test_outcomes_and_expert_are_those_of_a_fresh_world(houses, episodes):
    for scene, batch in episodes.items():
        model = HouseModel.of(houses[scene])
        for episode in batch:

            def world(model=model, episode=episode):
                return World.of_episode(model, episode, catalogue().assets)

            assert tuple(o.outcomes for o in episode.obstacles) == outcomes_of(world())
            assert replay(world(), episode.expert.actions) == episode.expert
            # What the columns say of the start is what the world says.
            assert (world().path_steps(), world().obstructed_path_m()) == (
                episode.obstructed_path_steps,
                episode.obstructed_path_m,
            )


def test_the_expert_acts_where_the_grid_is_blocked(episodes):
    listed = list(itertools.chain(*episodes.values()))
    assert all(episode.expert.actions[-1] == Action.DONE for episode in listed)
    blocked = [episode for episode in listed if episode.mode == "blocked"]
    assert len(blocked) == len(listed) // 2
    assert all(episode.expert.pushes + episode.expert.picks >= 1 for episode in blocked)


@pytest.fixture(scope="module")
def refused(pool):
    """A house with an episode whose first draws no expert could solve, and that episode's index."""
    house = build_house(0, 3, HouseConfig(), catalogue())
    for index in range(1, 40, 2):  # of an odd scene these are the blocked ones
        batch = build_batch(house, 1, pool, first=index)
        if batch.redraws.get("no expert"):
            return house, index, batch
    pytest.fail("the expert solves everything in this house: choose another")


def test_an_episode_without_expert_is_drawn_again_and_counted(refused, pool):
    house, index, batch = refused
    (episode,) = batch.episodes
    assert episode.expert is not None
    draws = sum(batch.redraws.values())
    # With one draw less than it took, there is none.
    with pytest.raises(QuarantineError, match=rf"in {draws} draws .*no expert: \d"):
        build_batch(house, 1, pool, EpisodeConfig(max_redraws=draws), first=index)
    again = build_batch(house, 1, pool, EpisodeConfig(max_redraws=draws + 1), first=index)
    assert again == batch


def test_kept_without_expert_it_is_marked_and_has_outcomes(refused, pool):
    house, index, batch = refused
    kept = build_batch(house, 1, pool, EpisodeConfig(keep_unsolvable=True), first=index)
    (episode,) = kept.episodes
    assert episode.expert is None
    assert "no expert" not in kept.redraws
    assert episode != batch.episodes[0]
    world = World.of_episode(HouseModel.of(house), episode, catalogue().assets)
    assert tuple(o.outcomes for o in episode.obstacles) == outcomes_of(world)


def test_redraws_of_a_batch_are_those_of_its_episodes(houses, pool):
    whole = build_batch(houses[6], 4, pool)
    parts = [build_batch(houses[6], 1, pool, first=index) for index in range(4)]
    counts = {}
    for part in parts:
        for reason, count in part.redraws.items():
            counts[reason] = counts.get(reason, 0) + count
    assert dict(whole.redraws) == counts
    assert whole.episodes == tuple(part.episodes[0] for part in parts)


def test_the_push_model_is_the_configs(houses, pool):
    unsolved, kick = EpisodeConfig(keep_unsolvable=True), WorldConfig(push_model="kick")
    model = HouseModel.of(houses[1])
    made = build_episodes(houses[1], 3, pool, unsolved, kick)
    for episode in made:
        world = World.of_episode(model, episode, catalogue().assets, kick)
        assert tuple(o.outcomes for o in episode.obstacles) == outcomes_of(world)
        assert episode.expert is None or replay(world, episode.expert.actions) == episode.expert
    forced = build_episodes(houses[1], 3, pool, unsolved)
    assert [e.obstacles for e in made] != [e.obstacles for e in forced]


def test_an_impossible_episode_is_quarantined_and_named(houses, pool):
    config = EpisodeConfig(max_redraws=2, min_shortest_path_m=1000.0)
    with pytest.raises(QuarantineError, match=r"scene-000006, episode 0: .*blocked in 2 draws"):
        build_episodes(houses[6], 1, pool, config)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("max_spawn_tries", 0),
        ("max_redraws", -1),
        ("gap_m", -0.1),
        ("min_shortest_path_m", 0.0),
        ("lateral_std_m", -1.0),
        ("min_detour_steps", 0),
        ("min_interactions", -1),
        ("min_start_nodes", 0),
    ],
)
def test_invalid_settings_are_refused(field, value):
    with pytest.raises(UsageError, match=f"episodes.{field}: expected .* got {value}"):
        EpisodeConfig(**{field: value}).check()


def test_an_unknown_treatment_of_idle_obstacles_is_refused():
    with pytest.raises(UsageError, match=r"idle_obstacles: expected one of keep, drop, got 'hide'"):
        EpisodeConfig(idle_obstacles="hide").check()


@pytest.fixture(scope="module")
def chosen(houses, pool):
    """Episodes of settings that refuse much, with their draws."""
    config = EpisodeConfig(
        idle_obstacles="drop",
        min_detour_steps=6,
        min_interactions=1,
        refuse_facing_wall=True,
        min_start_nodes=4,
    )
    return build_batch(houses[0], 4, pool, config)


def test_settings_refuse_draws_and_count_them(houses, chosen):
    house, lattice = houses[0], Lattice.of(houses[0])
    ahead = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}
    for episode in chosen.episodes:
        assert all(obstacle.relevant for obstacle in episode.obstacles)
        assert episode.expert.pushes + episode.expert.picks >= 1
        start = episode.start
        assert lattice.edge_free(start.i, start.j, *ahead[start.yaw_deg])
        assert start.faces_wall is False
        crowded = lattice.copy()
        for obstacle in episode.obstacles:
            crowded.add(footprint(catalogue().assets[obstacle.asset_id], obstacle.pose))
        components = crowded.components()
        assert start.reachable_nodes == (components == components[start.i, start.j]).sum() >= 4
        if episode.mode == "lengthened":
            assert episode.obstructed_path_steps >= episode.shortest_path_steps + 6
        world = World.of_episode(HouseModel.of(house), episode, catalogue().assets)
        assert tuple(o.outcomes for o in episode.obstacles) == outcomes_of(world)
        assert replay(world, episode.expert.actions) == episode.expert
    assert chosen.redraws["start faces a wall"] >= 1


def test_experts_with_too_few_interactions_are_refused(houses, episodes, pool):
    few = next(e for e in episodes[0] if e.expert.pushes + e.expert.picks == 1)
    config = EpisodeConfig(min_interactions=2, max_redraws=200)
    batch = build_batch(houses[0], 1, pool, config, first=few.index)
    assert batch.redraws["too few interactions"] >= 1
    assert batch.episodes[0].expert.pushes + batch.episodes[0].expert.picks >= 2


def test_a_start_in_a_pocket_is_refused(houses, pool):
    for index in range(0, 40, 2):  # of an even scene these are the blocked ones
        batch = build_batch(houses[0], 1, pool, first=index)
        nodes = batch.episodes[0].start.reachable_nodes
        if nodes < 40:
            break
    config = EpisodeConfig(min_start_nodes=nodes + 1)
    again = build_batch(houses[0], 1, pool, config, first=index)
    assert again.redraws["start in a pocket"] >= 1
    assert again.episodes[0].start.reachable_nodes > nodes


def test_what_touched_a_dropped_obstacle_as_it_settled_spoils_the_draw(houses, pool, monkeypatch):
    monkeypatch.setattr("internav_data.episodes.idle.settled_at", lambda *_: None)
    config = EpisodeConfig(idle_obstacles="drop", max_redraws=200)
    redraws = build_batch(houses[0], 4, pool, config).redraws
    assert redraws["other rest without idle obstacles"] >= 1


def test_all_spawnable_assets_settle(pool):
    engine = get_solver()
    for asset in pool[::7]:
        rest = engine.settle(PhysicsScene((Body.of(asset, Pose(0.0, 0.0, 0.01, UPRIGHT)),)))
        assert rest.at_rest, asset.asset_id
        assert math.hypot(rest.pose.x, rest.pose.y) < 0.05, asset.asset_id
        assert rest.penetration_m <= 0.002, asset.asset_id
