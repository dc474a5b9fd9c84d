"""Digest of the code that makes scenes, by which staged scenes of other code are told apart."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

ROOMS = (
    "records",
    "core",
    "geometry",
    "catalog",
    "dataset",
    "navigation",
    "houses",
    "physics",
    "world",
    "planner",
    "episodes",
    "generation",
)
"""Packages whose modules take part in making a scene."""


def source_files() -> list[Path]:
    """Return the sources of `ROOMS`, sorted."""
    package = Path(__file__).parents[1]
    return sorted(path for room in ROOMS for path in (package / room).rglob("*.py"))


@cache
def source_digest() -> str:
    """Return the sha256 over names and sources of `ROOMS`, 64 hexadecimal digits."""
    package, code = Path(__file__).parents[1], hashlib.sha256()
    for path in source_files():
        source = path.read_bytes()
        code.update(f"{path.relative_to(package).as_posix()} {len(source)} ".encode() + source)
    return code.hexdigest()
