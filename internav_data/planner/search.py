"""The expert: actions that reach the goal in the true world, cheap in steps.

It gives imitation data and the ceiling of every metric. The problem is navigation among movable
obstacles (NAMO, Stilman and Kuffner 2005). The method is a best-first search over worlds that asks
the true world lazily, for a push costs milliseconds and a field of costs far less:

1. A world's f-cost is the number of actions so far plus an estimate of those ahead: a cost-to-go
   field in which entering the region of a movable object costs a price (`cost_to_go`).
2. Expanding a search node follows its field to the goal. For every object that the path enters, it
   proposes candidates (interactions from the cheapest poses that see the object), and a node in
   which that object is banned, so that the path must go round it.
3. A candidate is carried out in the true world only once it has the least f-cost of all entries. If
   it succeeds, the world after it becomes a search node.

The estimate may be too high, so the first plan need not be the shortest: bounds on tries and a
ratio of acceptance end the search. Every plan is replayed before it is returned.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from heapq import heappop, heappush
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.core.arithmetic import plain_sum
from internav_data.navigation import SPACING_M
from internav_data.planner.cost_to_go import FAR, viewpoints
from internav_data.planner.knowledge import NO_KNOWLEDGE, coarse_position
from internav_data.planner.problem import EVERYTHING, PICK_PRICE, PlanningProblem
from internav_data.planner.push_heuristic import path_marks, pushes_to_clear
from internav_data.records import Expert
from internav_data.world import Action, World
from internav_data.world.actions import HORIZONS_DEG, PUSHES
from internav_data.world.config import DEFAULT_WORLD
from internav_data.world.occlusion import placed_occlusion_shape

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from internav_data.core.typing import Costs, Ints
    from internav_data.planner.knowledge import Knowledge
    from internav_data.records import Asset, Episode
    from internav_data.world import HouseModel
    from internav_data.world.config import WorldConfig


@dataclass(slots=True, eq=False)
class SearchState:
    """A world that the search has reached, and the actions that lead to it."""

    world: World
    """The world; never changed."""
    actions: tuple[int, ...]
    masks: Ints
    """Bits of the objects that block each node and edge, (3, nodes) int64."""
    prices: Ints
    """Estimated price of moving each object, (62,) int64."""
    last: tuple[int, int] = (-1, -1)
    """Index of the object pushed last, and the heading of that push in the house."""
    penalty: int = 0
    """Penalty in the f-costs of its entries, for pushes that looked unlikely to help."""
    proposed: int = 0
    """Bits of the objects for which candidates were proposed."""
    visited: set[int] = field(default_factory=set)
    """Sets of banned objects, as bits, for which a search node was made."""

    @property
    def spent(self) -> int:
        """Count the actions so far."""
        return len(self.actions)


@dataclass(frozen=True, slots=True, eq=False)
class SearchNode:
    """A world to expand under the assumption that some objects are not moved."""

    state: SearchState
    banned: int
    """Bits of the objects that are not moved."""
    costs: Costs
    """Cost-to-go field under that assumption, (poses,) int32."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """An interaction, from a pose, that the true world has not been asked about."""

    state: SearchState
    pose: int
    """Pose, as a number, from which the agent acts."""
    horizon: int
    """Index into HORIZONS_DEG of the camera's angle."""
    action: Action
    back: Costs
    """Reverse field of `PlanningProblem.reach`, which gives the walk to the pose."""
    fallback: Candidate | None = None
    """The same interaction from another node, where the agent may be less in the way."""
    f_cost: int = 0
    last: tuple[int, int] = (-1, -1)
    """`SearchState.last` of the world after it."""
    penalty: int = 0
    """`SearchState.penalty` of the world after it."""
    index: int = -1
    """Index of the object acted on."""
    repeats: int = 1
    """Number of times in a row, from the same pose: pushes of a short distance come in runs."""


def bits_in_order(entered: Iterable[int]) -> tuple[int, ...]:
    """Return the bits of masks in the order in which they first appear, low ones first."""
    bits: dict[int, None] = {}
    for mask in entered:
        left = mask
        # x & -x is the lowest bit that is set.
        while left:
            low = left & -left
            bits[low.bit_length() - 1] = None
            left ^= low
    return tuple(bits)


def moves(poses: Sequence[int]) -> tuple[int, ...]:
    """Return the actions that lead through poses, each one action after the last."""
    actions = []
    for before, after in pairwise(poses):
        if before // 4 != after // 4:
            actions.append(int(Action.MOVE_AHEAD))
        elif (after - before) % 4 == 1:
            actions.append(int(Action.ROTATE_LEFT))
        else:
            actions.append(int(Action.ROTATE_RIGHT))
    return tuple(actions)


def looks_between(horizon_deg: int, horizon: int) -> tuple[int, ...]:
    """Return the actions that turn the camera to a horizon, an index into HORIZONS_DEG."""
    steps = horizon - HORIZONS_DEG.index(horizon_deg)
    action = Action.LOOK_DOWN if steps > 0 else Action.LOOK_UP
    return (int(action),) * abs(steps)


MAX_TRIES: Final = 10
"""Maximum number of interactions tried in the true world. Objects that are too heavy do not count,
nor do pushes that continue the last one. 10 tries solve 98 % of the blocked episodes that 16 solve,
in 2/3 of the time; most time is spent on unsolvable episodes."""
MAX_QUERIES: Final = 20
"""Maximum number of interactions asked in all, pushes that continue the last one included."""
MAX_MOVERS: Final = 1
"""Largest estimate (`World.count_movers`) of the further objects that a push moves, for it to be
tried; others cost most and seldom help."""
MAX_EXTRA_TRIES: Final = 2
"""Maximum number of tries once a plan is known: of 400 plans a third try shortens 2."""
ACCEPT_RATIO: Final = 0.95
"""Share of a plan's length. The plan is accepted once no entry has an f-cost below it."""
MAX_EXPANSIONS: Final = 150
"""Maximum number of entries taken from the queue."""
MAX_VIEWPOINTS: Final = 40
"""Maximum number of poses tested for seeing an object."""
PUSH_NODES: Final = 2
"""Number of nodes from which an object is pushed: at one of them the agent may be in the way."""
TURN_PENALTY: Final = 2
"""Penalty of pushing an object in another direction than just before: pushes mostly continue."""
UNLIKELY_PENALTY: Final = 2
"""Penalty of a push that would not clear the path by the heuristic. It is asked later, not never:
the heuristic leaves out turning and toppling."""

_VIEWS: Final = np.array(
    [(math.cos(math.radians(d)), math.sin(math.radians(d))) for d in HORIZONS_DEG]
)
_RANKS: Final = {
    Action.PICKUP: 1,
    Action.PUSH_LEFT: 2,
    Action.PUSH_RIGHT: 2,
    Action.PUSH_AHEAD: 3,
    Action.PUSH_BACK: 4,
    Action.DROP: 5,
}
"""Order of entries of equal f-cost, lowest first; a search node's rank is 0."""
_AGENTS_FAULT: Final = ("the agent is in the way", "would come to lie on the agent")
"""Failures that another position of the agent may avoid."""
_PUSHES: Final = (Action.PUSH_LEFT, Action.PUSH_RIGHT, Action.PUSH_AHEAD, Action.PUSH_BACK)


def search(world: World, limit: int, knowledge: Knowledge = NO_KNOWLEDGE) -> tuple[int, ...] | None:
    """Find actions that end with Done at the goal.

    A pure function of the world, bounded by counts and never by time.

    Parameters
    ----------
    world
        World to begin in; it is not changed.
    limit
        Maximum number of actions, Done included.
    knowledge
        Facts that the world does not show; for agents that act in another one.

    Returns
    -------
    tuple of int or None
        Numbers of the actions; None if no plan was found.

    """
    return _BestFirstSearch(world, limit, knowledge).run()


class _BestFirstSearch:
    def __init__(self, world: World, limit: int, knowledge: Knowledge) -> None:
        self.problem = PlanningProblem.of(world, knowledge)
        self.knowledge = knowledge
        self.best: tuple[int, ...] | None = None
        self.bound = limit + 1
        """Length below which a plan is an improvement."""
        self.tries_left = MAX_TRIES * (2 if world.config.hands == "real" else 1)
        self.queries_left = MAX_QUERIES
        self.queue: list[tuple[int, int, int, SearchNode | Candidate]] = []
        self.entries = 0
        self.known: dict[tuple[object, ...], int] = {}
        self._enter(world.copy(), ())

    def run(self) -> tuple[int, ...] | None:
        for _ in range(MAX_EXPANSIONS):
            if not self.queue or self.tries_left <= 0 or self.queries_left <= 0:
                break
            f_cost, _, _, entry = heappop(self.queue)
            if f_cost >= self.bound or (self.best and f_cost > self.bound * ACCEPT_RATIO):
                break
            if isinstance(entry, SearchNode):
                self._expand(entry, f_cost)
            else:
                self._attempt(entry)
        return self.best

    def _push(self, f_cost: int, rank: int, entry: SearchNode | Candidate) -> None:
        if f_cost < self.bound:
            heappush(self.queue, (f_cost, rank, self.entries, entry))
            self.entries += 1

    def _enter(
        self,
        world: World,
        actions: tuple[int, ...],
        last: tuple[int, int] = (-1, -1),
        penalty: int = 0,
    ) -> None:
        """Add a world to the search, unless it was reached as cheaply before."""
        # Poses differ in their last digits with every history: worlds are compared coarsely.
        poses = tuple(coarse_position(world.items[k].pose) for k in self.problem.objects)
        agent = (world.i, world.j, world.quarter, world.horizon_deg)
        key = (*agent, world.held, world.interaction, poses)
        if self.known.get(key, FAR) <= len(actions):
            return
        self.known[key] = len(actions)
        masks, prices = self.problem.masks(world), self.problem.prices(world)
        state = SearchState(world, actions, masks, prices, last, penalty)
        self._consider(state, 0)

    def _consider(self, state: SearchState, banned: int) -> None:
        """Put a search node into the queue, if the goal may be reached from its world."""
        if banned in state.visited:
            return
        state.visited.add(banned)
        here = self.problem.pose(state.world)
        costs = self.problem.costs(state.masks, banned, state.prices, here)
        ahead = int(costs[here])
        if ahead < FAR:
            self._push(state.spent + ahead + 1 + state.penalty, 0, SearchNode(state, banned, costs))

    def _expand(self, node: SearchNode, f_cost: int) -> None:
        state, problem = node.state, self.problem
        pose = problem.pose(state.world)
        poses, entered = problem.path(state.masks, node.banned, state.prices, node.costs, pose)
        bits = bits_in_order(entered.tolist())
        if not bits and not state.world.carrying:
            self._accept(state, poses.tolist())
            return
        if node.banned == 0 and not state.world.carrying:
            # Before any interaction is tried: a short way round may make all of them needless.
            self._detour(state, pose)
            if f_cost >= self.bound:
                return
        for bit in bits:
            self._consider(state, node.banned | 1 << bit)
        reach, back = problem.reach(state.masks, pose)
        full = state.world.held >= 0
        wanted = False
        path = path_marks(poses.tolist(), problem.fixed.shape[1])
        for bit in bits:
            # Once per world: other nodes of it lead to the same interactions.
            if not state.proposed >> bit & 1:
                state.proposed |= 1 << bit
                dynamics = state.world.items[problem.objects[bit]].dynamics
                wanted |= dynamics.pickable
                if dynamics.pushable or not full:
                    self._propose(node, bit, reach, back, path)
        # What can block is put down before anything else, and before Done.
        if full and (wanted or state.world.carrying):
            first = int(np.flatnonzero(entered)[0]) if bits else len(poses) - 1
            self._propose_drops(node, poses[: first + 1].tolist(), reach, back)

    def _detour(self, state: SearchState, pose: int) -> None:
        """Accept the path without any interaction, if there is one: it bounds all plans."""
        problem = self.problem
        costs = problem.costs(state.masks, EVERYTHING, state.prices, pose)
        if costs[pose] < FAR:
            poses, _ = problem.path(state.masks, EVERYTHING, state.prices, costs, pose)
            self._accept(state, poses.tolist())

    def _accept(self, state: SearchState, poses: Sequence[int]) -> None:
        actions = (*state.actions, *moves(poses), int(Action.DONE))
        if len(actions) < self.bound:
            if self.best is None:
                self.tries_left = min(self.tries_left, MAX_EXTRA_TRIES)
            self.best, self.bound = actions, len(actions)

    def _propose(self, node: SearchNode, bit: int, reach: Costs, back: Costs, path: Ints) -> None:
        """Propose to push an object, or to pick it up, from the cheapest poses that see it."""
        state, problem = node.state, self.problem
        index = problem.objects[bit]
        item = state.world.items[index]
        if item.pose is None:
            return
        # The cost beyond the interaction, as if it had moved the object out of every path.
        prices = state.prices.copy()
        prices[bit] = 0
        after = problem.costs(state.masks, node.banned, prices)
        points = placed_occlusion_shape(item.asset, item.pose).points
        now = HORIZONS_DEG.index(state.world.horizon_deg)
        looks = np.abs(np.arange(len(HORIZONS_DEG)) - now)
        found = viewpoints(points, reach, problem.ny, _VIEWS, looks, after)
        pick = item.dynamics.pickable
        probe = state.world.copy()
        # `viewpoints` knows nothing of occlusion and of other objects nearer by: the world decides.
        places: list[tuple[int, int, int]] = []
        for place in zip(*(f[:MAX_VIEWPOINTS].tolist() for f in found), strict=True):
            if all(place[0] // 4 != known[0] // 4 for known in places):
                self._place(probe, *place[:2])
                if probe.target(pick=pick) == index:
                    places.append(place)
                    if len(places) == (1 if pick else PUSH_NODES):
                        break
        if pick and places:
            self._offer(state, index, Action.PICKUP, places, back)
        elif places:
            counts = pushes_to_clear(state.world, index, path, problem.shape)
            for action in _PUSHES:
                self._offer(state, index, action, places, back, counts)

    def _offer(
        self,
        state: SearchState,
        index: int,
        action: Action,
        places: Sequence[tuple[int, int, int]],
        back: Costs,
        counts: tuple[int, ...] = (),
    ) -> None:
        """Put an interaction from the first place into the queue; the others are its fallbacks."""
        # From the last place to the first, so that each candidate holds the next as its fallback.
        entry = None
        for pose, horizon, cost in reversed(places):
            penalty, last, repeats = state.penalty, (-1, -1), 1
            if action.kind == "push":
                last = (index, (pose + action.quarter_turns) % 4)
                turn = (last[1] - state.last[1]) % 4 if state.last[0] == index else 0
                if turn == 2:  # noqa: PLR2004 - to and fro
                    continue
                penalty += TURN_PENALTY if turn else 0
                repeats = counts[last[1]] or 1
                if last != state.last and not counts[last[1]]:
                    penalty += UNLIKELY_PENALTY
            f_cost = state.spent + cost + repeats + penalty
            entry = Candidate(
                *(state, pose, horizon, action, back, entry, f_cost, last, penalty),
                index=index,
                repeats=repeats,
            )
        if entry is not None:
            self._push(entry.f_cost, _RANKS[action], entry)

    def _propose_drops(
        self, node: SearchNode, path: Sequence[int], reach: Costs, back: Costs
    ) -> None:
        """Propose to drop the held object on the path to the next object to pick up."""
        state, problem = node.state, self.problem
        prices = state.prices.copy()
        for bit, index in enumerate(problem.objects):
            if state.world.items[index].dynamics.pickable:
                prices[bit] = PICK_PRICE
        after = problem.costs(state.masks, node.banned, prices)
        horizon = HORIZONS_DEG.index(state.world.horizon_deg)
        nodes = dict.fromkeys(path[place] // 4 for place in (0, len(path) // 2, len(path) - 1))
        for k in nodes:
            for pose in range(4 * k, 4 * k + 4):
                cost = int(reach[pose]) + int(after[pose]) + 2 + state.penalty
                entry = Candidate(state, pose, horizon, Action.DROP, back, index=state.world.held)
                self._push(state.spent + cost, _RANKS[Action.DROP], entry)

    def _attempt(self, entry: Candidate) -> None:
        """Carry out a candidate in the true world; on success add the world after it."""
        state, problem = entry.state, self.problem
        if entry.action.kind == "push" and state.world.count_movers(*entry.last) > MAX_MOVERS:
            return
        world = state.world.copy()
        if world.carrying and not self._walks(world, entry):
            return  # what is held is in the way
        self._place(world, entry.pose, entry.horizon)
        if self.knowledge.excludes(world, entry.action, entry.index):
            if entry.fallback is not None:
                self._push(entry.fallback.f_cost, _RANKS[entry.action], entry.fallback)
            return
        result = world.step(entry.action)
        pushes = 1 + self._repeat(world, entry) if result.success else 0
        # The push of an object alone is cached: finding it too heavy costs next to nothing.
        if result.cause != "too heavy":
            self.queries_left -= 1
            goes_on = result.success and entry.last == state.last
            self.tries_left -= not goes_on
        if result.success:
            walk = moves(problem.walk(state.masks, entry.back, entry.pose))
            looks = looks_between(state.world.horizon_deg, entry.horizon)
            actions = (*state.actions, *walk, *looks, *[int(entry.action)] * pushes)
            self._enter(world, actions, entry.last, entry.penalty)
        elif entry.fallback is not None and result.cause in _AGENTS_FAULT:
            self._push(entry.fallback.f_cost, _RANKS[entry.action], entry.fallback)

    def _walks(self, world: World, entry: Candidate) -> bool:
        """Walk to the pose of a candidate in a world, which this changes; return whether it can."""
        walk = self.problem.walk(entry.state.masks, entry.back, entry.pose)
        return all(world.step(action).success for action in moves(walk))

    def _repeat(self, world: World, entry: Candidate) -> int:
        """Push on in a world, which this changes, while it is likely to help; count the pushes."""
        for count in range(entry.repeats - 1):
            if (
                world.target(pick=False) != entry.index
                or world.count_movers(*entry.last) > MAX_MOVERS
                or self.knowledge.excludes(world, entry.action, entry.index)
                or not world.step(entry.action).success
            ):
                return count
        return entry.repeats - 1

    def _place(self, world: World, pose: int, horizon: int) -> None:
        node, world.quarter = divmod(pose, 4)
        world.i, world.j = divmod(node, self.problem.ny)
        world.horizon_deg = HORIZONS_DEG[horizon]


MAX_STEPS: Final = 500
"""Maximum number of actions of an episode."""


def solve(world: World, limit: int = MAX_STEPS) -> Expert | None:
    """Search for a plan from a world, and replay it in a world in the same state.

    Parameters
    ----------
    world
        World to begin in; it is not changed.
    limit
        Maximum number of actions, Done included.

    Returns
    -------
    Expert or None
        None if no plan was found within the search's bounds: no object that blocks the path can
        be moved, or moving it does not help.

    """
    actions = search(world, limit)
    return None if actions is None else replay(world.copy(), actions)


def expert_of_episode(
    model: HouseModel,
    episode: Episode,
    assets: Mapping[str, Asset],
    config: WorldConfig = DEFAULT_WORLD,
) -> Expert | None:
    """Solve an episode from its start.

    Parameters as in `World.of_episode`, result as in `solve`.

    Raises
    ------
    UsageError
        The model is of another house.

    """
    return solve(World.of_episode(model, episode, assets, config))


def replay(world: World, actions: Sequence[int]) -> Expert | None:
    """Carry out actions in a world, which they change, and count them.

    Returns
    -------
    Expert or None
        None unless every action succeeds and the last one is Done at the goal.

    """
    counts: Counter[int] = Counter()
    for action in actions:
        if not world.step(action).success:
            return None
        counts[action] += 1
    if not actions or actions[-1] != Action.DONE:
        return None
    return Expert(
        actions=tuple(int(action) for action in actions),
        steps=len(actions),
        pushes=plain_sum(counts[push] for push in PUSHES),
        picks=counts[Action.PICKUP],
        path_m=SPACING_M * counts[Action.MOVE_AHEAD],
    )
