"""Sizes that a GLB file states, checked before its meshes are built.

Format: glTF 2.0 (Khronos), binary container. A small file may state many primitives, place one mesh
many times, or state accessors of any length.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from internav_data.core.arithmetic import plain_sum
from internav_data.core.files import FileLimits, parse_json
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from pathlib import Path

MAX_PRIMITIVES: Final = 1_000
"""Largest number of primitives, those of a mesh counted each time that it is placed."""
_HEADER, _CHUNK = 12, 8
"""Bytes of the file's header and of a chunk's."""
_LIMITS: Final = FileLimits(
    error=UsageError, remedy="export it again", max_bytes=16_000_000, max_depth=64
)


def check_glb(path: Path, content: bytes, max_faces: int) -> None:
    """Check the sizes that a GLB file states; what is no GLB is left to its reader.

    Raises
    ------
    UsageError
        Its description is broken or too large, or it states too many primitives or corners.

    """
    start = _HEADER + _CHUNK
    if content[:4] != b"glTF" or content[start - 4 : start] != b"JSON":
        return
    length = int.from_bytes(content[_HEADER : _HEADER + 4], "little")
    scene = parse_json(content[start : start + length].rstrip(b"\0 "), path, _LIMITS)
    try:
        primitives = _primitives(scene)
        longest = max((int(a["count"]) for a in scene.get("accessors", ())), default=0)
    except (AttributeError, KeyError, TypeError, IndexError) as error:
        raise UsageError(f"{path}: cannot be read as a mesh (no glTF); export it again") from error
    if primitives > MAX_PRIMITIVES:
        raise UsageError(
            f"{path}: {primitives} primitives, at most {MAX_PRIMITIVES}; join them in one mesh"
        )
    if longest > 3 * max_faces:
        raise UsageError(f"{path}: {longest} corners, at most {3 * max_faces}; simplify it")


def _primitives(scene: dict[str, Any]) -> int:
    sizes = [len(mesh["primitives"]) for mesh in scene.get("meshes", ())]
    placed = [node["mesh"] for node in scene.get("nodes", ()) if "mesh" in node]
    total: int = max(plain_sum(sizes), plain_sum(sizes[k] for k in placed))
    return total
