"""Planning problem of a search: closed nodes and edges, and the objects that block the others."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.navigation import SPACING_M, grid
from internav_data.planner.cost_to_go import bucket_dijkstra, descend
from internav_data.planner.knowledge import NO_KNOWLEDGE
from internav_data.records.agent import CLEARANCE_M

if TYPE_CHECKING:
    from internav_data.core.typing import Costs, Ints, Masks
    from internav_data.planner.knowledge import Knowledge
    from internav_data.world import HouseModel, MovableObject, World

MAX_OBJECTS: Final = 62
"""Number of bits of a mask. Further objects, the farthest from start and goal, count as fixed."""
PICK_PRICE: Final = 1
"""Estimated cost of picking up an object, actions. Lower prices make the search try more and solve
more."""
PUSH_PRICE: Final = 2
"""Estimated cost of pushing an object out of the way, actions."""
FURNITURE_PRICE: Final = 2
"""Extra price of the house's furniture."""
CARRY_PRICE: Final = 3
"""Extra price of picking up an object that must be put down again: hands are real."""
DROP_PRICE: Final = 2
"""Extra price of picking up an object while another one is held."""
EVERYTHING: Final = (1 << MAX_OBJECTS) - 1
"""Bits of all objects: with them banned, a field is that of the lattice as objects lie."""


@lru_cache(maxsize=2)
def _static_blockers(model: HouseModel) -> Masks:
    """Return what fixed objects close, (3, nodes) uint8; cached, read-only."""
    nx, ny = model.lattice.shape
    blockers = np.zeros((3, nx, ny), dtype=np.int32)
    corners = np.ascontiguousarray(model.house.outline, dtype=np.float64)
    grid.close_outside(blockers, corners, SPACING_M)
    plans = model.footprints
    grid.mark(blockers, plans.vertices, plans.offsets, SPACING_M, CLEARANCE_M, 1)
    flags: Masks = (blockers.reshape(3, -1) > 0).astype(np.uint8)
    return flags


@lru_cache(maxsize=2048)
def _blocked_indices(item: MovableObject, nx: int, ny: int) -> Ints:
    """Return the nodes and edges that an object blocks, as indices into a flat (3, nx, ny)."""
    blockers = np.zeros((3, nx, ny), dtype=np.int32)
    plan = item.footprint
    grid.mark(blockers, plan.vertices, plan.offsets, SPACING_M, CLEARANCE_M, 1)
    return np.flatnonzero(blockers).astype(np.int64)


@dataclass(frozen=True, slots=True)
class PlanningProblem:
    """The parts of a search that no action changes: closed edges, movable objects, goal."""

    ny: int
    """Nodes along y."""
    shape: tuple[int, int]
    """Nodes along x and y."""
    fixed: Masks
    """Nonzero where a node or an edge is closed for good, (3, nodes) uint8."""
    objects: tuple[int, ...]
    """Index in the world of the object of each bit."""
    goals: Ints
    """The four poses at the goal, (4,) int64."""
    risks: Ints
    """Price added to that of moving each object, (62,) int64: see `Knowledge.risks`."""

    @staticmethod
    def of(world: World, knowledge: Knowledge = NO_KNOWLEDGE) -> PlanningProblem:
        """Return the planning problem of a world, to an agent of some knowledge."""
        nx, ny = world.model.lattice.shape
        movable: list[int] = []
        lasting: list[int] = []
        for k, item in enumerate(world.items):
            able = item.dynamics.pushable or item.dynamics.pickable
            (movable if able and k not in knowledge.immovable else lasting).append(k)
        ends = (world.position, world.goal_point)
        first = len(world.model.items)
        # Obstacles first, then what is nearest to either end.
        ranked = sorted(
            movable,
            key=lambda k: (k < first, round(min(world.distance_to(k, *end) for end in ends), 6), k),
        )
        fixed = _static_blockers(world.model).copy()
        flat = fixed.reshape(-1)
        for k in (*lasting, *ranked[MAX_OBJECTS:]):
            flat[_blocked_indices(world.items[k], nx, ny)] = 1
        goal = 4 * (world.goal[0] * ny + world.goal[1])
        goals = np.arange(goal, goal + 4, dtype=np.int64)
        risks = np.zeros(MAX_OBJECTS, dtype=np.int64)
        for bit, k in enumerate(ranked[:MAX_OBJECTS]):
            risks[bit] = knowledge.risks.get(k, 0)
        return PlanningProblem(ny, (nx, ny), fixed, tuple(ranked[:MAX_OBJECTS]), goals, risks)

    def masks(self, world: World) -> Ints:
        """Return the bits of the objects that block each node and edge, (3, nodes) int64."""
        masks = np.zeros(self.fixed.shape, dtype=np.int64)
        flat = masks.reshape(-1)
        for bit, k in enumerate(self.objects):
            item = world.items[k]
            if item.pose is not None:
                flat[_blocked_indices(item, *self.shape)] |= 1 << bit
        return masks

    def prices(self, world: World) -> Ints:
        """Return the estimated price of moving each object, (62,) int64.

        Picking up costs more while the hand is full.
        """
        prices = self.risks.copy()
        full = DROP_PRICE if world.held >= 0 else 0
        full += CARRY_PRICE if world.config.hands == "real" else 0
        furniture = len(world.model.items)
        for bit, k in enumerate(self.objects):
            pickable = world.items[k].dynamics.pickable
            prices[bit] += PICK_PRICE + full if pickable else PUSH_PRICE
            # Furniture stands in groups and along walls: its pushes are slow to solve and seldom
            # help.
            prices[bit] += FURNITURE_PRICE if k < furniture else 0
        return prices

    def pose(self, world: World) -> int:
        """Return the number of the agent's pose."""
        return 4 * (world.i * self.ny + world.j) + world.quarter

    def costs(self, masks: Ints, banned: int, prices: Ints, until: int = -1) -> Costs:
        """Return the cost from every pose to the goal, (poses,) int32, without the action Done.

        Parameters as in `bucket_dijkstra`.
        """
        costs: Costs = bucket_dijkstra(
            self.fixed, masks, banned, prices, self.ny, self.goals, until
        )
        return costs

    def path(
        self, masks: Ints, banned: int, prices: Ints, costs: Costs, pose: int
    ) -> tuple[Ints, Ints]:
        """Return the poses down a field to the goal, (n,) int64, and the bits entered on each step.

        `masks` (3, nodes) and `prices` (62,) int64, `costs` (poses,) int32, as the methods above
        return them.
        """
        poses, entered = descend(self.fixed, masks, banned, prices, self.ny, costs, pose)
        return poses, entered

    def reach(self, masks: Ints, pose: int) -> tuple[Costs, Costs]:
        """Return the cost from a pose to every pose, objects as they lie, and its reverse field.

        A path from a to b is a path from b to a with the agent turned round on every node: one
        backward field serves both. Both are (poses,) int32; `walk` takes the reverse one.
        """
        seeds = np.array([turned_round(pose)], dtype=np.int64)
        none = np.zeros(MAX_OBJECTS, dtype=np.int64)
        back: Costs = bucket_dijkstra(self.fixed, masks, EVERYTHING, none, self.ny, seeds, -1)
        return back.reshape(-1, 4)[:, [2, 3, 0, 1]].reshape(-1), back

    def walk(self, masks: Ints, back: Costs, pose: int) -> list[int]:
        """Return the poses from the start of a reverse field to a pose.

        `back` (poses,) int32 as `reach` returns it; `masks` (3, nodes) int64.
        """
        none = np.zeros(MAX_OBJECTS, dtype=np.int64)
        poses, _ = descend(self.fixed, masks, EVERYTHING, none, self.ny, back, turned_round(pose))
        return [turned_round(p) for p in reversed(poses.tolist())]


def turned_round(pose: int) -> int:
    """Return the pose on the same node that faces the other way."""
    return 4 * (pose // 4) + (pose + 2) % 4
