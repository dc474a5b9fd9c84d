"""From unfinished work to a finished dataset: readers see the old one, the new one, or none.

The order of things, for whoever generates:

1. `open_work(out, identity)` before the first scene: refuses a folder that holds anything else or
   another configuration's dataset, and returns the work folder.
2. `write_scene_work` / `write_quarantine` for every scene (any process, any order); on resume skip
   `done_scenes(out)`: scenes in the finished dataset that is being extended, or in `.work/`.
3. `assemble(out, identity, assets, scenes)`: shards are built in `.work/shards/`, renamed into
   `data/`, the manifest last, `.work/` removed. Interrupted anywhere, calling it again finishes.

When a dataset is extended, the manifest in place stays valid until the next one replaces it: new
shards get new names ("-of-N" grows). Where a name stays but not its content, the shard first comes
under an interim name with a manifest that says so, then under its own name with a second manifest.
"""

from __future__ import annotations

import json
import shutil
from collections import Counter
from dataclasses import asdict, dataclass, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from internav_data.core.files import link_or_copy, write_atomically
from internav_data.dataset.manifest import (
    MANIFEST,
    Counts,
    DataFile,
    Manifest,
    Quarantined,
    has_manifest,
    read_manifest,
    write_manifest,
)
from internav_data.dataset.metadata_files import write_sidecars
from internav_data.dataset.shards import SPLITS, SceneSource, write_shards
from internav_data.dataset.staging import SceneState, finished_scenes, work_dir
from internav_data.dataset.tables import FORMAT_VERSION
from internav_data.records.errors import CorruptDataError, UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.records import Asset

_IDENTITY = "identity.json"


@dataclass(frozen=True, slots=True)
class Identity:
    """What makes two runs the same dataset; the number of scenes and workers does not."""

    generator: str
    generator_version: str
    seed: int
    catalogue_version: int
    catalogue_digest: str
    config: Mapping[str, Any]
    """The resolved configuration: numbers, strings, booleans, lists and mappings of them."""


def identity_of(manifest: Manifest) -> Identity:
    """Return the identity of a finished dataset."""
    return Identity(
        manifest.generator,
        manifest.generator_version,
        manifest.seed,
        manifest.catalogue_version,
        manifest.catalogue_digest,
        manifest.config,
    )


def open_work(out: Path, identity: Identity) -> Path:
    """Prepare a folder for work on a dataset and return its work folder.

    Raises
    ------
    UsageError
        `out` is a file, holds something that is no dataset, or another configuration's dataset.

    """
    work = work_dir(out)
    if out.exists() and not out.is_dir():
        raise UsageError(f"{out}: is a file: give a folder that is new, empty or a dataset")
    if has_manifest(out):
        _same(out, identity_of(read_manifest(out)), identity)
    if (work / _IDENTITY).is_file():
        _same(out, _read_identity(work), identity)
    elif not has_manifest(out) and out.exists() and any(p.name != ".work" for p in out.iterdir()):
        raise UsageError(f"{out}: holds something that is no dataset: give a new or empty folder")
    write_atomically(work / _IDENTITY, (json.dumps(asdict(identity), indent=1) + "\n").encode())
    return work


def _read_identity(work: Path) -> Identity:
    path = work / _IDENTITY
    try:
        return Identity(**json.loads(path.read_bytes()))
    except (ValueError, TypeError) as error:
        raise CorruptDataError(
            f"{path}: damaged ({error}): remove {work} and start anew"
        ) from error


def _same(out: Path, there: Identity, wanted: Identity) -> None:
    old, new = (json.loads(json.dumps(asdict(i))) for i in (there, wanted))
    if difference := _first_difference(old, new, ""):
        raise UsageError(
            f"{out}: holds a dataset of another configuration ({difference}): "
            "give another folder, or the same configuration to resume or extend"
        )


def _first_difference(old: Any, new: Any, path: str) -> str:  # noqa: ANN401 - JSON
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(old.keys() | new.keys()):
            found = _first_difference(old.get(key), new.get(key), f"{path}.{key}".lstrip("."))
            if found:
                return found
        return ""
    return "" if old == new else f"{path}: there {old!r}, asked for {new!r}"


def done_scenes(out: Path) -> frozenset[int]:
    """Return the numbers of all scenes that need not be built again, quarantined ones included."""
    done = set(finished_scenes(work_dir(out)))
    if has_manifest(out):
        done.update(range(read_manifest(out).scenes))
    return frozenset(done)


def assemble(out: Path, identity: Identity, assets: Sequence[Asset], scenes: int) -> Manifest:
    """Make the dataset of scenes 0 … scenes - 1 from finished work and what is there already.

    Raises
    ------
    CorruptDataError
        A scene is neither in the dataset nor in the work folder, or a file is damaged.

    """
    work = work_dir(out)
    old = read_manifest(out) if has_manifest(out) else None
    _remove_stale(out, old)
    scenes = max(scenes, old.scenes if old else 0)
    states = finished_scenes(work, range(old.scenes if old else 0, scenes))
    missing = [k for k in range(old.scenes if old else 0, scenes) if k not in states]
    if missing:
        raise CorruptDataError(
            f"{out}: {len(missing)} scenes are not finished, first {missing[0]}: generate again"
        )
    source = SceneSource(out, old, states)
    shutil.rmtree(work / "shards", ignore_errors=True)
    built = write_shards(work / "shards", source, assets)
    manifest = _manifest(identity, scenes, old, states, source, built)
    _place(out, work / "shards", old, manifest)
    shutil.rmtree(work)
    return manifest


def _manifest(
    identity: Identity,
    scenes: int,
    old: Manifest | None,
    states: Mapping[int, SceneState],
    source: SceneSource,
    files: tuple[DataFile, ...],
) -> Manifest:
    redraws = Counter(old.redraws if old else {})
    quarantined = list(old.quarantined if old else ())
    for state in states.values():
        redraws.update(state.redraws)
        if state.quarantined:
            quarantined.append(
                Quarantined(state.scene, state.scene_id, state.attempts, state.quarantined)
            )
    counts: dict[str, Counts] = {
        split: Counts(
            len(source.scenes[split]),
            sum(f.rows for f in files if f.table == "episodes" and f.split == split),
        )
        for split in SPLITS
    }
    return Manifest(
        FORMAT_VERSION,
        identity.generator,
        identity.generator_version,
        identity.seed,
        identity.catalogue_version,
        identity.catalogue_digest,
        json.loads(json.dumps(identity.config, sort_keys=True)),
        counts,
        scenes,
        dict(sorted(redraws.items())),
        tuple(quarantined),
        files,
    )


def _place(out: Path, shards: Path, old: Manifest | None, manifest: Manifest) -> None:
    before = {f.path: f.sha256 for f in old.files} if old else {}
    interim = {
        f.path: _interim_name(f)
        for f in manifest.files
        if f.path in before and before[f.path] != f.sha256
    }
    for file in manifest.files:
        target = out / interim.get(file.path, file.path)
        if before.get(file.path) != file.sha256:
            target.parent.mkdir(parents=True, exist_ok=True)
            (shards / PurePosixPath(file.path).relative_to("data")).replace(target)
    if interim:
        files = tuple(replace(f, path=interim.get(f.path, f.path)) for f in manifest.files)
        write_manifest(out, replace(manifest, files=files))
        for final, name in interim.items():
            link_or_copy(out / name, out / final)
    write_sidecars(out, manifest)
    write_manifest(out, manifest)
    _remove_stale(out, manifest)


def _interim_name(file: DataFile) -> str:
    return file.path.removesuffix(".parquet") + f".{file.sha256[:12]}.parquet"


def _remove_stale(out: Path, manifest: Manifest | None) -> None:
    """Remove shards that the manifest in place does not name, and temporary files."""
    keep = {f.path for f in manifest.files} if manifest else set()
    for path in sorted((out / "data").rglob("*")):
        name = path.relative_to(out).as_posix()
        if path.is_file() and name not in keep and path.suffix in {".parquet", ".tmp"}:
            path.unlink()
    for path in out.glob(f".{MANIFEST}.*.tmp"):
        path.unlink()
