"""Fields of cost over poses, for the expert: numba kernels.

A pose is a number: 4 * (i * ny + j) + quarter. Every action costs one. Things that can be moved do
not close an edge but add a price, once, when the way enters what they block.
"""

# numba's njit is untyped, and so is what it returns.
# mypy: allow-untyped-decorators, no-warn-return-any

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numba import njit

from internav_data.navigation import SPACING_M
from internav_data.navigation.grid import EAST, NODE, NORTH
from internav_data.world.visibility import CAMERA_M, REACH_M

if TYPE_CHECKING:
    from internav_data.core.typing import Costs, Floats, Ints, Masks

FAR: Final = 1_000_000
"""Cost of a pose that is cut off."""
BUCKETS: Final = 128
"""More than any single step can cost: prices are cut there."""
SLACK_M: Final = 1e-6
"""Poses are only proposed here: the world says what it sees."""


@njit(cache=True)
def _ahead(node: int, quarter: int, ny: int) -> int:
    if quarter == 0:
        return node + ny
    if quarter == 1:
        return node + 1
    if quarter == 2:  # noqa: PLR2004 - the third quarter turn
        return node - ny
    return node - 1


@njit(cache=True)
def _step_cost(
    node: int,
    quarter: int,
    ny: int,
    fixed: Masks,
    masks: Ints,
    banned: int,
    prices: Ints,
) -> int:
    """Cost of MoveAhead from a node, FAR where it cannot be."""
    there = _ahead(node, quarter, ny)
    if there < 0 or there >= fixed.shape[1]:
        return FAR
    path = EAST if quarter % 2 == 0 else NORTH
    edge = node if quarter < 2 else there  # noqa: PLR2004 - backwards along an edge
    if fixed[path, edge] != 0 or (masks[path, edge] & banned) != 0:
        return FAR
    entered = masks[path, edge] & ~masks[NODE, node]
    cost = 1
    bit = 0
    while entered != 0:
        if entered & 1:
            cost += prices[bit]
        entered >>= 1
        bit += 1
    return min(cost, BUCKETS - 1)


@njit(cache=True)
def bucket_dijkstra(
    fixed: Masks, masks: Ints, banned: int, prices: Ints, ny: int, seeds: Ints, until: int
) -> Costs:
    """Cost from every pose to the nearest of some poses, FAR where cut off.

    Shapes: fixed (3, nodes) uint8 and masks (3, nodes) int64, rows as in the lattice's blockers:
    what closes a node or an edge for good, and one bit for each movable thing that blocks it.
    Things in `banned` close theirs as well; the others cost their price. Dijkstra over buckets.
    Once the pose `until` is known, so is all that its way down meets: costs above are bounds only.
    A negative one asks for all.
    """
    poses = 4 * fixed.shape[1]
    costs = np.full(poses, FAR, dtype=np.int32)
    entry = np.empty(3 * poses + len(seeds), dtype=np.int32)
    following = np.empty(3 * poses + len(seeds), dtype=np.int32)
    heads = np.full(BUCKETS, -1, dtype=np.int32)
    used, waiting, cost = 0, 0, 0
    for pose in seeds:
        costs[pose] = 0
        entry[used], following[used] = pose, heads[0]
        heads[0] = used
        used += 1
        waiting += 1
    while waiting > 0 and (until < 0 or costs[until] >= cost):
        bucket = cost % BUCKETS
        while heads[bucket] >= 0:
            pose = entry[heads[bucket]]
            heads[bucket] = following[heads[bucket]]
            waiting -= 1
            if costs[pose] != cost:
                continue
            node, quarter = pose // 4, pose % 4
            for kind in range(3):
                if kind == 0:
                    # Who steps ahead to here comes from behind.
                    behind = _ahead(node, (quarter + 2) % 4, ny)
                    if behind < 0 or behind >= fixed.shape[1]:
                        continue
                    price = _step_cost(behind, quarter, ny, fixed, masks, banned, prices)
                    before = 4 * behind + quarter
                else:
                    price = 1
                    before = 4 * node + (quarter + (1 if kind == 1 else 3)) % 4
                if price < FAR and cost + price < costs[before]:
                    costs[before] = cost + price
                    place = (cost + price) % BUCKETS
                    entry[used], following[used] = before, heads[place]
                    heads[place] = used
                    used += 1
                    waiting += 1
        cost += 1
    return costs


@njit(cache=True)
def descend(
    fixed: Masks, masks: Ints, banned: int, prices: Ints, ny: int, costs: Costs, pose: int
) -> tuple[Ints, Ints]:
    """Follow a field down: the poses passed (n,), and the things entered on each step (n,)."""
    limit = costs[pose] + 1
    poses = np.empty(limit, dtype=np.int64)
    entered = np.zeros(limit, dtype=np.int64)
    count = 0
    while True:
        poses[count] = pose
        count += 1
        if costs[pose] == 0:
            break
        node, quarter = pose // 4, pose % 4
        price = _step_cost(node, quarter, ny, fixed, masks, banned, prices)
        there = 4 * _ahead(node, quarter, ny) + quarter
        if price < FAR and costs[there] + price == costs[pose]:
            path = EAST if quarter % 2 == 0 else NORTH
            edge = node if quarter < 2 else there // 4  # noqa: PLR2004 - backwards along an edge
            entered[count - 1] = masks[path, edge] & ~masks[NODE, node]
            pose = there
            continue
        left = 4 * node + (quarter + 1) % 4
        pose = left if costs[left] + 1 == costs[pose] else 4 * node + (quarter + 3) % 4
    return poses[:count], entered[:count]


@njit(cache=True)
def viewpoints(
    points: Floats, reachable: Costs, ny: int, views: Floats, looks: Ints, after: Costs
) -> tuple[Ints, Ints, Ints]:
    """Find poses from which some point may be seen within reach, by cost.

    Parameters
    ----------
    points : (n, 3) float64
        A thing's visibility points, metres.
    reachable, after : (poses,) int32
        Cost of getting to each pose, and of going on from there once the thing is out of the way.
    ny
        Nodes along y.
    views : (h, 2) float64
        Cosine and sine of each horizon.
    looks : (h,) int64
        Actions until the camera is there.

    Returns
    -------
    poses, horizons, costs : (n,) int64 each
        Cheapest first, ties by pose, then horizon; the cost includes the interaction itself.

    """
    nx = len(reachable) // (4 * ny)
    low_x, high_x = points[:, 0].min() - REACH_M, points[:, 0].max() + REACH_M
    low_y, high_y = points[:, 1].min() - REACH_M, points[:, 1].max() + REACH_M
    i0, i1 = max(0, int(low_x / SPACING_M)), min(nx - 1, int(high_x / SPACING_M) + 1)
    j0, j1 = max(0, int(low_y / SPACING_M)), min(ny - 1, int(high_y / SPACING_M) + 1)
    limit = max(0, i1 - i0 + 1) * max(0, j1 - j0 + 1) * 4 * len(views)
    poses = np.empty(limit, dtype=np.int64)
    horizons = np.empty(limit, dtype=np.int64)
    costs = np.empty(limit, dtype=np.int64)
    count = 0
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            for quarter in range(4):
                pose = 4 * (i * ny + j) + quarter
                if reachable[pose] >= FAR or after[pose] >= FAR:
                    continue
                for h in range(len(views)):
                    if looks[h] >= 0 and _may_see(points, i, j, quarter, views[h, 0], views[h, 1]):
                        poses[count] = pose
                        horizons[count] = h
                        costs[count] = reachable[pose] + looks[h] + 1 + after[pose]
                        count += 1
    order = np.argsort(costs[:count], kind="mergesort")
    return poses[:count][order], horizons[:count][order], costs[:count][order]


@njit(cache=True)
def _may_see(
    points: Floats, i: int, j: int, quarter: int, cos_down: float, sin_down: float
) -> bool:
    ahead_x = 1.0 if quarter == 0 else (-1.0 if quarter == 2 else 0.0)  # noqa: PLR2004
    ahead_y = 1.0 if quarter == 1 else (-1.0 if quarter == 3 else 0.0)  # noqa: PLR2004
    for k in range(len(points)):
        dx, dy = points[k, 0] - SPACING_M * i, points[k, 1] - SPACING_M * j
        if dx * dx + dy * dy > REACH_M * REACH_M + SLACK_M:
            continue
        dz = points[k, 2] - CAMERA_M
        level, side = dx * ahead_x + dy * ahead_y, dx * ahead_y - dy * ahead_x
        depth = level * cos_down - dz * sin_down
        up = level * sin_down + dz * cos_down
        if depth > 0.0 and abs(side) <= depth + SLACK_M and abs(up) <= depth + SLACK_M:
            return True
    return False
