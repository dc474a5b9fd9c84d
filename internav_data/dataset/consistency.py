"""Counts and names of a manifest checked against one another: no reader trusts one that differs.

A manifest that calls a table by another name, or holds another number of scenes than its files,
would hide rows from a reader and let a writer write them twice.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING, get_args

from internav_data.dataset.scene_hardware import wrong_scene_hardware
from internav_data.dataset.tables import TABLES
from internav_data.records import Split

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.dataset.manifest import DataFile, Manifest

_SHARED = "assets"
"""Table of one file, which belongs to no split."""
_MAX_COUNT = 1 << 40
_SHA256 = re.compile("[0-9a-f]{64}")


def inconsistencies(manifest: Manifest) -> Iterator[str]:
    """Yield each statement of a manifest that contradicts another one, or that has no meaning.

    Parameters
    ----------
    manifest
        Manifest whose files have been checked one by one.

    """
    yield from _wrong_types(manifest)
    yield from _wrong_part(manifest)
    yield from _wrong_files(manifest)
    yield from _wrong_quarantine(manifest)
    yield from _wrong_counts(manifest)
    yield from _wrong_hardware(manifest)


def _wrong_types(manifest: Manifest) -> Iterator[str]:
    for name in ("generator", "generator_version", "catalogue_digest"):
        if not isinstance(value := getattr(manifest, name), str):
            yield f"{name}: expected a text, got {value!r}"
    for name in ("seed", "catalogue_version"):
        if type(value := getattr(manifest, name)) is not int:
            yield f"{name}: expected a whole number, got {value!r}"
    if not isinstance(manifest.config, dict):
        yield f"config: expected an object, got {manifest.config!r}"
    if not isinstance(manifest.redraws, dict):
        yield f"redraws: expected an object, got {manifest.redraws!r}"
    else:
        for reason, count in manifest.redraws.items():
            if not _is_count(count):
                yield f"redraws: {reason!r}: expected a number from 0, got {count!r}"


def _wrong_part(manifest: Manifest) -> Iterator[str]:
    part = manifest.part
    if part is None:
        return
    first, end = part.first_scene, part.end_scene
    if not _is_count(first) or not _is_count(end) or not first < end:
        yield f"part: expected scenes from a first one up to an end, got {first!r} up to {end!r}"
    elif type(manifest.scenes) is int and manifest.scenes > end - first:
        yield f"part: {end - first} scenes from {first} up to {end}, but {manifest.scenes} stated"
    if not isinstance(part.rules, str) or not _SHA256.fullmatch(part.rules):
        yield f"part: rules: expected 64 hexadecimal digits, got {part.rules!r}"


def _wrong_files(manifest: Manifest) -> Iterator[str]:
    known = [spec.name for spec in TABLES]
    for file in manifest.files:
        if file.table not in known:
            yield f"file {file.path!r}: table: expected one of {known}, got {file.table!r}"
        elif (file.split is None) != (file.table == _SHARED) or not _is_split(file.split):
            wanted = "null" if file.table == _SHARED else f"one of {list(get_args(Split))}"
            yield f"file {file.path!r}: split: expected {wanted}, got {file.split!r}"
        for name in ("sha256", "footer_sha256", "logical_digest"):
            value = getattr(file, name)
            if not isinstance(value, str) or not _SHA256.fullmatch(value):
                yield f"file {file.path!r}: {name}: expected 64 hexadecimal digits, got {value!r}"
    for extra in manifest.metadata or ():
        if not isinstance(extra.sha256, str) or not _SHA256.fullmatch(extra.sha256):
            yield (
                f"metadata {extra.path!r}: sha256: expected 64 hexadecimal digits, "
                f"got {extra.sha256!r}"
            )
    paths = [file.path for file in manifest.files]
    yield from _repeated("files", paths + [extra.path for extra in manifest.metadata or ()])
    if (shared := sum(file.table == _SHARED for file in manifest.files)) != 1:
        yield f"files: expected 1 of {_SHARED}, got {shared}"


def _wrong_quarantine(manifest: Manifest) -> Iterator[str]:
    for entry in manifest.quarantined:
        if (
            not _is_count(entry.scene)
            or entry.scene_id != f"scene-{entry.scene:06d}"
            or not _is_count(entry.attempts)
            or not isinstance(entry.reason, str)
            or not isinstance(entry.died, bool)
        ):
            yield f"quarantined: {entry.scene_id!r}: expected its scene, attempts and reason"
        elif _is_count(manifest.scenes) and entry.scene not in manifest.scene_numbers:
            numbers = manifest.scene_numbers
            stated = f"{numbers.start} … {numbers.stop - 1}"
            yield f"quarantined: {entry.scene_id}: expected a scene of {stated}"
    yield from _repeated("quarantined", [str(entry.scene_id) for entry in manifest.quarantined])


def _wrong_counts(manifest: Manifest) -> Iterator[str]:
    if set(manifest.counts) != set(get_args(Split)):
        yield f"counts: expected {list(get_args(Split))}, got {list(manifest.counts)}"
    for split, counts in manifest.counts.items():
        for table in ("scenes", "episodes"):
            rows, stated = _rows(manifest.of(table, split)), getattr(counts, table)
            if type(stated) is not int or stated != rows:
                yield f"counts: {split}: {rows} {table} in its files, but {stated!r} stated"
    held = _rows(manifest.of("scenes")) + len(manifest.quarantined)
    if type(manifest.scenes) is not int or manifest.scenes != held:
        yield f"scenes: {held} in its files and quarantined, but {manifest.scenes!r} stated"


def _wrong_hardware(manifest: Manifest) -> Iterator[str]:
    if manifest.hardware_scenes is not None:
        left_out = [entry.scene for entry in manifest.quarantined]
        yield from wrong_scene_hardware(
            manifest.hardware_scenes, manifest.hardware, manifest.scene_numbers, left_out
        )


def _rows(files: tuple[DataFile, ...]) -> int:
    return sum(file.rows for file in files)


def _is_count(value: object) -> bool:
    return type(value) is int and 0 <= value <= _MAX_COUNT


def _is_split(value: object) -> bool:
    return value is None or value in get_args(Split)


def _repeated(what: str, names: list[str]) -> Iterator[str]:
    for name, times in Counter(names).items():
        if times > 1:
            yield f"{what}: {name!r} is named {times} times"
