"""Reference policies: the dataset's expert, a blind one, the shortest path, chance."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.evaluation.evaluator import episode_generator
from internav_data.records.errors import UsageError
from internav_data.world import ACTION_COUNT, Action

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.random import Generator
    from numpy.typing import NDArray

    from internav_data.dataset import Dataset
    from internav_data.envs.sensors import Sensor
    from internav_data.evaluation.evaluator import Policy
    from internav_data.navigation import Lattice
    from internav_data.records import Episode
    from internav_data.world import World

    LatticeNode = tuple[int, int]
    ActionPlanner = Callable[[Episode], Sequence[int]]

REFERENCE_POLICIES: Final = ("expert", "blind", "shortest_path", "random")
"""Names of the reference policies."""
_DIRECTIONS: Final = ((1, 0), (0, 1), (-1, 0), (0, -1))
_TURNS: Final[tuple[tuple[int, ...], ...]] = (
    (),
    (Action.ROTATE_LEFT,),
    (Action.ROTATE_LEFT,) * 2,
    (Action.ROTATE_RIGHT,),
)
"""Rotations by the number of quarter turns, counter-clockwise."""


def reference_policy(name: str, dataset: Dataset[Episode]) -> Policy:
    """Return one of `REFERENCE_POLICIES` for a dataset.

    Raises
    ------
    UsageError
        There is no such policy, or the dataset has no experts.
    """
    if name == "random":
        return RandomPolicy()
    if name == "shortest_path":
        return ScriptedPolicy(name, shortest_path_planner(dataset))
    if name == "blind":
        return ScriptedPolicy(name, blind_planner(dataset))
    if name == "expert":
        expert = dataset.to_table(["expert"]).column("expert")
        if len(expert) and expert.null_count == len(expert):
            raise UsageError(
                f"{dataset.path}: no episode has an expert (the dataset is of a version without, "
                "or was made so); generate it anew, or evaluate shortest_path and random alone"
            )
        return ScriptedPolicy(name, expert_actions)
    raise UsageError(
        f"no reference policy is called {name!r}; there are {', '.join(REFERENCE_POLICIES)}"
    )


class ScriptedPolicy:
    """Policy that decides on all actions at an episode's start.

    Parameters
    ----------
    name
        Name of the row in tables.
    plan
        Function that returns the actions for an episode; Done follows where they end without it.
    """

    image_size = 1
    sensors: Sequence[str | Sensor] = ()

    def __init__(self, name: str, plan: ActionPlanner) -> None:
        self.name = name
        self._plan = plan
        self._left: list[deque[int]] = []

    def begin(self, count: int, seed: int) -> None:  # noqa: ARG002 - nothing is random here
        """See `Policy`."""
        self._left = [deque() for _ in range(count)]

    def start(self, slot: int, episode: Episode) -> None:
        """See `Policy`."""
        self._left[slot] = deque(self._plan(episode))

    def act(self, observations: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:  # noqa: ARG002
        """Return the actions of all slots, (n,) int64; see `Policy`."""
        return np.array([left.popleft() if left else Action.DONE for left in self._left], np.int64)


class RandomPolicy:
    """Policy that takes each action with the same probability, Done included."""

    name = "random"
    image_size = 1
    sensors: Sequence[str | Sensor] = ()

    def __init__(self) -> None:
        self._seed = 0
        self._draws: list[Generator | None] = []

    def begin(self, count: int, seed: int) -> None:
        """See `Policy`."""
        self._seed, self._draws = seed, [None] * count

    def start(self, slot: int, episode: Episode) -> None:
        """See `Policy`."""
        self._draws[slot] = episode_generator(self._seed, episode)

    def act(self, observations: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:  # noqa: ARG002
        """Return the actions of all slots, (n,) int64; see `Policy`."""
        drawn = [
            Action.DONE if draw is None else int(draw.integers(ACTION_COUNT))
            for draw in self._draws
        ]
        return np.array(drawn, np.int64)


def expert_actions(episode: Episode) -> Sequence[int]:
    """Return the stored expert's actions; without an expert Done alone, a failure."""
    return (int(Action.DONE),) if episode.expert is None else episode.expert.actions


def blind_planner(dataset: Dataset[Episode]) -> ActionPlanner:
    """Return a planner that knows types' averages and learns by failing (`planner.blind`).

    The averages are those of the dataset's settings: with hidden attributes those of their draws.

    A run that is stored in the dataset is played again. Where the goal cannot be reached, it walks
    to the node in reach that is nearest to it.
    """
    from internav_data.catalog.attributes import hidden_attributes  # noqa: PLC0415
    from internav_data.catalog.config import CatalogConfig  # noqa: PLC0415
    from internav_data.envs.source import open_source  # noqa: PLC0415 - the camera's kernels
    from internav_data.planner.beliefs import type_beliefs  # noqa: PLC0415
    from internav_data.planner.blind import run_blind  # noqa: PLC0415
    from internav_data.world import World  # noqa: PLC0415

    source = open_source(dataset)
    config = source.world_config
    assets = dataset.assets.values()
    spawnable = tuple(asset for asset in assets if asset.spawnable)
    hidden = hidden_attributes(CatalogConfig.of_dataset(dataset.manifest.config), spawnable)
    beliefs = type_beliefs(assets, config.push_spec, hidden)

    def plan(episode: Episode) -> Sequence[int]:
        if episode.blind_expert is not None:
            return episode.blind_expert.actions
        model = source.loaded_house(episode).model
        run = run_blind(World.of_episode(model, episode, dataset.assets, config), beliefs)
        return run.actions if run.reached else (*run.actions, *_approach(run.world))

    return plan


def shortest_path_planner(dataset: Dataset[Episode]) -> ActionPlanner:
    """Return a planner of shortest lattice paths among objects as they lie."""
    from internav_data.envs.source import open_source  # noqa: PLC0415 - the camera's kernels
    from internav_data.world import World  # noqa: PLC0415

    source = open_source(dataset)  # houses are those of environments in this process

    def plan(episode: Episode) -> Sequence[int]:
        model = source.loaded_house(episode).model
        return _approach(World.of_episode(model, episode, dataset.assets))

    return plan


def _approach(world: World) -> list[int]:
    """Return the actions to the goal, or to the node in reach that is nearest to it, and Done."""
    start, goal = (world.i, world.j), world.goal
    if world.lattice.distance(start, goal) is None:
        goal = nearest(world.lattice, world.model.lattice, start, goal)
    return [*shortest(world.lattice, (*start, world.quarter), goal), int(Action.DONE)]


def nearest(lattice: Lattice, clear: Lattice, start: LatticeNode, goal: LatticeNode) -> LatticeNode:
    """Return the node in reach that is nearest to the goal on a lattice without obstacles.

    Ties: fewest steps to walk there, then i, then j.
    """
    walk, rest = lattice.distances(*start), clear.distances(*goal)
    nodes = np.argwhere((walk >= 0) & (rest >= 0))
    if not len(nodes):
        return start
    i, j = nodes[:, 0], nodes[:, 1]
    best = nodes[np.lexsort((j, i, walk[i, j], rest[i, j]))[0]]
    return int(best[0]), int(best[1])


def shortest(lattice: Lattice, start: tuple[int, int, int], goal: LatticeNode) -> list[int]:
    """Return the actions along a shortest path, of all such one with the fewest rotations.

    Parameters
    ----------
    lattice
        Lattice among objects as they lie.
    start
        Node i, j and quarter turns.
    goal
        Node that can be reached from the start.
    """
    steps = lattice.distances(*goal)
    reached: dict[tuple[int, int, int], list[int]] = {start: []}
    for left in range(int(steps[start[0], start[1]]) - 1, -1, -1):
        ahead: dict[tuple[int, int, int], list[int]] = {}
        for (i, j, quarter), actions in reached.items():
            for heading, (di, dj) in enumerate(_DIRECTIONS):
                if not _leads(lattice, steps, (i, j), (di, dj), left):
                    continue
                there = (i + di, j + dj, heading)
                longer = [*actions, *_TURNS[(heading - quarter) % 4], Action.MOVE_AHEAD]
                if there not in ahead or len(longer) < len(ahead[there]):
                    ahead[there] = longer
        reached = ahead
    return min(reached.values(), key=len)


def _leads(
    lattice: Lattice, steps: NDArray[np.int32], node: LatticeNode, step: tuple[int, int], left: int
) -> bool:
    """Return whether a step can be taken and leaves `left` more to the goal."""
    i, j = node[0] + step[0], node[1] + step[1]
    inside = 0 <= i < steps.shape[0] and 0 <= j < steps.shape[1]
    return inside and int(steps[i, j]) == left and lattice.edge_free(*node, *step)
