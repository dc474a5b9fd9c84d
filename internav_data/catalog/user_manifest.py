"""Reader of a user's `assets.toml`: type, mass, friction and size of the meshes of a folder.

Tables: `[default]` holds for every mesh, `["duck.obj"]` for one file. Keys of both:

- `type`: name of the type, letters and digits; the file's own name by default
- `mass_kg`: above 0; by default 200 kg for each cubic metre of the convex parts
- `friction`: 0 to 2, default 0.6
- `pushable`, `pickable`: at most one of them; by default pushable
- `scale`: metres for each unit of the file, default 1
- `up`: which axis points up in the file, "y" or "z"; by default y for GLB and glTF, z for others
- `lay_flat`: turned onto its most stable face; by default false
- `max_parts`: at most so many convex parts, 1 to 32, default 12

Without the file, every mesh gets the defaults. `ignore = true` leaves a file out.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

from internav_data.core.files import FileLimits, read_toml
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

MANIFEST = "assets.toml"
MESH_SUFFIXES = (".glb", ".obj", ".stl", ".ply", ".off")
_FILE = FileLimits(error=UsageError, remedy="docs/assets.md shows one")
_MAX_PARTS = 32
_MAX_FRICTION = 2.0
_MAX_MASS_KG = 1e5


@dataclass(frozen=True, slots=True)
class MeshNote:
    """Settings of one mesh; None where the reader decides."""

    type: str | None = None
    mass_kg: float | None = None
    friction: float = 0.6
    pushable: bool | None = None
    pickable: bool = False
    scale: float = 1.0
    up: str | None = None
    lay_flat: bool = False
    max_parts: int = 12
    ignore: bool = False


_KINDS: dict[str, tuple[type, ...]] = {
    "type": (str,),
    "mass_kg": (int, float),
    "friction": (int, float),
    "pushable": (bool,),
    "pickable": (bool,),
    "scale": (int, float),
    "up": (str,),
    "lay_flat": (bool,),
    "max_parts": (int,),
    "ignore": (bool,),
}


def read_notes(directory: Path, names: tuple[str, ...]) -> dict[str, MeshNote]:
    """Read the notes on the named files of a folder.

    Raises
    ------
    UsageError
        When assets.toml is broken, or names an unknown key or a file that is not there.
    """
    path = directory / MANIFEST
    if not path.exists():
        return {name: MeshNote() for name in names}
    tables = read_toml(path, _FILE)
    default = _note(path, "default", tables.pop("default", {}), MeshNote())
    for name in tables:
        if name not in names:
            raise UsageError(
                f"{path}: [{name!r}] names no mesh in this folder"
                f"{_nearest(name, (*names, 'default'))}; write default or a file's name, quoted"
            )
    return {name: _note(path, name, tables.get(name, {}), default) for name in names}


def _nearest(name: str, known: tuple[str, ...]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""


def _note(path: Path, name: str, table: object, default: MeshNote) -> MeshNote:
    if not isinstance(table, dict):
        raise UsageError(f'{path}: {name!r} must be a table, as ["{name}"]')
    known = tuple(field.name for field in fields(MeshNote))
    for key, value in table.items():
        if key not in known:
            raise UsageError(
                f"{path}: unknown key {key!r} in [{name!r}]{_nearest(key, known)}; "
                f"known: {', '.join(known)}"
            )
        kinds = _KINDS[key]
        if not isinstance(value, kinds) or (isinstance(value, bool) and bool not in kinds):
            expected = " or ".join(kind.__name__ for kind in kinds)
            raise UsageError(f"{path}: {key} of [{name!r}] must be {expected}, not {value!r}")
    note = replace(default, **table)
    if table.get("pickable") and "pushable" not in table:
        note = replace(note, pushable=False)
    _check(path, name, note)
    return note


def _check(path: Path, name: str, note: MeshNote) -> None:
    def must(good: bool, text: str) -> None:
        if not good:
            raise UsageError(f"{path}: {text} in [{name!r}]")

    mass = note.mass_kg
    must(mass is None or 0.0 < mass < _MAX_MASS_KG, f"mass_kg must lie above 0, not {mass}")
    must(0.0 <= note.friction <= _MAX_FRICTION, f"friction must be 0 to 2, not {note.friction}")
    must(0.0 < note.scale < 1e6, f"scale must lie above 0, not {note.scale}")  # noqa: PLR2004
    must(note.up in {None, "y", "z"}, f'up must be "y" or "z", not {note.up!r}')
    must(1 <= note.max_parts <= _MAX_PARTS, f"max_parts must be 1 to 32, not {note.max_parts}")
    must(not (note.pushable and note.pickable), "pushable and pickable exclude each other: choose")
    must(
        note.type is None or (note.type.isascii() and note.type.isalnum()),
        f"type must be letters and digits, not {note.type!r}",
    )
