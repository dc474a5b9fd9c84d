"""Cost-to-go fields over the agent's poses, for the expert; kernels compiled by numba.

A pose is a number: 4 * (i * ny + j) + quarter, for lattice node (i, j) and quarter turn. Actions
cost 1 each. A movable object does not close the edges that it blocks: it adds a price, once, where
a path enters the blocked region.
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
"""Cost of a pose from which the goal cannot be reached."""
BUCKETS: Final = 128
"""Number of buckets, a bound of the cost of a single step: higher prices are clipped to it."""
SLACK_M: Final = 1e-6
"""Tolerance of the visibility test, metres: poses are only proposed here, the world decides."""


@njit(cache=True)
def _ahead(node: int, quarter: int, ny: int) -> int:
    """Return the node in front of a node; a number outside the lattice beyond its border."""
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
    """Return the cost of MoveAhead from a node; FAR if it is impossible."""
    there = _ahead(node, quarter, ny)
    if there < 0 or there >= fixed.shape[1]:
        return FAR
    path = EAST if quarter % 2 == 0 else NORTH
    edge = node if quarter < 2 else there  # noqa: PLR2004 - backwards along an edge
    if fixed[path, edge] != 0 or (masks[path, edge] & banned) != 0:
        return FAR
    # Only objects that do not block the node already: each is paid for once, on entering.
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
    """Return the cost from every pose to the nearest of some seed poses.

    Dijkstra's algorithm with a circular array of buckets (Dial 1969), run backwards from the seeds.

    Parameters
    ----------
    fixed : (3, nodes) uint8
        Nonzero where a node or an edge is closed for good; rows as in the lattice's blockers
        (nodes, edges to the east, edges to the north).
    masks : (3, nodes) int64
        Bits of the movable objects that block each node and edge.
    banned
        Bits of the objects that cannot be moved: they close what they block.
    prices : (62,) int64
        Price of moving each other object.
    ny
        Nodes along y.
    seeds : (n,) int64
        Poses of cost 0.
    until
        Pose after whose cost is known the search stops: costs up to its own are then exact, higher
        ones are upper bounds. Negative for all poses.

    Returns
    -------
    (poses,) int32
        Cost of each pose; FAR where cut off.

    """
    # Buckets are linked lists in three arrays: heads by bucket, then pose and next entry by entry.
    # Each pose is expanded once and enters three others at most; an entry whose pose has become
    # cheaper since is skipped.
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
                    # MoveAhead to here comes from the node behind.
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
    """Follow a field from a pose down to a seed.

    Parameters
    ----------
    fixed, masks, banned, prices, ny
        Arguments of `bucket_dijkstra` that gave the field.
    costs : (poses,) int32
        Field to follow.
    pose
        First pose; its cost is below FAR.

    Returns
    -------
    poses, entered : (n,) int64 each
        Poses from the first to the seed, and the bits of the objects entered on each step.

    """
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
    """Find the poses from which an object may be seen within reach, cheapest first.

    Parameters
    ----------
    points : (n, 3) float64
        Visibility points of the object, metres.
    reachable, after : (poses,) int32
        Cost of reaching each pose, and of going on from it once the object is out of the way.
    ny
        Nodes along y.
    views : (h, 2) float64
        Cosine and sine of each horizon.
    looks : (h,) int64
        Number of actions until the camera has each horizon; negative if it cannot.

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
    # A stable sort: ties keep the order of poses, then horizons.
    order = np.argsort(costs[:count], kind="mergesort")
    return poses[:count][order], horizons[:count][order], costs[:count][order]


@njit(cache=True)
def _may_see(
    points: Floats, i: int, j: int, quarter: int, cos_down: float, sin_down: float
) -> bool:
    """Return whether a point is in reach and in view; other objects are not asked."""
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
