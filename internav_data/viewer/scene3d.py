"""A house in three dimensions: its surfaces, furniture and obstacles as one GLB.

trimesh's viewer, a page that carries three.js and fetches nothing, draws it in a frame. Walls are
seen from inside alone: whoever looks from outside looks through the near ones.
"""

from __future__ import annotations

import base64
import itertools
import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import trimesh
from trimesh.viewer.notebook import scene_to_html
from trimesh.visual.material import PBRMaterial

from internav_data.catalog import part_triangles
from internav_data.geometry import transform
from internav_data.records.agent import AGENT
from internav_data.records.errors import InternavError
from internav_data.render.house_mesh import structure_of
from internav_data.render.wall_quads import CEILING
from internav_data.viewer.shapes import shown_kind
from internav_data.views.episodes import COLOURS, GOAL, START

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.core.typing import Floats, Ints
    from internav_data.records import RGB, Asset, Episode, House, Pose

MARK: Final = "GLB-IN-BASE64"
"""Text in the viewer's page in place of a house."""
_DATA: Final = re.compile(r'base64_data="([^"]*)"')
_WHITE: Final = "scene.background=new THREE.Color(0xffffff)"
_PAPER: Final = "scene.background=new THREE.Color(0xfaf9f6)"
_UPRIGHT: Final = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""Rotation from z up to y up, as glTF and three.js have it."""
_ELEVATION_DEG: Final = 50.0
_FIELD_DEG: Final = 40.0
_ASPECT: Final = 4.0 / 3.0
"""Width of the smallest frame by its height."""
_LIGHT: Final = np.array([-0.35, -0.5, 0.79])
"""Direction towards the light, about a unit vector."""
_AMBIENT: Final = 0.68
"""Share of the light that comes from everywhere."""
_UNLIT: Final = "KHR_materials_unlit"


class _Surface:
    """Triangles, each in one colour, collected from many parts; light is part of the colour."""

    def __init__(self) -> None:
        self._corners: list[Floats] = []
        self._colours: list[Floats] = []

    def add(self, corners: Floats, faces: Ints, colour: RGB) -> None:
        triangles = corners[faces]
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        lengths = np.linalg.norm(normals, axis=1)
        facing = np.maximum(normals @ _LIGHT / np.maximum(lengths, 1e-12), 0.0)
        shades = _AMBIENT + (1.0 - _AMBIENT) * facing
        self._corners.append(triangles.reshape(-1, 3))
        self._colours.append(np.repeat(shades[:, None] * np.array(colour), 3, axis=0))

    def add_asset(self, asset: Asset, pose: Pose, colour: RGB | None = None) -> None:
        for part in asset.parts:
            corners, faces = part_triangles(part)
            self.add(transform(corners, pose), faces, colour or part.colour)

    def mesh(self) -> Any:  # noqa: ANN401 - trimesh is untyped
        corners = np.vstack(self._corners)
        faces = np.arange(len(corners)).reshape(-1, 3)
        mesh = trimesh.Trimesh(corners, faces, process=False, validate=False)
        mesh.visual = trimesh.visual.TextureVisuals(material=PBRMaterial(doubleSided=False))
        colours = np.clip(np.rint(np.vstack(self._colours)), 0, 255).astype(np.uint8)
        opaque = np.full((len(colours), 1), 255, np.uint8)
        mesh.visual.vertex_attributes["color"] = np.hstack([colours, opaque])
        return mesh


def _unlit(tree: dict[str, Any]) -> None:
    """Have a viewer show the colours as they are: three.js's lamp shines at the origin alone."""
    tree["extensionsUsed"] = [_UNLIT]
    for material in tree["materials"]:
        material["extensions"] = {_UNLIT: {}}


def house_glb(house: House, episode: Episode, assets: Mapping[str, Asset]) -> bytes:
    """Return a house with an episode's obstacles, start and goal as GLB, y up.

    Obstacles have the colours of the map. The view is the one from the south, from above.
    """
    surface = _Surface()
    _add_structure(surface, house)
    for placed in house.objects:
        surface.add_asset(house.assets[placed.asset_id], placed.pose)
    for obstacle in episode.obstacles:
        colour = COLOURS[shown_kind(obstacle)]
        surface.add_asset(assets[obstacle.asset_id], obstacle.pose, colour)
    for colour, (x, y) in (
        (START, (episode.start.x, episode.start.y)),
        (GOAL, (episode.goal.x, episode.goal.y)),
    ):
        disc = trimesh.creation.cylinder(radius=AGENT.radius_m, height=0.05, sections=32)
        surface.add(
            np.asarray(disc.vertices) + np.array((x, y, 0.03)), np.asarray(disc.faces), colour
        )
    scene = trimesh.Scene(surface.mesh())
    scene.apply_transform(_UPRIGHT)
    _place_camera(scene, house)
    return bytes(scene.export(file_type="glb", include_normals=False, tree_postprocessor=_unlit))


def _add_structure(surface: _Surface, house: House) -> None:
    """Add floors, walls, windows and closed doors, seen from inside; ceilings are left out."""
    structure = structure_of(house)
    mesh = structure.mesh
    for face, label in enumerate(structure.rooms.labels.tolist()):
        if label == CEILING:
            continue
        corners = mesh.vertices[mesh.first_vertex[face] : mesh.first_vertex[face + 1]]
        r, g, b = (int(value) for value in mesh.looks[face, :3])
        surface.add(corners, np.array([[0, 1, 2], [0, 2, 3]]), (r, g, b))


def _place_camera(scene: Any, house: House) -> None:  # noqa: ANN401 - trimesh is untyped
    """Look at the house's middle from the south, from as near as shows all of it."""
    xs, ys = [p[0] for p in house.outline], [p[1] for p in house.outline]
    tall = max(room.ceiling_m for room in house.rooms)
    middle = np.array([(min(xs) + max(xs)) / 2.0, tall / 3.0, -(min(ys) + max(ys)) / 2.0])
    tilt = math.radians(_ELEVATION_DEG)
    c, s = math.cos(tilt), math.sin(tilt)
    axes = np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])  # right, up, backwards
    corners = itertools.product((min(xs), max(xs)), (0.0, tall), (-max(ys), -min(ys)))
    right, up, back = axes @ (np.array(list(corners)) - middle).T
    height = math.tan(math.radians(_FIELD_DEG) / 2.0)
    far = float((np.maximum(np.abs(up), np.abs(right) / _ASPECT) / height + back).max())
    pose = np.eye(4)
    pose[:3, :3] = axes.T
    pose[:3, 3] = middle + 1.06 * far * axes[2]
    field = (math.degrees(2.0 * math.atan(_ASPECT * height)), _FIELD_DEG)
    scene.camera = trimesh.scene.Camera(resolution=(800, 600), fov=field)
    scene.camera_transform = pose


def glb_text(glb: bytes) -> str:
    """Return a GLB as the viewer's page holds it."""
    return base64.b64encode(glb).decode("ascii")


@lru_cache(maxsize=1)
def viewer_template() -> str:
    """Return the page of trimesh's viewer, 0.7 MB, with `MARK` where a GLB goes.

    Raises
    ------
    InternavError
        This version of trimesh has another viewer.
    """
    page: str = scene_to_html(trimesh.Scene(trimesh.creation.box()))
    found = _DATA.search(page)
    if found is None:
        raise InternavError(
            f"trimesh {trimesh.__version__}: its viewer's page has no place for a scene; "
            "report it, and use a version up to 4.12"
        )
    page = page[: found.start(1)] + MARK + page[found.end(1) :]
    return page.replace(_WHITE, _PAPER)
