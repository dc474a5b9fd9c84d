"""Parts of a dataset joined into one, with the bytes of a run in one piece.

A part is a dataset of a range of scenes, made by `generate --scene-range` anywhere. Its scenes are
those of the whole, but its files are cut at other scenes: rows are cut anew, as when a dataset is
extended. Parts are only read. All are checked before the first byte is written; then a part or
several at a time are committed, the manifest last, so that after a kill the same call goes on from
the last commit. Until the last one a file beside the data says that the dataset is not finished.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import pyarrow as pa

from internav_data.core.storage import Store, StoreLike, disk_errors, exists, final_of, store_of
from internav_data.dataset.commit import (
    Wanted,
    difference_of,
    identity_of,
    names_to_write_into,
    put_dataset,
    refuse_strangers,
)
from internav_data.dataset.journal import JOURNAL, Journal, journal_names
from internav_data.dataset.manifest import Manifest, has_manifest, read_manifest
from internav_data.dataset.repair import find_damage
from internav_data.dataset.shards import SceneSource
from internav_data.dataset.snapshot import read_shard
from internav_data.dataset.staging import IDENTITY, MERGING, STAGING, any_staged, end_merging
from internav_data.dataset.tables import ASSETS, EPISODES
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.records.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

BUSY: Final = "somebody is writing this dataset; wait for it to end or choose another --out"
"""Reason for which a second writer in the same folder is refused."""
_LEAST_SHARE: Final = 0.5
"""Scenes of a commit, to those held before: all commits together rewrite a dataset three times."""
_BUILDS: Final = ("engine", "build", "other_engine", "other_build")


@dataclass(frozen=True, slots=True)
class _Part:
    store: Store
    manifest: Manifest

    @property
    def place(self) -> str:
        return self.store.at("")

    @property
    def numbers(self) -> range:
        return self.manifest.scene_numbers

    @property
    def span(self) -> str:
        return f"scenes {self.numbers.start} to {self.numbers.stop - 1}"


def merge(
    parts: Sequence[StoreLike], out: StoreLike, callback: Callable[[str], object] = lambda _: None
) -> Manifest:
    """Join the parts of a dataset; after a kill the same call goes on.

    Parameters
    ----------
    parts
        Folders or stores of all parts, in any order; they are only read.
    out
        Folder or store of the dataset: new, empty, or one whose first scenes are those of the
        first parts already.
    callback
        Called with a line for each commit.

    Returns
    -------
    Manifest
        That of the dataset, the same as of a run that made all scenes in one piece.

    Raises
    ------
    UsageError
        Parts of different identities, by another version of this package or of an engine; ranges
        that overlap or leave a hole; or `out` holds something else.
    CorruptDataError
        A part is unfinished or damaged, or the dataset in `out` is damaged.
    LockedError
        Another process is writing `out`.
    InternavError
        A full or read-only disk; what is committed is kept.

    """
    found = sorted(map(_opened, parts), key=lambda part: part.numbers.start)
    if not found:
        raise UsageError("parts: expected at least one folder of a part, got none")
    _check_alike(found)
    _check_ranges(found)
    for part in found:
        _check_intact(part)
    _check_builds(found)
    store = store_of(out)
    with disk_errors(store.at("")), store.lock(BUSY):
        held = _held(store, found[0])
        groups = list(_commits(held, found))
        _check_held(store, metadata=not groups)
        journal = Journal(store)
        journal.sweep(held)
        first = found[0]
        assets = read_shard(first.store, first.manifest.of(ASSETS.name)[0], ASSETS)
        if groups:
            store.put(MERGING, (json.dumps({"scenes": found[-1].numbers.stop}) + "\n").encode())
        for group in groups:
            held = _add(journal, assets, held, group)
            callback(
                f"{held.scenes} of {found[-1].numbers.stop} scenes can be read in {store.at('')}"
            )
        end_merging(store)
        store.prune(STAGING)
    return read_manifest(store)


def _opened(place: StoreLike) -> _Part:
    """Open a part.

    Raises
    ------
    CorruptDataError
        There is none, or it is not finished.

    """
    store = store_of(place)
    part = _Part(store, read_manifest(store))
    wanted = part.manifest.part
    if (
        any_staged(store)
        or exists(store, MERGING)
        or (wanted is not None and part.numbers.stop < wanted.end_scene)
    ):
        raise CorruptDataError(
            f"{part.place}: the part is not finished ({part.span} so far): run the command that "
            "makes it again, then merge"
        )
    return part


def _check_alike(parts: Sequence[_Part]) -> None:
    """Check that all parts are of one dataset, and made by this version of the package."""
    first, rules = parts[0], dict[str, str]()
    for part in parts:
        version = part.manifest.generator_version
        if version != __version__:
            raise UsageError(
                f"{part.place}: made by version {version} of internav-data, and this is "
                f"{__version__}: merge with the version that made the parts, or make it anew"
            )
        found = difference_of(identity_of(first.manifest), identity_of(part.manifest), "here")
        if found:
            raise UsageError(
                f"{part.place}: is no part of the same dataset as {first.place} ({found}): "
                "leave it out, or make it anew with the other's settings"
            )
        if part.manifest.part is not None:
            rules.setdefault(part.manifest.part.rules, part.place)
    if len(rules) > 1:
        one, other, *_ = rules.values()
        raise UsageError(
            f"{other}: made by other code than {one}, though both are of version {__version__}: "
            "make one of them anew with the other's code"
        )


def _check_ranges(parts: Sequence[_Part]) -> None:
    """Check that the parts, in order of their scenes, hold each scene from 0 on once."""
    end, before = 0, ""
    for part in parts:
        first = part.numbers.start
        if first > end:
            raise UsageError(
                f"scenes {end} to {first - 1} are in no part: give the part that holds them, or "
                f"make it with --scene-range {end}:{first}"
            )
        if first < end:
            raise UsageError(
                f"{part.place}: holds {part.span}, of which {before} holds those up to {end - 1}: "
                "leave one out, or make it anew without them"
            )
        end, before = part.numbers.stop, part.place


def _check_intact(part: _Part) -> None:
    """Check every byte of a part's files."""
    damage = find_damage(part.store)
    if damage is not None:
        raise CorruptDataError(
            f"{part.place}: {', '.join(damage.paths[:3])}: missing or damaged: run the command "
            "that makes the part again, which mends it, then merge"
        )


def _check_builds(parts: Sequence[_Part]) -> None:
    """Check that one version of the physics engine made all episodes."""
    first: tuple[str, frozenset[tuple[str, ...]]] | None = None
    for part in parts:
        builds = _builds(part)
        if not builds:
            continue  # it has no episode
        first = first or (part.place, builds)
        if len(builds | first[1]) > 1:
            named = " and ".join(sorted(" ".join(filter(None, each)) for each in builds | first[1]))
            raise UsageError(
                f"{part.place}: its physics is another version's than that of {first[0]} "
                f"({named}): make one of them anew with the other's engine"
            )


def _builds(part: _Part) -> frozenset[tuple[str, ...]]:
    """Return the engines and builds that an episode of a part states."""
    found: set[tuple[str, ...]] = set()
    for file in part.manifest.of(EPISODES.name):
        names = [f"physics.{name}" for name in _BUILDS]
        column = read_shard(part.store, file, EPISODES, names)["physics"]
        for chunk in column.chunks:
            kinds = pa.Table.from_struct_array(chunk).group_by(list(_BUILDS)).aggregate([])
            found.update(tuple(row[name] for name in _BUILDS) for row in kinds.to_pylist())
    return frozenset(found)


def _held(store: Store, part: _Part) -> Manifest | None:
    """Return the manifest of the dataset in place that is to be gone on with; None for none.

    Raises
    ------
    UsageError
        Something else is there.

    """
    names, own = names_to_write_into(store), (JOURNAL, MERGING)
    ours = {*own, *journal_names(store)}
    place = store.at("")
    if exists(store, IDENTITY):
        raise UsageError(
            f"{place}: an unfinished run of `generate` is there: finish it first, or give another "
            "folder"
        )
    if not has_manifest(store):
        if any(final_of(name) not in own and name not in ours for name in names):
            raise UsageError(
                f"{place}: holds something that is no dataset: give a new or empty folder"
            )
        refuse_strangers(store, ours)
        return None
    held = read_manifest(store)
    found = difference_of(identity_of(held), identity_of(part.manifest), "in the parts")
    if held.part is not None or found:
        what = f"another dataset ({found})" if found else "a part of a dataset"
        raise UsageError(f"{place}: holds {what}: give another folder")
    return held


def _check_held(store: Store, *, metadata: bool) -> None:
    """Check every byte of the data in place; of the metadata files too, if none will be written.

    A kill may leave the metadata files of the commit that it cut off.

    Raises
    ------
    CorruptDataError
        A file is missing or damaged.

    """
    damage = find_damage(store)
    if damage is not None and (damage.files or metadata):
        raise CorruptDataError(
            f"{store.at('')}: {', '.join(damage.paths[:3])}: missing or damaged: run `generate` "
            "in this folder, which mends it, then merge; or give a new folder"
        )


def _commits(held: Manifest | None, parts: Sequence[_Part]) -> Iterator[list[_Part]]:
    """Yield parts that are committed together, in order, without those that are held."""
    end = held.scenes if held else 0
    group: list[_Part] = []
    for part in parts:
        if part.numbers.stop <= end:
            continue
        if part.numbers.start < end and not group:
            raise UsageError(
                f"the dataset in place ends after scene {end - 1}, within {part.place} "
                f"({part.span}): give a new folder"
            )
        group.append(part)
        added = sum(len(each.numbers) for each in group)
        if added >= _LEAST_SHARE * end or part is parts[-1]:
            yield group
            end, group = end + added, []


def _add(
    journal: Journal, assets: pa.Table, held: Manifest | None, parts: Sequence[_Part]
) -> Manifest:
    """Commit the scenes of further parts and return the manifest."""
    manifests = [part.manifest for part in parts]
    source = SceneSource(journal.store, held, parts=[(part.store, part.manifest) for part in parts])
    wanted = Wanted(identity_of(manifests[0]), parts[-1].numbers.stop)
    return put_dataset(journal, source, assets, wanted, held, parts=manifests)
