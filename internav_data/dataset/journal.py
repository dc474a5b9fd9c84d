"""The journal of a commit: names of the files that it puts or replaces, noted before it does.

A kill leaves files behind that no manifest names: shards that were put but not committed, shards
that were replaced but not yet removed, temporary files. They are told from a stranger's files by
their names in the journal, which the next commit reads: nothing else is ever removed. The journal
holds its own digest: with one flipped bit it might name a stranger's file.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from internav_data.core.files import FileLimits, check_sha256, parse_json, with_sha256
from internav_data.core.storage import exists, final_of, temporary_of
from internav_data.dataset.manifest import inner_path
from internav_data.dataset.staging import STAGING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import Manifest

JOURNAL = f"{STAGING}journal.json"
"""Name of the journal: a list of names, with its digest, in JSON."""
_NAMES = "names"
_LIMITS = FileLimits(
    max_bytes=64 << 20,
    max_values=500_000,
    remedy="remove it; then what `validate` calls unlisted is yours to remove",
)


class Journal:
    """Names of the files that commits of a store may have left behind.

    Raises
    ------
    CorruptDataError
        The journal of an earlier commit is damaged.

    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self._names = set(journal_names(store))

    def put(self, name: str, data: bytes) -> None:
        """Note a name, then store a blob under it."""
        self.announce(name)
        self.store.put(name, data)

    def announce(self, *names: str) -> None:
        """Note names under which blobs are to be put, and those of their temporary files."""
        temporary = (name for name in map(temporary_of, names) if not exists(self.store, name))
        self.note([*names, *temporary])

    def note(self, names: Iterable[str]) -> None:
        """Note names of files that are to be put or removed."""
        if not self._names.issuperset(names := set(names)):
            self._names |= names
            self.store.put(JOURNAL, journal_bytes(self._names))

    def sweep(self, manifest: Manifest | None) -> None:
        """Remove all files that are noted and that the manifest in place does not name."""
        for name in sorted(self._names - (manifest.paths() if manifest else frozenset())):
            self.store.remove(name)
        self.store.remove(JOURNAL)
        for name in self.store.names(STAGING):
            if final_of(name) == JOURNAL:  # its own temporary file, after a kill
                self.store.remove(name)
        self._names.clear()


def journal_bytes(names: Iterable[str]) -> bytes:
    """Return the content of a journal that notes names."""
    return (json.dumps(with_sha256({_NAMES: sorted(names)}), indent=1) + "\n").encode()


def journal_names(store: Store) -> tuple[str, ...]:
    """Return the names that a commit noted which is under way or was cut off; none otherwise.

    Raises
    ------
    CorruptDataError
        The journal is damaged.

    """
    if not exists(store, JOURNAL):
        return ()
    place = store.at(JOURNAL)
    values = parse_json(store.read(JOURNAL, stop=_LIMITS.max_bytes + 1), place, _LIMITS)
    values = values if isinstance(values, dict) else {}
    check_sha256(values, place, _LIMITS, ())
    names = values.get(_NAMES)
    if not isinstance(names, list) or not all(map(_inside, names)):
        raise _LIMITS.refusal(place, "expected a list of names of files of the dataset")
    return tuple(names)


def _inside(name: object) -> bool:
    pure = inner_path(name)
    return pure is not None and pure.parts[0] != STAGING.rstrip("/")
