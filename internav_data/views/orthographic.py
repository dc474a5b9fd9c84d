"""Orthographic pictures of assets: a z-buffer in numba with light, shadow and smooth curves.

Yaw turns the viewer about the thing (0 looks at its front, along +y), pitch looks down from that
many degrees. The light is fixed to the viewer and falls from above and to the left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from internav_data.catalog import part_triangles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from internav_data.core.typing import Floats, Image
    from internav_data.records import RGB, Asset, Vec3

_CREASE = math.cos(math.radians(50.0))
"""Faces of one part that meet at less than 50 degrees are shaded as one curved surface."""
_FLOOR_REACH_M = 3.0
_AMBIENT, _DIFFUSE = 0.64, 0.52
_LIGHT_DEG = (-38.0, 57.0)
"""The light's yaw beside the viewer's, and its pitch."""
_SHADOW = 0.5
"""How much of the direct light is left in shadow."""
_BIAS_M = 0.004


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """Triangles to draw.

    Shapes: corners (n, 3, 3) metres, normals (n, 3, 3) unit, one a corner, colours (n, 3) 0…255.
    """

    corners: Floats
    normals: Floats
    colours: Floats

    def moved(self, offset: Vec3, yaw_deg: float = 0.0) -> Surface:
        """Turn about z, then shift."""
        c, s = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return Surface(
            self.corners @ turn.T + np.array(offset), self.normals @ turn.T, self.colours
        )

    @staticmethod
    def joined(surfaces: list[Surface]) -> Surface:
        """Put several surfaces into one picture."""
        return Surface(
            np.concatenate([s.corners for s in surfaces]),
            np.concatenate([s.normals for s in surfaces]),
            np.concatenate([s.colours for s in surfaces]),
        )


@njit(cache=True)
def _smooth_normals(
    normals: Floats, areas: Floats, faces: NDArray[np.int64], crease: float
) -> Floats:
    count = len(faces)
    out = np.zeros((count, 3, 3))
    for f in range(count):
        for k in range(3):
            corner = faces[f, k]
            for g in range(count):
                if corner not in (faces[g, 0], faces[g, 1], faces[g, 2]):
                    continue
                alike = 0.0
                for axis in range(3):
                    alike += normals[f, axis] * normals[g, axis]
                if alike >= crease:
                    for axis in range(3):
                        out[f, k, axis] += areas[g] * normals[g, axis]
            length = 0.0
            for axis in range(3):
                length += out[f, k, axis] ** 2
            for axis in range(3):
                out[f, k, axis] /= math.sqrt(length)
    return out


def asset_surface(asset: Asset) -> Surface:
    """Triangles of all parts of an asset, in its own frame."""
    surfaces = []
    for part in asset.parts:
        vertices, faces = part_triangles(part)
        corners = vertices[faces]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(cross, axis=1)
        # A sliver of a triangulated flat face has no direction of its own and nothing to show.
        keep = areas > 1e-12
        cross, areas, corners, faces = cross[keep], areas[keep], corners[keep], faces[keep]
        normals = cross / areas[:, None]
        colours = np.tile(np.array(part.colour, np.float64), (len(faces), 1))
        smooth = _smooth_normals(normals, areas, faces, _CREASE)
        surfaces.append(Surface(corners, smooth, colours))
    return Surface.joined(surfaces)


@njit(cache=True)
def _rasterise(corners: Floats, depth: Floats, owner: NDArray[np.int32], weights: Floats) -> None:
    """Fill a z-buffer. Corners (n, 3, 3) in pixels right, pixels down, metres away."""
    height, width = depth.shape
    for t in range(len(corners)):
        ax, ay = corners[t, 0, 0], corners[t, 0, 1]
        bx, by = corners[t, 1, 0], corners[t, 1, 1]
        cx, cy = corners[t, 2, 0], corners[t, 2, 1]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        left = max(0, math.ceil(min(ax, bx, cx) - 0.5))
        right = min(width - 1, math.floor(max(ax, bx, cx) - 0.5))
        top = max(0, math.ceil(min(ay, by, cy) - 0.5))
        bottom = min(height - 1, math.floor(max(ay, by, cy) - 0.5))
        for row in range(top, bottom + 1):
            y = row + 0.5
            for column in range(left, right + 1):
                x = column + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1.0 - u - v
                if u < 0.0 or v < 0.0 or w < 0.0:
                    continue
                z = u * corners[t, 0, 2] + v * corners[t, 1, 2] + w * corners[t, 2, 2]
                if z < depth[row, column]:
                    depth[row, column] = z
                    owner[row, column] = t
                    weights[row, column, 0] = u
                    weights[row, column, 1] = v


def _view(yaw_deg: float, pitch_deg: float) -> Floats:
    """Rows: right, down, away from the viewer, in the world's frame."""
    yaw, pitch = math.radians(yaw_deg), math.radians(pitch_deg)
    right = (math.cos(yaw), math.sin(yaw), 0.0)
    ahead = (-math.sin(yaw), math.cos(yaw), 0.0)
    c, s = math.cos(pitch), math.sin(pitch)
    away = (ahead[0] * c, ahead[1] * c, -s)
    down = (-ahead[0] * s, -ahead[1] * s, -c)
    return np.array([right, down, away])


@dataclass(frozen=True, slots=True)
class OrthographicView:
    """Where the viewer stands and how large the picture is."""

    width: int
    height: int
    pixels_per_m: float
    centre: Vec3
    """This point of the world lies in the middle of the picture."""
    yaw_deg: float = 25.0
    pitch_deg: float = 24.0
    oversample: int = 3
    """Rays a pixel's side: the picture is drawn that much larger and averaged."""
    background: RGB = (247, 247, 245)
    floor: bool = True
    """Whether shadows fall on a floor at z = 0 in the background's colour."""


def _floor_mesh(centre: Vec3, colour: RGB) -> Surface:
    x, y, reach = centre[0], centre[1], _FLOOR_REACH_M * 10
    a, b = (x - reach, y - reach, 0.0), (x + reach, y - reach, 0.0)
    c, d = (x + reach, y + reach, 0.0), (x - reach, y + reach, 0.0)
    corners = np.array([[a, b, c], [a, c, d]])
    normals = np.tile(np.array([0.0, 0.0, 1.0]), (2, 3, 1))
    return Surface(corners, normals, np.tile(np.array(colour, np.float64), (2, 1)))


@njit(cache=True)
def _shade(
    owner: NDArray[np.int32],
    weights: Floats,
    lit: Floats,
    normals: Floats,
    colours: Floats,
    shadow: Floats,
    light: Floats,
    settings: Floats,
    floor_from: int,
    out: Floats,
) -> None:
    """Colour each pixel: sky light, direct light, and shadow averaged over nine samples."""
    ambient, diffuse, left, bias = settings[0], settings[1], settings[2], settings[3]
    for row in range(owner.shape[0]):
        for column in range(owner.shape[1]):
            t = owner[row, column]
            if t < 0:
                continue
            u, v = weights[row, column, 0], weights[row, column, 1]
            w = 1.0 - u - v
            nx, ny, nz = 0.0, 0.0, 0.0
            at = np.empty(3)
            for axis in range(3):
                at[axis] = u * lit[t, 0, axis] + v * lit[t, 1, axis] + w * lit[t, 2, axis]
            nx = u * normals[t, 0, 0] + v * normals[t, 1, 0] + w * normals[t, 2, 0]
            ny = u * normals[t, 0, 1] + v * normals[t, 1, 1] + w * normals[t, 2, 1]
            nz = u * normals[t, 0, 2] + v * normals[t, 1, 2] + w * normals[t, 2, 2]
            facing = max(0.0, nx * light[0] + ny * light[1] + nz * light[2])
            hidden = 0.0
            for dy in range(-2, 3):
                for dx in range(-2, 3):
                    r = int(at[1] + 1.5 * dy)
                    c = int(at[0] + 1.5 * dx)
                    inside = 0 <= r < shadow.shape[0] and 0 <= c < shadow.shape[1]
                    if inside and shadow[r, c] < at[2] - bias * (3.0 - 2.0 * facing):
                        hidden += 1.0 / 25.0
            if t >= floor_from:
                value = 1.0 - 0.2 * hidden
            else:
                direct = facing * (1.0 - (1.0 - left) * hidden)
                value = ambient * (0.9 + 0.1 * nz) + diffuse * direct
            for axis in range(3):
                out[row, column, axis] = min(255.0, colours[t, axis] * value)


def draw_surface(surface: Surface, view: OrthographicView) -> Image:
    """Draw a surface, shape (height, width, 3) uint8, red first.

    The same surface and view give the same picture on any processor of one numba release.
    """
    floor_from = len(surface.corners)
    whole = (
        Surface.joined([surface, _floor_mesh(view.centre, view.background)])
        if view.floor
        else surface
    )
    scale = view.pixels_per_m * view.oversample
    height, width = view.height * view.oversample, view.width * view.oversample
    axes = _view(view.yaw_deg, view.pitch_deg)
    seen = (whole.corners - np.array(view.centre)) @ axes.T
    seen[:, :, :2] *= scale
    seen[:, :, 0] += width / 2.0
    seen[:, :, 1] += height / 2.0
    owner = np.full((height, width), -1, np.int32)
    weights = np.zeros((height, width, 2))
    _rasterise(seen, np.full((height, width), np.inf), owner, weights)
    lit, shadow = _shadow_map(surface, whole, view)
    light = -_view(view.yaw_deg + _LIGHT_DEG[0], _LIGHT_DEG[1])[2]
    out = np.empty((height, width, 3))
    out[:] = view.background
    settings = np.array([_AMBIENT, _DIFFUSE, _SHADOW, _BIAS_M])
    _shade(
        owner,
        weights,
        lit,
        whole.normals,
        whole.colours,
        shadow,
        light,
        settings,
        floor_from,
        out,
    )
    k = view.oversample
    blocks: Floats = out.reshape(view.height, k, view.width, k, 3).mean(axis=(1, 3))
    image: Image = np.rint(blocks).astype(np.uint8)
    return image


def _shadow_map(surface: Surface, whole: Surface, view: OrthographicView) -> tuple[Floats, Floats]:
    """See the things from the light: all corners in its pixels, and how far light gets."""
    axes = _view(view.yaw_deg + _LIGHT_DEG[0], _LIGHT_DEG[1])
    low, high = surface.corners.min(axis=(0, 1)), surface.corners.max(axis=(0, 1))
    reach = float(np.linalg.norm(high - low)) / 2.0 + 1e-3
    size = max(64, min(1400, round(reach * 2.0 * view.pixels_per_m * view.oversample)))
    lit = (whole.corners - (low + high) / 2.0) @ axes.T
    lit[:, :, :2] = (lit[:, :, :2] / reach + 1.0) * (size / 2.0)
    depth = np.full((size, size), np.inf)
    count = len(surface.corners)
    _rasterise(
        np.ascontiguousarray(lit[:count]),
        depth,
        np.zeros((size, size), np.int32),
        np.zeros((size, size, 2)),
    )
    return lit, depth
