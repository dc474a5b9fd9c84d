"""From staged scenes to a finished dataset: readers see the old one, the new one, or none.

The order of calls of a generator:

1. `staging = open_staging(out, identity)` before the first scene: refuses a folder that holds
   anything else or another configuration's dataset.
2. `stage_scene` / `stage_quarantine` for every scene (any process, any order); on resume skip
   `done_scenes(staging)`: scenes in the finished dataset that is being extended, or staged.
3. `commit_scenes(staging, identity, assets, scenes)` as often as is wanted: shards go into `data/`,
   the manifest last; then shards that it does not name are removed.
4. `assemble(out, identity, assets, scenes)`: the last commit; what is left of the staging goes.
   After an interruption anywhere, a second call finishes.

When a dataset is extended, the manifest in place stays valid until the next one replaces it: a
shard that differs has another name (see `shards`). Readers may be at work all the while (see
`snapshot`). Only files whose names a manifest or the journal holds are removed (see `journal`).
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

from internav_data.core.storage import StoreLike, exists, final_of, store_of
from internav_data.dataset.compatibility import present_settings
from internav_data.dataset.journal import Journal, journal_names
from internav_data.dataset.manifest import (
    MANIFEST,
    Counts,
    DataFile,
    DatasetPart,
    Manifest,
    Quarantined,
    has_manifest,
    read_manifest,
    write_manifest,
)
from internav_data.dataset.metadata_files import METADATA, put_metadata
from internav_data.dataset.scene_hardware import hardware_of, hardware_scenes
from internav_data.dataset.shards import SPLITS, SceneSource, assets_table, put_shards
from internav_data.dataset.staging import (
    IDENTITY,
    Identity,
    Staging,
    any_staged,
    clear_staging,
    end_merging,
    read_identity,
    remove_foreign,
    remove_scenes,
    staged_scenes,
)
from internav_data.dataset.tables import FORMAT_VERSION
from internav_data.records.errors import CorruptDataError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import pyarrow as pa

    from internav_data.core.storage import Store
    from internav_data.dataset.staging import SceneState
    from internav_data.records import Asset

_FOLDERS = frozenset({".work", ".work/scenes", "data", "data/episodes", "data/scenes", "schemas"})
"""Folders that a commit writes into."""


Retry = Literal["none", "died", "all"]
"""Quarantined scenes that are tried again: none, those whose processes died, or all."""


def identity_of(manifest: Manifest) -> Identity:
    """Return the identity of a finished dataset."""
    return Identity(
        manifest.generator,
        manifest.generator_version,
        manifest.seed,
        manifest.catalogue_version,
        manifest.catalogue_digest,
        manifest.config,
        obstacle_shares=manifest.obstacle_shares or {},
    )


def held_config(out: StoreLike) -> Mapping[str, Any] | None:
    """Return the config of the dataset that a folder holds, or of its staged scenes; None for none.

    Settings of earlier releases are at their present place.

    Raises
    ------
    CorruptDataError
        The manifest, or the identity of an unfinished dataset, is damaged.

    """
    store = store_of(out)
    if has_manifest(store):
        return read_manifest(store).config
    begun = exists(store, IDENTITY) and any_staged(store)
    return present_settings(read_identity(store).config) if begun else None


def open_staging(
    out: StoreLike,
    identity: Identity,
    defaults: Mapping[str, Any] | None = None,
    part: DatasetPart | None = None,
) -> Staging:
    """Prepare a folder for staging the scenes of a dataset.

    Parameters
    ----------
    out
        Folder or store of the dataset.
    identity
        Inputs that decide every scene.
    defaults
        Configuration whose values stand for the settings that a dataset's own lacks, since it was
        made before they existed.
    part
        Range of scenes, where they are to be a part of a dataset.

    Raises
    ------
    UsageError
        `out` is a file, holds something that is no dataset, another configuration's dataset,
        another part, a link to a folder that a commit would write into, or a file that it would
        write over.

    """
    store = store_of(out)
    place = store.at("")
    names = names_to_write_into(store)
    if has_manifest(store):
        manifest = read_manifest(store)
        _same(place, identity_of(manifest), identity, defaults or {})
        _same_part(place, manifest, part)
    if exists(store, IDENTITY):
        _same(place, read_identity(store), identity, defaults or {})
    elif not has_manifest(store) and any(final_of(name) != IDENTITY for name in names):
        raise UsageError(f"{place}: holds something that is no dataset: give a new or empty folder")
    if not has_manifest(store):
        refuse_strangers(store, journal_names(store))
    store.put(IDENTITY, (json.dumps(asdict(identity), indent=1) + "\n").encode())
    staging = Staging(store, identity.digest())
    remove_foreign(staging)
    return staging


def names_to_write_into(store: Store) -> list[str]:
    """Return the names in a store that a dataset is to be written into.

    Raises
    ------
    UsageError
        It is a file, or a folder that a commit would write into is a link or a file.

    """
    try:
        names = store.names()
    except NotADirectoryError:
        raise UsageError(
            f"{store.at('')}: is a file: give a folder that is new, empty or a dataset"
        ) from None
    for folder in sorted(_FOLDERS.intersection(names)):
        raise UsageError(
            f"{store.at(folder)}: is a link or a file, and nothing is written through it: put the "
            "folder itself in its place, or write into another folder"
        )
    return names


def refuse_strangers(store: Store, ours: Iterable[str] = ()) -> None:
    """Refuse to write a new dataset's metadata over files that somebody put there.

    Raises
    ------
    UsageError
        A file has the name of one of a dataset, and is not among `ours`.

    """
    for name in sorted(METADATA.difference(ours)):
        if exists(store, name):
            raise UsageError(
                f"{store.at(name)}: is in the way of the dataset's own file of this name: move it "
                "away, then run the same command again: finished scenes are kept"
            )


def _same(out: str, there: Identity, wanted: Identity, defaults: Mapping[str, Any]) -> None:
    there = replace(
        there,
        config=_filled(present_settings(there.config), defaults),
        rules=wanted.rules,
        obstacle_shares=wanted.obstacle_shares,
    )
    if difference := difference_of(there, wanted, "asked for"):
        raise UsageError(
            f"{out}: holds a dataset of another configuration ({difference}): "
            "give another folder, or the same configuration to resume or extend"
        )


def difference_of(there: Identity, other: Identity, word: str) -> str:
    """Return the first value in which two identities differ; empty if they are equal.

    It reads `place: there 1, asked for 2`, where `word` is "asked for".
    """
    old, new = (json.loads(json.dumps(asdict(i))) for i in (there, other))
    return _first_difference(old, new, "", word)


def _same_part(out: str, there: Manifest, part: DatasetPart | None) -> None:
    """Check that a dataset in place is the part that is asked for, or none."""
    held, again = there.part, "to go on with it, or another folder"
    if held is None:
        if part is not None:
            raise UsageError(
                f"{out}: holds a dataset that is no part of one: leave --scene-range out {again}"
            )
        return
    span = f"{held.first_scene}:{held.end_scene}"
    if part is None or part.first_scene != held.first_scene:
        raise UsageError(
            f"{out}: holds the part {span} of a dataset: give --scene-range {span} {again}"
        )
    if part.rules != held.rules:
        raise UsageError(
            f"{out}: holds a part that other code of this version made, which cannot go on with "
            "it: make the part anew in another folder"
        )


def _filled(config: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Return a configuration with the settings that it lacks at their defaults."""
    filled = {**defaults, **config}
    for key, value in config.items():
        if isinstance(value, dict) and isinstance(defaults.get(key), dict):
            filled[key] = _filled(value, defaults[key])
    return filled


def _first_difference(old: Any, new: Any, path: str, word: str) -> str:  # noqa: ANN401 - JSON
    if isinstance(old, dict) and isinstance(new, dict):
        for key in sorted(old.keys() | new.keys()):
            place = f"{path}.{key}".lstrip(".")
            found = _first_difference(old.get(key), new.get(key), place, word)
            if found:
                return found
        return ""
    return "" if old == new else f"{path}: there {old!r}, {word} {new!r}"


def done_scenes(staging: Staging, retry: Retry = "none") -> frozenset[int]:
    """Return the numbers of all scenes that need not be built again.

    Quarantined ones are among them, but for those that are to be tried again.
    """
    states = staged_scenes(staging)
    done = {k for k, s in states.items() if not s.quarantined or not _again(s.died, retry)}
    if has_manifest(staging.store):
        manifest = read_manifest(staging.store)
        again = {entry.scene for entry in manifest.quarantined if _again(entry.died, retry)}
        done.update(k for k in manifest.scene_numbers if k not in again)
    return frozenset(done)


def _again(died: bool, retry: Retry) -> bool:
    return retry == "all" or (retry == "died" and died)


def assemble(
    out: StoreLike,
    identity: Identity,
    assets: Sequence[Asset],
    end_scene: int,
    part: DatasetPart | None = None,
) -> Manifest:
    """Make the dataset of the scenes before `end_scene` and end the run: later staged ones go.

    Parameters are those of `commit_scenes`.

    Raises
    ------
    CorruptDataError
        A scene is neither in the dataset nor staged, or a file is damaged.

    """
    staging = Staging(store_of(out), identity.digest())
    manifest = commit_scenes(staging, identity, assets, end_scene, part)
    end_staging(out)
    return manifest


def commit_scenes(
    staging: Staging,
    identity: Identity,
    assets: Sequence[Asset],
    end_scene: int,
    part: DatasetPart | None = None,
) -> Manifest:
    """Make the dataset of the scenes before `end_scene` from staged ones and what is there already.

    Later scenes stay staged, and others may be staged meanwhile. The files of a dataset do not
    depend on how many smaller ones were made on the way.

    Parameters
    ----------
    staging, identity
        Staged scenes and their identity.
    assets
        All assets of the catalogue.
    end_scene
        Number after that of the last scene; the dataset keeps what it holds beyond it.
    part
        Range of scenes, where they are to be a part of a dataset; else scenes begin at 0.

    Raises
    ------
    CorruptDataError
        A scene is neither in the dataset nor staged, or a file is damaged.
    UsageError
        No dataset is there, but somebody's file of a name that one would have.
    InternavError
        The folder was removed or is another run's.

    """
    store = staging.store
    staging.check()
    old = read_manifest(store) if has_manifest(store) else None
    journal = Journal(store)
    journal.sweep(old)
    if old is None:
        refuse_strangers(store)
    first = part.first_scene if part else 0
    held = old.scene_numbers.stop if old else first
    end_scene = max(end_scene, held)
    given_up = [entry.scene for entry in old.quarantined] if old else []
    states = staged_scenes(staging, [*given_up, *range(held, end_scene)])
    missing = [k for k in range(held, end_scene) if k not in states]
    if missing:
        raise CorruptDataError(
            f"{store.at('')}: {len(missing)} scenes are not finished, "
            f"first {missing[0]}: generate again"
        )
    source = SceneSource(store, old, staging, states)
    wanted = Wanted(identity, end_scene - first, part)
    manifest = put_dataset(
        journal, source, assets_table(assets), wanted, old, states=tuple(states.values())
    )
    remove_scenes(staging, states)
    return manifest


def end_staging(out: StoreLike) -> None:
    """Remove all that runs staged, and what a commit that was cut off left behind.

    Raises
    ------
    CorruptDataError
        The journal of that commit, or the manifest, is damaged.

    """
    store = store_of(out)
    Journal(store).sweep(read_manifest(store) if has_manifest(store) else None)
    end_merging(store)  # the run has made the scenes that a merge was to bring
    clear_staging(store)


@dataclass(frozen=True, slots=True)
class Wanted:
    """Description of a dataset to write, which its scenes do not give."""

    identity: Identity
    scenes: int
    """Number of scenes, quarantined ones included."""
    part: DatasetPart | None = None
    """Range of a part; None for a dataset."""


def put_dataset(
    journal: Journal,
    source: SceneSource,
    assets: pa.Table,
    wanted: Wanted,
    old: Manifest | None,
    *,
    states: Sequence[SceneState] = (),
    parts: Sequence[Manifest] = (),
) -> Manifest:
    """Write a dataset's files, then its manifest, and remove what is left of the one before.

    Parameters
    ----------
    journal
        Journal of the commit.
    source
        Rows of all its scenes.
    assets
        Rows of all assets of the catalogue.
    wanted
        Statements of the manifest that its scenes do not give.
    old, states, parts
        Origins of the scenes: the manifest in place, staged scenes, parts of the dataset.

    """
    store = source.store
    files = put_shards(journal, source, assets)
    before = (*((old,) if old else ()), *parts)
    manifest = put_metadata(journal, store, _manifest(wanted, before, states, source, files))
    journal.note(old.paths() if old else ())
    journal.announce(MANIFEST)
    manifest = write_manifest(store, manifest)
    journal.sweep(manifest)
    return manifest


def _manifest(
    wanted: Wanted,
    before: Sequence[Manifest],
    states: Sequence[SceneState],
    source: SceneSource,
    files: tuple[DataFile, ...],
) -> Manifest:
    redraws: Counter[str] = Counter()
    quarantined: dict[int, Quarantined] = {}
    for manifest in before:
        redraws.update(manifest.redraws)
        quarantined |= {entry.scene: entry for entry in manifest.quarantined}
    for state in states:
        redraws.update(state.redraws)
        quarantined.pop(state.scene, None)
        if state.quarantined:
            quarantined[state.scene] = Quarantined(
                state.scene, state.scene_id, state.attempts, state.quarantined, state.died
            )
    counts: dict[str, Counts] = {
        split: Counts(
            len(source.scenes[split]),
            sum(f.rows for f in files if f.table == "episodes" and f.split == split),
        )
        for split in SPLITS
    }
    identity, names, part = wanted.identity, hardware_of(before, states), wanted.part
    first, left_out = part.first_scene if part else 0, sorted(quarantined)
    numbers = range(first, first + wanted.scenes)
    return Manifest(
        FORMAT_VERSION,
        identity.generator,
        identity.generator_version,
        identity.seed,
        identity.catalogue_version,
        identity.catalogue_digest,
        json.loads(json.dumps(identity.config, sort_keys=True)),
        counts,
        wanted.scenes,
        dict(sorted(redraws.items())),
        tuple(entry for _, entry in sorted(quarantined.items())),
        files,
        requires=("part",) if part else (),
        hardware=names,
        obstacle_shares=dict(identity.obstacle_shares) or None,
        part=part,
        hardware_scenes=hardware_scenes(names, numbers, before, states, left_out),
    )
