"""The manifest: identity, counts and files of a dataset. It is written last.

A folder without `manifest.json` is no dataset; a reader opens exactly the files that it names. It
holds nothing of the clock, the place or the number of workers, and of the machine only the name of
its arithmetic, so the same configuration and seed give the same bytes.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping  # noqa: TC003 - read at run time for the JSON Schema
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, TypeVar

from internav_data.core.config import MAX_SEED
from internav_data.core.files import FileLimits, check_sha256, json_sha256, parse_json
from internav_data.core.storage import Store, StoreLike, exists, store_of
from internav_data.dataset.compatibility import present_settings
from internav_data.dataset.consistency import inconsistencies
from internav_data.dataset.location import MINI, making_command
from internav_data.dataset.parquet import TableFile, footer_sha256, open_stored
from internav_data.dataset.staging import IDENTITY, STAGING
from internav_data.dataset.tables import FORMAT_VERSION, TABLES
from internav_data.records import Split  # noqa: TC001 - as above
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    from internav_data.dataset.tables import TableSpec

D = TypeVar("D", bound="DataclassInstance")

MANIFEST = "manifest.json"
_MAX_FILES = 100_000
_MAX_FILE_BYTES = 1 << 40
_MAX_ROWS = 1 << 40
_AGAIN = "restore it from where the dataset came, or generate the dataset anew"
_KEYS_WITHOUT_DIGEST = frozenset(
    (
        *("format_version", "generator", "generator_version", "seed", "catalogue_version"),
        *("catalogue_digest", "config", "counts", "scenes", "redraws", "quarantined", "files"),
        "requires",
    )
)
"""Keys of a manifest that may lack its digest: those of the releases before it was written."""
MANIFEST_LIMITS = FileLimits(remedy=_AGAIN, max_bytes=32 << 20, max_values=1_000_000)
"""Limits of the file: 1,000,000 scenes take 2.4 MB; 100,000 quarantined ones add some 25 MB."""


@dataclass(frozen=True, slots=True)
class DataFile:
    """One Parquet file of a dataset."""

    path: str
    """Relative to the dataset's folder, with forward slashes."""
    table: str
    """episodes, scenes or assets."""
    split: Split | None
    """None for the assets, which all splits share."""
    rows: int
    bytes: int
    """Size of the file."""
    sha256: str
    """SHA-256 of the file's bytes, 64 hexadecimal digits."""
    footer_sha256: str
    """SHA-256 of the Parquet footer, the file's last bytes: checked whenever the file is opened."""
    logical_digest: str
    """Digest of the file's values, the same for every library that wrote it (docs/dataset.md)."""


@dataclass(frozen=True, slots=True)
class MetadataFile:
    """One file beside the data: dataset card, statistics or a schema."""

    path: str
    """Relative to the dataset's folder, with forward slashes."""
    bytes: int
    """Size of the file."""
    sha256: str
    """SHA-256 of the file's bytes, 64 hexadecimal digits."""


@dataclass(frozen=True, slots=True)
class Quarantined:
    """A scene that could not be built within the stated bounds."""

    scene: int
    scene_id: str
    attempts: int
    reason: str
    died: bool = False
    """Whether the processes that made it died: the scene may be fine, and the next run tries it
    again."""


@dataclass(frozen=True, slots=True)
class Counts:
    """Numbers of scenes and episodes of one split."""

    scenes: int
    episodes: int


@dataclass(frozen=True, slots=True)
class DatasetPart:
    """Range of scenes that a part of a dataset is to hold, and the code that makes them."""

    first_scene: int
    """Number of its first scene."""
    end_scene: int
    """Number after that of its last scene once it is finished."""
    rules: str
    """Digest of the code that makes its scenes, 64 hexadecimal digits."""


@dataclass(frozen=True, slots=True)
class Manifest:
    """Description of a dataset: its identity, its counts and its files."""

    format_version: int
    generator: str
    generator_version: str
    seed: int
    catalogue_version: int
    catalogue_digest: str
    config: Mapping[str, Any]
    """The resolved configuration; the number of scenes and workers is no part of it."""
    counts: Mapping[str, Counts]
    """Counts by split."""
    scenes: int
    """Number of scenes, quarantined ones included: 0 … scenes - 1, or as many from the first one of
    a part on. Those that are not quarantined are in the files."""
    redraws: Mapping[str, int]
    """Number of redraws while generating, by reason."""
    quarantined: tuple[Quarantined, ...]
    files: tuple[DataFile, ...]
    requires: tuple[str, ...] = ()
    """Keys and columns that a reader must know; it ignores any other that it does not know."""
    metadata: tuple[MetadataFile, ...] | None = None
    """Files beside the data; null in datasets of earlier releases, which do not list them."""
    hardware: tuple[str, ...] = ()
    """Names of the arithmetic (`internav_data.core.hardware`) that the scenes were made with; empty
    where it is not known. Machines of the same name make the same bytes."""
    obstacle_shares: Mapping[str, float] | None = None
    """Share of each type of obstacle among what is drawn; null in datasets of earlier releases."""
    part: DatasetPart | None = None
    """Range of a part of a dataset, which `internav-gen merge` joins with the others; null for a
    dataset, whose scenes begin at 0."""
    hardware_scenes: Mapping[str, str] | None = None
    """Scenes by the name of the arithmetic that made them, as ranges of numbers (`0:6,8:9`);
    quarantined ones are left out. Null where one made all, or where it is not known."""
    sha256: str = ""
    """SHA-256 of the canonical text of all other keys (docs/dataset.md), 64 hexadecimal digits;
    filled in when the manifest is written."""

    @property
    def scene_numbers(self) -> range:
        """Numbers of its scenes, quarantined ones included."""
        first = self.part.first_scene if self.part else 0
        return range(first, first + self.scenes)

    def of(self, table: str, split: str | None = None) -> tuple[DataFile, ...]:
        """Return the files of one table (of one split, if given) in order."""
        return tuple(
            f for f in self.files if f.table == table and (split is None or f.split == split)
        )

    def paths(self) -> frozenset[str]:
        """Return the names of all files of the dataset, its own included."""
        extra = (file.path for file in self.metadata or ())
        return frozenset({MANIFEST, *extra, *(file.path for file in self.files)})

    def to_json(self) -> str:
        """Return the text of the manifest's file."""
        return json.dumps(dataclasses.asdict(self), indent=1, ensure_ascii=False) + "\n"


def write_manifest(root: StoreLike, manifest: Manifest) -> Manifest:
    """Put a manifest in place and return it with its digest: from then on readers see its dataset.

    Raises
    ------
    CorruptDataError
        Its counts contradict its files; what is in place stays.

    """
    store = store_of(root)
    _check_consistency(store.at(MANIFEST), manifest)
    digest = json_sha256(dataclasses.asdict(manifest))
    whole = dataclasses.replace(manifest, sha256=digest)
    store.put(MANIFEST, whole.to_json().encode())
    return whole


def has_manifest(root: StoreLike) -> bool:
    """Return whether a folder holds a finished dataset."""
    return exists(store_of(root), MANIFEST)


def read_manifest(root: StoreLike) -> Manifest:
    """Return a dataset's manifest, checked: its digest, types, bounds, counts and paths.

    Raises
    ------
    CorruptDataError
        Missing, damaged, of another format, naming files outside the dataset, or with counts that
        contradict its files.

    """
    return read_manifest_and_digest(root)[0]


def read_manifest_and_digest(root: StoreLike) -> tuple[Manifest, str]:
    """Return a dataset's manifest as `read_manifest`, and the SHA-256 of the bytes that were read.

    Raises
    ------
    CorruptDataError
        As `read_manifest`.

    """
    store = store_of(root)
    path = store.at(MANIFEST)
    try:
        content = store.read(MANIFEST, stop=MANIFEST_LIMITS.max_bytes + 1)
    except FileNotFoundError:
        raise CorruptDataError(_absence(store)) from None
    except OSError as error:
        raise CorruptDataError(f"{path}: cannot be read: {error.strerror}: {_AGAIN}") from error
    raw = parse_json(content, path, MANIFEST_LIMITS)
    _check_version(path, raw)
    check_sha256(raw, path, MANIFEST_LIMITS, _KEYS_WITHOUT_DIGEST)
    manifest = _parse(path, raw)
    if len(manifest.files) > _MAX_FILES:
        raise CorruptDataError(f"{path}: names more than {_MAX_FILES} files: {_AGAIN}")
    for file in manifest.files:
        _check_entry(path, file)
    for extra in manifest.metadata or ():
        _check_metadata_entry(path, extra)
    _check_consistency(path, manifest)
    return manifest, hashlib.sha256(content).hexdigest()


def _absence(store: Store) -> str:
    root = store.at("")
    if exists(store, IDENTITY):
        return (
            f"{root}: the dataset is not finished (no {MANIFEST}, but .work/): "
            "run `internav-gen generate` on it again to resume"
        )
    return (
        f"{root}: no dataset here ({MANIFEST} is missing): "
        f"`{making_command(Path(root))}` makes one, "
        f"`{MINI}` names the one that ships"
    )


def _check_version(path: str, raw: Any) -> None:  # noqa: ANN401 - JSON
    version = raw.get("format_version") if isinstance(raw, dict) else None
    if not isinstance(version, int) or isinstance(version, bool) or version < 1:
        raise CorruptDataError(
            f"{path}: format_version: expected a number, got {version!r}: {_AGAIN}"
        )
    if version < FORMAT_VERSION:
        raise CorruptDataError(
            f"{path}: written in format version {version}, whose columns have other names; this "
            f"release reads version {FORMAT_VERSION}: generate the dataset anew, with the same "
            "seed and config"
        )
    if version > FORMAT_VERSION:
        raise CorruptDataError(
            f"{path}: written in format version {version}, this release reads up to "
            f"{FORMAT_VERSION}: upgrade with `pip install --upgrade internav-data`"
        )


def _check_consistency(path: str, manifest: Manifest) -> None:
    if found := next(inconsistencies(manifest), None):
        raise CorruptDataError(f"{path}: {found}: {_AGAIN}")


def _parse(path: str, raw: dict[str, Any]) -> Manifest:
    try:
        values = dict(raw)
        values["counts"] = {str(k): _made(Counts, v) for k, v in raw["counts"].items()}
        values["quarantined"] = tuple(_made(Quarantined, q) for q in raw["quarantined"])
        if isinstance(raw["config"], dict):
            values["config"] = present_settings(raw["config"])
        values["files"] = tuple(_made(DataFile, f) for f in raw["files"])
        values["requires"] = tuple(map(str, raw.get("requires", ())))
        values["hardware"] = tuple(map(str, raw.get("hardware") or ()))
        if raw.get("part") is not None:
            values["part"] = _made(DatasetPart, raw["part"])
        if raw.get("metadata") is not None:
            values["metadata"] = tuple(_made(MetadataFile, m) for m in raw["metadata"])
        manifest = _made(Manifest, values)
    except (TypeError, ValueError, AttributeError, KeyError) as error:
        raise CorruptDataError(f"{path}: not a manifest ({error}): {_AGAIN}") from error
    if type(manifest.seed) is not int or not 0 <= manifest.seed <= MAX_SEED:
        raise CorruptDataError(
            f"{path}: seed: expected 0 … 2^63 - 1, got {manifest.seed!r}: {_AGAIN}"
        )
    unknown = sorted(set(manifest.requires) - known_features())
    if unknown:
        raise CorruptDataError(
            f"{path}: this release does not know {', '.join(unknown)}, which the dataset requires: "
            "upgrade with `pip install --upgrade internav-data`"
        )
    return manifest


def _made(cls: type[D], raw: Mapping[str, Any]) -> D:
    """Return a dataclass of a JSON object's keys; those that it has no field for are ignored."""
    names = {f.name for f in dataclasses.fields(cls)}
    return cls(**{key: value for key, value in raw.items() if key in names})


def known_features() -> frozenset[str]:
    """Return all that `requires` may name: manifest keys, and columns as `table.column`."""
    keys = {f.name for f in dataclasses.fields(Manifest)}
    return frozenset(
        keys | {f"{spec.name}.{name}" for spec in TABLES for name in spec.schema.names}
    )


def _check_entry(manifest: str, file: DataFile) -> None:
    where = f"{manifest}: file {file.path!r}"
    pure = inner_path(file.path)
    if pure is None or pure.parts[0] != "data" or pure.suffix != ".parquet":
        raise CorruptDataError(f"{where}: expected a Parquet file below data/: {_AGAIN}")
    for name, value, most in (
        ("rows", file.rows, _MAX_ROWS),
        ("bytes", file.bytes, _MAX_FILE_BYTES),
    ):
        if type(value) is not int or not 0 <= value <= most:
            raise CorruptDataError(f"{where}: {name}: expected 0 … {most}, got {value!r}: {_AGAIN}")


def _check_metadata_entry(manifest: str, file: MetadataFile) -> None:
    where = f"{manifest}: metadata {file.path!r}"
    pure = inner_path(file.path)
    if pure is None or pure.parts[0] in {"data", MANIFEST, STAGING.rstrip("/")}:
        raise CorruptDataError(f"{where}: expected a file beside data/: {_AGAIN}")
    if type(file.bytes) is not int or not 0 <= file.bytes <= _MAX_FILE_BYTES:
        raise CorruptDataError(
            f"{where}: bytes: expected 0 … {_MAX_FILE_BYTES}, got {file.bytes!r}: {_AGAIN}"
        )


def inner_path(path: object) -> PurePosixPath | None:
    """Return a relative path that stays inside its folder; None for anything else."""
    if not isinstance(path, str) or {"\\", "\0"} & set(path):
        return None
    pure = PurePosixPath(path)
    return None if pure.is_absolute() or not pure.parts or ".." in pure.parts else pure


def open_file(root: StoreLike, file: DataFile, spec: TableSpec[Any]) -> TableFile:
    """Open a file of the manifest; whatever is read from it is verified.

    Raises
    ------
    CorruptDataError
        Missing, truncated, edited, or of other columns.

    """
    store = store_of(root)
    check_file(store, file)
    try:
        footer = footer_sha256(store, file.path, file.bytes)
    except OSError as error:  # a commit has removed it since
        raise _missing(store, file, error) from None
    if footer != file.footer_sha256:
        raise CorruptDataError(
            f"{store.at(file.path)}: the file's footer was damaged or edited: {_AGAIN}"
        )
    opened = open_stored(store, file.path, spec)
    if opened.metadata.num_rows != file.rows:
        opened.close()
        raise CorruptDataError(
            f"{store.at(file.path)}: expected {file.rows} rows, got {opened.metadata.num_rows}: "
            f"{_AGAIN}"
        )
    return opened


def locate(root: Path, file: DataFile) -> Path:
    """Return the path of a file of the manifest, checked as by `check_file`.

    Raises
    ------
    CorruptDataError
        Missing or of another size.

    """
    check_file(root, file)
    return root / file.path


def check_file(root: StoreLike, file: DataFile) -> None:
    """Check that a file of the manifest is there and of the stated size.

    Raises
    ------
    CorruptDataError
        Missing or of another size.

    """
    store = store_of(root)
    try:
        size = store.size(file.path)
    except OSError as error:
        raise _missing(store, file, error) from None
    if size != file.bytes:
        raise CorruptDataError(
            f"{store.at(file.path)}: expected {file.bytes} bytes, got {size} (truncated or "
            f"edited): {_AGAIN}"
        )


def _missing(store: Store, file: DataFile, error: OSError) -> CorruptDataError:
    return CorruptDataError(
        f"{store.at(file.path)}: the file is missing ({error.strerror}): {_AGAIN}"
    )
