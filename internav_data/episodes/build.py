"""Generation of episodes: start and goal, obstacles on the path, an expert, and outcomes.

An episode is drawn again until its mode's condition holds and an expert is found, at most
`max_redraws` times. Poses are rounded before a predicate is judged, so that the stored values alone
decide, for the generator and the validator alike.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from internav_data.catalog.attributes import DRAWS
from internav_data.episodes.config import EpisodeConfig
from internav_data.episodes.idle import drop_idle, relevance_of
from internav_data.episodes.outcomes import outcomes_of
from internav_data.episodes.pool import ObstaclePool
from internav_data.episodes.site import SpawnSite
from internav_data.episodes.spawn import EpisodeDraft, spawn
from internav_data.geometry import round_m
from internav_data.navigation import SPACING_M, node_paths
from internav_data.physics import get_solver
from internav_data.physics.config import DEFAULT_PHYSICS
from internav_data.planner.blind import run_blind
from internav_data.planner.search import solve
from internav_data.records import (
    Episode,
    Goal,
    Mode,
    Obstacle,
    Physics,
    Purpose,
    Start,
    generator,
)
from internav_data.records.errors import QuarantineError
from internav_data.world import World
from internav_data.world.config import DEFAULT_WORLD
from internav_data.world.world import AHEAD

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.random import Generator

    from internav_data.catalog.attributes import HiddenAttributes
    from internav_data.episodes.spawn import Spawned
    from internav_data.physics.config import PhysicsConfig
    from internav_data.planner.beliefs import TypeBelief
    from internav_data.records import Asset, Expert, House, Outcome, Redraw
    from internav_data.world.config import WorldConfig

PAIRS = 64
"""Maximum number of pairs of nodes drawn for one start and goal; most are far enough apart."""


@dataclass(frozen=True, slots=True)
class EpisodeBatch:
    """Episodes of a house, with the number of draws that were discarded for them."""

    episodes: tuple[Episode, ...]
    redraws: Mapping[str, int]
    """Number of discarded draws by reason (a `Redraw`); absent reasons did not occur."""


def build_episodes(
    house: House,
    count: int,
    pool: Sequence[Asset],
    config: EpisodeConfig | None = None,
    world_config: WorldConfig = DEFAULT_WORLD,
    *,
    first: int = 0,
    attempt: int = 0,
    hidden: HiddenAttributes | None = None,
    beliefs: Mapping[str, TypeBelief] | None = None,
    physics: PhysicsConfig = DEFAULT_PHYSICS,
) -> tuple[Episode, ...]:
    """Build the episodes first … first + count - 1 of a house.

    Each episode is a pure function of the house, its index, the pool, the settings and the attempt;
    none depends on the others.

    Parameters
    ----------
    house
        A furnished house.
    count, first
        Number of episodes, and the index of the first.
    pool
        Assets to draw obstacles from, in a fixed order.
    config
        Settings; None for the calibrated defaults.
    world_config
        Settings of the world.
    attempt
        Sub-seed: 0 unless an earlier attempt at the scene failed.
    hidden
        Distribution of the obstacles' attributes; None where their look tells them.
    beliefs
        Beliefs about the catalogue's types (`planner.beliefs.type_beliefs`) of the blind expert;
        None for no such expert.
    physics
        Settings of physics: the engine, and whether another one is asked too.

    Raises
    ------
    UsageError
        No physics engine has the name, or all assets have weight 0.
    QuarantineError
        An episode cannot be made within the bounds of the settings.

    """
    batch = build_batch(
        *(house, count, pool, config, world_config),
        first=first,
        attempt=attempt,
        hidden=hidden,
        beliefs=beliefs,
        physics=physics,
    )
    return batch.episodes


def build_batch(
    house: House,
    count: int,
    pool: Sequence[Asset],
    config: EpisodeConfig | None = None,
    world_config: WorldConfig = DEFAULT_WORLD,
    *,
    first: int = 0,
    attempt: int = 0,
    hidden: HiddenAttributes | None = None,
    beliefs: Mapping[str, TypeBelief] | None = None,
    before_draw: Callable[[], None] = lambda: None,
    physics: PhysicsConfig = DEFAULT_PHYSICS,
) -> EpisodeBatch:
    """Build episodes and count the discarded draws.

    Parameters and errors as in `build_episodes`. `before_draw` is called before each draw of a
    start and goal; what it raises ends the batch.
    """
    config = config or EpisodeConfig()
    settings = _BatchSettings(world_config, beliefs, before_draw)
    site, weighed = SpawnSite.of(house, hidden, physics), ObstaclePool.of(pool, config)
    redraws: Counter[Redraw] = Counter()
    episodes = []
    for index in range(first, first + count):
        episode, again = _build_episode(site, index, weighed, config, settings, attempt)
        episodes.append(episode)
        redraws += again
    return EpisodeBatch(tuple(episodes), dict(sorted(redraws.items())))


class _BatchSettings(NamedTuple):
    """Settings of all episodes of a batch."""

    world_config: WorldConfig
    beliefs: Mapping[str, TypeBelief] | None
    """Beliefs of the blind expert; None for no such expert."""
    before_draw: Callable[[], None]
    """Called before each draw."""


def mode_of(scene: int, index: int) -> Mode:
    """Return the mode of an episode by its index.

    The modes alternate, so that every part of a dataset holds both evenly.
    """
    return "blocked" if (scene + index) % 2 == 0 else "lengthened"


def _build_episode(
    site: SpawnSite,
    index: int,
    pool: ObstaclePool,
    config: EpisodeConfig,
    settings: _BatchSettings,
    attempt: int,
) -> tuple[Episode, Counter[Redraw]]:
    """Draw until an episode is complete; return it and the reasons of the discarded draws."""
    house = site.house
    again: Counter[Redraw] = Counter()
    for draw in range(config.max_redraws):
        settings.before_draw()
        drawn = _draw(site, index, pool, config, settings, (house.scene, attempt, index, draw))
        if isinstance(drawn, Episode):
            return drawn, again
        again[drawn] += 1
    reasons = ", ".join(f"{reason}: {count}" for reason, count in sorted(again.items()))
    raise QuarantineError(
        f"{house.scene_id}, episode {index}: no start and goal could be "
        f"{mode_of(house.scene, index)} in {config.max_redraws} draws ({reasons}); "
        "raise episodes.max_obstacles or episodes.max_redraws, or furnish less"
    )


def _draw(
    site: SpawnSite,
    index: int,
    pool: ObstaclePool,
    config: EpisodeConfig,
    settings: _BatchSettings,
    key: tuple[int, int, int, int],
) -> Episode | Redraw:
    """Draw a start, a goal and obstacles: return an episode, or the reason to draw again."""
    draft = _drawn(site, index, pool, config, key)
    if not isinstance(draft, EpisodeDraft):
        return draft
    world = World(
        site.model,
        [obstacle.body for obstacle in draft.obstacles],
        (*draft.start, draft.quarter),
        draft.goal,
        settings.world_config,
        site.physics.engine,
        [obstacle.affordance for obstacle in draft.obstacles],
    )
    # The expert comes first: an episode without one is discarded and needs no outcomes.
    expert = solve(world)
    if expert is None and not config.keep_unsolvable:
        return "no expert"
    if expert is not None and expert.pushes + expert.picks < config.min_interactions:
        return "too few interactions"
    blind = None if settings.beliefs is None else run_blind(world, settings.beliefs).expert
    return _recorded(draft, index, world, expert, blind)


def _drawn(
    site: SpawnSite,
    index: int,
    pool: ObstaclePool,
    config: EpisodeConfig,
    key: tuple[int, int, int, int],
) -> EpisodeDraft | Redraw:
    """Return a draft whose obstacles fulfil the condition of its mode, or why there is none."""
    # Two streams per draw: the obstacles' many numbers do not shift those of the start's heading.
    seed = site.house.seed
    place = generator(seed, Purpose.EPISODE, *key)
    draft = _draw_endpoints(site, mode_of(site.house.scene, index), config, place)
    if draft is None:
        return "no two nodes far enough apart"
    draft.quarter = int(place.integers(4))
    if config.refuse_facing_wall and _faces_wall(draft):
        return "start faces a wall"
    if site.hidden is not None:
        count = config.max_obstacles_for(len(site.house.rooms))
        numbers = generator(seed, Purpose.OBSTACLE_ATTRIBUTES, *key)
        draft.attribute_draws = numbers.random((count, DRAWS))
    if not spawn(draft, pool, generator(seed, Purpose.SPAWN, *key)):
        return "condition not reached"
    if config.idle_obstacles == "drop" and not drop_idle(draft):
        return "other rest without idle obstacles"
    if _reachable_nodes(draft) < config.min_start_nodes:
        return "start in a pocket"
    return draft


def _draw_endpoints(
    site: SpawnSite, mode: Mode, config: EpisodeConfig, rng: Generator
) -> EpisodeDraft | None:
    """Draw a start and a goal, in different rooms if the house has two; None if all are too close.

    Rooms are drawn first, then a node in each: if nodes were drawn at once, large rooms would be in
    most pairs and long room paths rare.
    """
    # Furniture may shut a room off from the largest component: two rooms of it are needed, or the
    # only one of a house of one room.
    rooms = np.unique(site.rooms)
    if len(rooms) < min(2, len(site.house.rooms)):
        return None
    for _ in range(PAIRS):
        chosen = rng.choice(rooms, size=2, replace=len(rooms) == 1)
        first, second = (int(rng.choice(np.flatnonzero(site.rooms == room))) for room in chosen)
        shortest_path_m = site.tangent_graph.distance(
            _point(_node(site, first)), _point(_node(site, second))
        )
        # Rounded first: the validator sees the stored length.
        if shortest_path_m is not None and round_m(shortest_path_m) >= config.min_shortest_path_m:
            return _begin(site, mode, config, first, second, round_m(shortest_path_m))
    return None


def _begin(
    site: SpawnSite,
    mode: Mode,
    config: EpisodeConfig,
    first: int,
    second: int,
    shortest_path_m: float,
) -> EpisodeDraft | None:
    """Gather the facts about a start and a goal before any obstacle is spawned."""
    start, goal = _node(site, first), _node(site, second)
    here, there = _point(start), _point(goal)
    # Within one component of the lattice there is a path; None only guards the type.
    shortest_path_steps = site.lattice.distance(start, goal)
    if shortest_path_steps is None:
        return None
    rooms, cut = site.room_paths(int(site.rooms[first]), int(site.rooms[second]))
    nodes, nodes_cut = node_paths(site.house, here, there, rooms)
    return EpisodeDraft(
        site=site,
        config=config,
        mode=mode,
        start=start,
        goal=goal,
        start_room=int(site.rooms[first]),
        goal_room=int(site.rooms[second]),
        room_paths=rooms,
        room_paths_truncated=cut,
        node_paths=nodes,
        node_paths_truncated=nodes_cut,
        lattice=site.lattice.copy(),
        shortest_path_m=shortest_path_m,
        shortest_path_steps=shortest_path_steps,
        steps=shortest_path_steps,
    )


def _node(site: SpawnSite, index: int) -> tuple[int, int]:
    i, j = site.nodes[index]
    return int(i), int(j)


def _point(node: tuple[int, int]) -> tuple[float, float]:
    return SPACING_M * node[0], SPACING_M * node[1]


def _faces_wall(draft: EpisodeDraft) -> bool:
    """Return whether a wall or furniture blocks the first step ahead from the start."""
    return not draft.site.lattice.edge_free(*draft.start, *AHEAD[draft.quarter])


def _reachable_nodes(draft: EpisodeDraft) -> int:
    """Return the number of nodes that a draft's obstacles leave within reach of the start."""
    return int(np.count_nonzero(draft.lattice.distances(*draft.start) >= 0))


def _recorded(
    draft: EpisodeDraft, index: int, world: World, expert: Expert | None, blind: Expert | None
) -> Episode:
    """Turn a finished draft into an episode; its predicates are judged on the rounded poses."""
    # The lattice distance is known from spawning; outcomes need both distances before any of them.
    house, obstructed_path_m = draft.site.house, world.obstructed_path_m()
    other_engine = draft.site.physics.other_engine
    outcomes = outcomes_of(world, (draft.steps, obstructed_path_m), other_engine)
    movable = [world.moves_alone(index) for index in world.obstacles]
    relevant = relevance_of(draft)
    return Episode(
        episode_id=f"{house.scene_id}/{index:04d}",
        scene_id=house.scene_id,
        split=house.split,
        index=index,
        seed=house.seed,
        room_count=len(house.rooms),
        mode=draft.mode,
        sealed=obstructed_path_m is None,
        rooms_on_path=len(draft.room_paths[0]),
        obstacle_count=len(draft.obstacles),
        shortest_path_m=draft.shortest_path_m,
        shortest_path_steps=draft.shortest_path_steps,
        obstructed_path_m=obstructed_path_m,
        obstructed_path_steps=draft.steps,
        start=_start(draft),
        goal=Goal(*draft.goal, *_point(draft.goal), draft.goal_room),
        room_paths=draft.room_paths,
        room_paths_truncated=draft.room_paths_truncated,
        node_paths=draft.node_paths,
        node_paths_truncated=draft.node_paths_truncated,
        obstacles=tuple(map(_obstacle, draft.obstacles, outcomes, relevant, movable)),
        expert=expert,
        physics=_physics(draft),
        blind_expert=blind,
        agreed=(
            None
            if other_engine is None
            else all(outcome.agrees is not False for five in outcomes for outcome in five)
        ),
    )


def _start(draft: EpisodeDraft) -> Start:
    return Start(
        *draft.start,
        *_point(draft.start),
        yaw_deg=90 * draft.quarter,
        room=draft.start_room,
        faces_wall=_faces_wall(draft),
        reachable_nodes=_reachable_nodes(draft),
    )


def _obstacle(
    spawned: Spawned, outcomes: tuple[Outcome, ...], relevant: bool, movable: bool
) -> Obstacle:
    asset, pose, dynamics = spawned.asset, spawned.settled.pose, spawned.dynamics
    return Obstacle(
        asset_id=asset.asset_id,
        type=asset.type,
        x=pose.x,
        y=pose.y,
        z=pose.z,
        quaternion=pose.quaternion,
        mass_kg=dynamics.mass_kg,
        friction=dynamics.friction,
        pushable=dynamics.pushable,
        pickable=dynamics.pickable,
        node_path_segment=spawned.segment,
        settle_s=spawned.settled.seconds,
        settle_penetration_m=spawned.settled.penetration_m,
        outcomes=outcomes,
        relevant=relevant,
        movable=movable,
        affordance=spawned.affordance,
    )


def _physics(draft: EpisodeDraft) -> Physics:
    physics = draft.site.physics
    engine = get_solver(physics.engine)
    other = None if physics.other_engine is None else get_solver(physics.other_engine)
    return Physics(
        engine=engine.name,
        build=engine.build,
        settle_s=max(o.settled.seconds for o in draft.obstacles),
        penetration_m=max(o.settled.penetration_m for o in draft.obstacles),
        other_engine=None if other is None else other.name,
        other_build=None if other is None else other.build,
    )
