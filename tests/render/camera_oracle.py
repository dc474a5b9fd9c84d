"""A ray caster that shares nothing with the camera but the records: trimesh, a ray a pixel."""

import math

import numpy as np
import trimesh
from numba import njit

from internav_data.catalog import asset_mesh
from internav_data.geometry import rotation_matrix
from internav_data.navigation import room_of
from internav_data.records.agent import AGENT

FLOOR, CEILING, WALL, DOOR, WINDOW = -1, -2, -3, -4, -5


def boxes(house):
    """Walls, floor and ceiling slabs, panes: label, low corner, high corner."""
    for w in house.walls:
        entrance = any(
            not d.open
            and w.x_min - 1e-6 < d.x < w.x_max + 1e-6
            and w.y_min - 1e-6 < d.y < w.y_max + 1e-6
            and w.z_min == 0.0
            for d in house.doors
        )
        low, high = (w.x_min, w.y_min, w.z_min), (w.x_max, w.y_max, w.z_max)
        yield DOOR if entrance else WALL, low, high
    xs, ys = [p[0] for p in house.outline], [p[1] for p in house.outline]
    x0, x1, y0, y1 = min(xs), max(xs), min(ys), max(ys)
    yield FLOOR, (x0, y0, -0.1), (x1, y1, 0.0)
    top = house.rooms[0].ceiling_m
    yield CEILING, (x0, y0, top), (x1, y1, top + 0.1)
    for w in house.windows:
        # A thin slab whose inner side is the pane.
        axis = 1 if w.yaw_deg == 0.0 else 0
        probe = [w.x, w.y]
        probe[axis] += 0.1
        inwards = 1.0 if room_of(house, *probe) == w.room else -1.0
        low = [w.x - w.width_m / 2, w.y - w.width_m / 2, w.sill_m]
        high = [w.x + w.width_m / 2, w.y + w.width_m / 2, w.sill_m + w.height_m]
        middle = (w.x, w.y)[axis]
        low[axis], high[axis] = sorted((middle, middle - inwards * 0.01))
        yield WINDOW, tuple(low), tuple(high)


def scene(house, instances, hidden=()):
    """All triangles of a house (n, 3, 3), and whose they are (n,)."""
    triangles, labels = [], []
    for label, low, high in boxes(house):
        box = trimesh.creation.box(bounds=[low, high])
        triangles.append(box.triangles)
        labels.append(np.full(len(box.faces), label))
    for k, (asset, pose) in enumerate(instances):
        if k in hidden:
            continue
        mesh = asset_mesh(asset)
        turned = mesh.triangles @ rotation_matrix(pose.quaternion).T
        triangles.append(turned + np.array([pose.x, pose.y, pose.z]))
        labels.append(np.full(len(mesh.faces), 1 + k))
    return np.concatenate(triangles), np.concatenate(labels)


def rays(view, size):
    """Unit forward (3,), and a direction (size * size, 3) a pixel, 1 m along the optical axis."""
    yaw, down = math.radians(view.yaw_deg), math.radians(view.horizon_deg)
    forward = np.array(
        [math.cos(yaw) * math.cos(down), math.sin(yaw) * math.cos(down), -math.sin(down)]
    )
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    below = np.cross(forward, right)
    at = (np.arange(size) + 0.5) / (size / 2) - 1.0
    x, y = np.meshgrid(at, at)
    return forward + x.ravel()[:, None] * right + y.ravel()[:, None] * below


@njit
def _nearest(eye, directions, triangles, best, hits):
    """Moeller and Trumbore, every ray against every triangle, from either side."""
    for r in range(len(directions)):
        dx, dy, dz = directions[r, 0], directions[r, 1], directions[r, 2]
        for k in range(len(triangles)):
            t = triangles[k]
            e1x, e1y, e1z = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
            e2x, e2y, e2z = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
            px, py, pz = dy * e2z - dz * e2y, dz * e2x - dx * e2z, dx * e2y - dy * e2x
            det = e1x * px + e1y * py + e1z * pz
            if abs(det) < 1e-14:
                continue
            sx, sy, sz = eye[0] - t[0, 0], eye[1] - t[0, 1], eye[2] - t[0, 2]
            u = (sx * px + sy * py + sz * pz) / det
            if u < 0 or u > 1:
                continue
            qx, qy, qz = sy * e1z - sz * e1y, sz * e1x - sx * e1z, sx * e1y - sy * e1x
            v = (dx * qx + dy * qy + dz * qz) / det
            if v < 0 or u + v > 1:
                continue
            along = (e2x * qx + e2y * qy + e2z * qz) / det
            if 1e-6 < along < best[r]:
                best[r] = along
                hits[r] = k


def cast(triangles, labels, view, size):
    """Depth and ids (size, size) of a view."""
    eye = np.array([view.x, view.y, AGENT.camera_height_m])
    directions = rays(view, size)
    best = np.full(len(directions), np.inf)
    hits = np.full(len(directions), -1)
    _nearest(eye, directions, triangles, best, hits)
    ids = np.where(hits >= 0, labels[hits], 0)
    return best.reshape(size, size), ids.reshape(size, size)
