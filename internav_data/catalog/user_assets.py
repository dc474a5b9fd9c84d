"""A user's own meshes: read by trimesh, cut into convex parts by coacd, fitted to the frame.

Every error names the file and says what to do. A mesh that cannot be used is left out with a
warning that names it, and the others are used. Files are bounded before they are read, and
nothing outside the folder is opened: materials and textures a mesh names are not looked up.
"""

from __future__ import annotations

import codecs
import io
import math
import re
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.catalog.convex import Piece, convex_pieces, enclosed_volume
from internav_data.catalog.glb import check_glb
from internav_data.catalog.user_manifest import MESH_SUFFIXES, MeshNote, read_notes
from internav_data.core.arithmetic import plain_sum
from internav_data.core.extras import EXTRAS, missing, require
from internav_data.core.files import FileLimits, read_file
from internav_data.records import Asset, Part
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from internav_data.core.typing import Floats
    from internav_data.records import RGB, Vec3

MAX_BYTES = 64_000_000
MAX_FACES = 400_000
MAX_FILES = 5_000
MAX_GROUPS = 1_000
"""Largest number of materials, groups and objects of an OBJ file."""
MAX_VOLUME_DIFFERENCE = 0.1
"""Share by which the volume of the parts may differ from the mesh's without a warning."""
MAX_SIZE_M, MIN_SIZE_M = 5.0, 0.01
_DENSITY_KG_M3 = 200.0
_GREY: RGB = (168, 164, 156)
_GRID_M = 2e-4
_ZERO_INDEX = re.compile(rb"^[ \t]*f[ \t](?:[^\n]*[ \t])?0(?:[/\s]|\Z)", re.MULTILINE)
"""Face of an OBJ file with a corner of number 0: they count from 1, and trimesh takes the last."""
_STL_HEADER, _STL_TRIANGLE = 84, 50
"""Bytes of a binary STL: header with the number of triangles as its last four, each triangle."""


def load_user_assets(directory: Path) -> tuple[Asset, ...]:
    """Read every mesh of a folder as an obstacle asset, sorted by asset_id.

    Parameters
    ----------
    directory
        Holds GLB, OBJ, STL, PLY or OFF files, and perhaps `assets.toml`
        (`internav_data.catalog.user_manifest` says what may stand in it). Subfolders are not read.

    Returns
    -------
    tuple
        One asset a file, `asset_id` its type and the file's name: `Duck_user_duck`.

    Raises
    ------
    UsageError
        No mesh can be used; it names the first one, why, and what to do.

    Warns
    -----
    UserWarning
        For each mesh that is left out, and for each whose convex parts have another volume.

    """
    paths = _meshes(directory)
    notes = read_notes(directory, tuple(path.name for path in paths))
    assets: dict[str, tuple[Asset, Path]] = {}
    refused: list[UsageError] = []
    for path in paths:
        if notes[path.name].ignore:
            continue
        try:
            asset = _asset(path, notes[path.name])
        except UsageError as error:
            refused.append(error)
            continue
        if asset.asset_id in assets:
            other = assets[asset.asset_id][1].name
            name = f"{asset.asset_id!r}, as {other} is"
            refused.append(UsageError(f"{path}: would be named {name}; rename one of them"))
        else:
            assets[asset.asset_id] = (asset, path)
    if refused and not assets:
        raise refused[0]
    for complaint in refused:
        warnings.warn(f"{complaint}; it is left out", stacklevel=2)
    return tuple(assets[asset_id][0] for asset_id in sorted(assets))


def _meshes(directory: Path) -> list[Path]:
    if not directory.is_dir():
        raise UsageError(f"{directory}: not a folder; --assets wants a folder of meshes")
    paths = sorted(p for p in directory.iterdir() if p.suffix.lower() in MESH_SUFFIXES)
    if not paths:
        raise UsageError(f"{directory}: holds no mesh; put {', '.join(MESH_SUFFIXES)} files there")
    if len(paths) > MAX_FILES:
        raise UsageError(f"{directory}: {len(paths)} meshes, at most {MAX_FILES}; split it")
    return paths


def _asset(path: Path, note: MeshNote) -> Asset:
    vertices, faces, colour = _read(path)
    up = note.up or ("y" if path.suffix.lower() == ".glb" else "z")
    points = vertices * note.scale
    if up == "y":
        points = np.column_stack([points[:, 0], -points[:, 2], points[:, 1]])
    extent = np.ptp(points, axis=0)
    largest = float(extent.max())
    if not MIN_SIZE_M <= largest <= MAX_SIZE_M:
        guess = 10.0 ** round(math.log10(0.5 / largest)) if largest > 0.0 else 1.0
        raise UsageError(
            f"{path}: its longest side is {largest:.4g} m, expected {MIN_SIZE_M} to {MAX_SIZE_M} "
            f"m; set scale in assets.toml (perhaps {note.scale * guess:g}: "
            "are its units millimetres?)"
        )
    pieces = convex_pieces(path, points, faces, note.max_parts)
    if note.lay_flat:
        pieces = _laid_flat(pieces)
    parts, size = _fitted(path, pieces, colour)
    volume = plain_sum(piece.volume for piece in pieces)
    _compare_volumes(path, enclosed_volume(points, faces), volume)
    mass = note.mass_kg if note.mass_kg is not None else max(0.01, _DENSITY_KG_M3 * volume)
    stem = re.sub(r"[^A-Za-z0-9]+", "_", path.stem).strip("_") or "mesh"
    type_ = note.type or "".join(word[:1].upper() + word[1:] for word in stem.split("_"))
    return Asset(
        asset_id=f"{type_}_user_{stem}",
        type=type_,
        size=size,
        mass_kg=float(f"{mass:.3g}"),
        friction=round(float(note.friction), 2),
        pushable=(not note.pickable) if note.pushable is None else note.pushable,
        pickable=note.pickable,
        spawnable=True,
        blocks=True,
        parts=parts,
    )


def _compare_volumes(path: Path, enclosed: float | None, parts: float) -> None:
    """Warn where convex parts enclose another volume than the mesh, and so weigh another mass."""
    if enclosed and abs(parts / enclosed - 1.0) > MAX_VOLUME_DIFFERENCE:
        warnings.warn(
            f"{path}: its convex parts have {parts / enclosed:.2g} times its volume; raise "
            "max_parts in assets.toml, or give mass_kg",
            stacklevel=4,
        )


def _laid_flat(pieces: list[Piece]) -> list[Piece]:
    """Turn pieces onto the face of their common hull with the most probable stable pose.

    The probabilities are trimesh's (Goldberg et al. 1999), without noise of the centre of mass.
    """
    require("trimesh")
    import trimesh  # noqa: PLC0415 - only for users with meshes

    hull = trimesh.convex.convex_hull(np.vstack([piece.corners for piece in pieces]))
    volumes = np.array([piece.volume for piece in pieces])
    middles = np.array([trimesh.convex.convex_hull(p.corners).center_mass for p in pieces])
    turns, shares = trimesh.poses.compute_stable_poses(
        hull, center_mass=volumes @ middles / volumes.sum(), sigma=0.0, n_samples=1
    )
    turn = turns[int(np.argmax(shares))][:3, :3]
    return [replace(piece, corners=piece.corners @ turn.T) for piece in pieces]


def _read(path: Path) -> tuple[Floats, NDArray[np.int64], RGB]:
    """Read vertices (n, 3) float64, triangles (m, 3) int64 and a mean colour, size-limited."""
    require("trimesh")
    suffix, content = path.suffix[1:].lower(), _content(path)
    import trimesh  # noqa: PLC0415 - only for users with meshes

    try:
        _check_encoding(suffix, content)
        # From memory and without a resolver: nothing that the file refers to is opened.
        loaded: Any = trimesh.load(
            io.BytesIO(content), file_type=suffix, resolver=None, process=False
        )
        finite = _processed(loaded, suffix)
        mesh = loaded.to_mesh() if isinstance(loaded, trimesh.Scene) else loaded
        vertices = np.asarray(mesh.vertices, dtype=np.float64)
        faces = np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:
        # Readers of broken files fail in every way there is: all mean the same to the user.
        raise UsageError(
            f"{path}: cannot be read as a mesh ({_reason(error)}); "
            "export it again as GLB, OBJ or STL"
        ) from error
    if len(faces) == 0 or len(vertices) == 0:
        raise UsageError(f"{path}: holds no triangles; export a mesh, not points or curves")
    if len(faces) > MAX_FACES:
        raise UsageError(f"{path}: {len(faces)} triangles, at most {MAX_FACES}; simplify it")
    if not finite:
        raise UsageError(f"{path}: has corners that are not numbers; export it again")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise UsageError(f"{path}: has triangles of corners that it does not have; export it again")
    return vertices, faces, _mean_colour(mesh)


def _content(path: Path) -> bytes:
    """Read a mesh's file: a bounded one in a format that takes bounded time to read."""
    if path.name.startswith("._"):
        raise UsageError(f"{path}: notes of macOS beside a file, no mesh; remove it")
    if path.is_symlink() or not path.is_file():
        raise UsageError(f"{path}: not a plain file; copy the mesh itself into the folder")
    limits = FileLimits(error=UsageError, remedy="export fewer triangles", max_bytes=MAX_BYTES)
    content = read_file(path, limits).removeprefix(codecs.BOM_UTF8)
    if not content:
        raise UsageError(f"{path}: 0 bytes; export it again")
    if path.suffix.lower() == ".glb":
        check_glb(path, content, MAX_FACES)
    elif path.suffix.lower() == ".obj":
        groups = plain_sum(map(content.count, (b"\nusemtl", b"\no ", b"\ng ")))
        if groups > MAX_GROUPS:
            raise UsageError(f"{path}: {groups} groups, at most {MAX_GROUPS}; join them")
        if _ZERO_INDEX.search(content):
            raise UsageError(f"{path}: a face has corner 0, but they count from 1; export it again")
    return content


def _processed(loaded: Any, suffix: str) -> bool:  # noqa: ANN401 - trimesh is imported when used
    """Merge equal vertices as trimesh does by default; return whether all were finite before.

    trimesh's processing drops what is not finite without a word, hence the order.
    """
    meshes = list(loaded.geometry.values()) if hasattr(loaded, "geometry") else [loaded]
    finite = all(bool(np.isfinite(mesh.vertices).all()) for mesh in meshes)
    if suffix != "glb":  # which trimesh leaves as it is
        for mesh in meshes:
            if hasattr(mesh, "process"):  # not so points and curves, which are refused later
                mesh.process()
    return finite


def _reason(error: Exception) -> str:
    """Return the reason why a file cannot be read, in one line."""
    if isinstance(error, ModuleNotFoundError) and error.name in EXTRAS:
        return str(missing(error.name))
    return str(error).splitlines()[0][:120] if str(error) else type(error).__name__


def _check_encoding(suffix: str, content: bytes) -> None:
    """Check that text is UTF-8 and that a binary STL is as long as its header says.

    trimesh reads a binary STL of another length as text, and text of another encoding as the
    library `charset_normalizer` guesses: which files it takes depends on what else is installed.

    Raises
    ------
    ValueError
        The text is no UTF-8, or the binary STL has another length.
    """
    if suffix == "stl" and (b"\0" in content or content.lstrip()[:5].lower() != b"solid"):
        _check_binary_stl(content)
    elif suffix in {"obj", "off", "stl"}:
        try:
            content.decode()
        except UnicodeDecodeError as error:
            raise ValueError("not UTF-8 text") from error


def _check_binary_stl(content: bytes) -> None:
    if len(content) < _STL_HEADER:
        raise ValueError(f"{len(content)} bytes, a binary STL has {_STL_HEADER} at least")
    count = int.from_bytes(content[_STL_HEADER - 4 : _STL_HEADER], "little")
    expected = _STL_HEADER + _STL_TRIANGLE * count
    if len(content) != expected:
        raise ValueError(f"{len(content)} bytes, its header of {count} triangles means {expected}")


def _mean_colour(mesh: Any) -> RGB:  # noqa: ANN401 - trimesh is imported when used
    """Return the mean of the material's or the faces' colours, grey where there are none."""
    try:
        visual = mesh.visual
        if not getattr(visual, "defined", False):
            return _GREY
        red, green, blue = (int(c) for c in np.atleast_1d(visual.main_color)[:3])
    except (AttributeError, ValueError, TypeError, KeyError, IndexError):
        return _GREY  # a colour is not worth refusing a mesh
    return (red, green, blue)


def _fitted(path: Path, pieces: list[Any], colour: RGB) -> tuple[tuple[Part, ...], Vec3]:
    """Set pieces on z = 0, centred on x = y = 0, in multiples of 0.1 mm; return parts and size."""
    corners = np.vstack([piece.corners for piece in pieces])
    low, high = corners.min(axis=0), corners.max(axis=0)
    # Integer steps of 0.2 mm: sizes are even numbers of them, so that the middle is on the grid,
    # and corners are scaled to fill the rounded box exactly.
    steps = np.maximum(2, 2 * np.rint((high - low) / (2.0 * _GRID_M)).astype(np.int64))
    start = np.array([-steps[0] // 2, -steps[1] // 2, 0])
    parts = []
    for piece in pieces:
        share = (piece.corners - low) / np.maximum(high - low, 1e-12)
        grid = np.unique(np.rint(share * steps).astype(np.int64) + start, axis=0)
        if len(grid) < 4 or np.linalg.matrix_rank(grid - grid[0]) < 3:  # noqa: PLR2004 - solid
            continue
        middle = grid.min(axis=0) + grid.max(axis=0)
        local = 2 * grid - middle
        extent = 2 * np.ptp(grid, axis=0)
        parts.append(
            Part(
                shape="hull",
                centre=_metres(middle),
                size=_metres(extent),
                rotation=(0.0, 0.0, 0.0, 1.0),
                corners=tuple(_metres(corner) for corner in local),
                colour=colour,
                material="plastic",
            )
        )
    size = _metres(2 * steps)
    if not parts:
        raise UsageError(f"{path}: encloses no volume at 0.1 mm; give it thickness")
    return tuple(parts), size


def _metres(steps: NDArray[np.int64]) -> Vec3:
    """Turn steps of 0.1 mm into metres."""
    x, y, z = (int(step) / 10_000 for step in steps)
    return (x, y, z)
