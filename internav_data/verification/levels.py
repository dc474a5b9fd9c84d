"""`validate`: the levels of validation in order, optionally in several processes."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from internav_data.core.hardware import hardware
from internav_data.core.messages import Failed, Recipe
from internav_data.core.storage import store_of
from internav_data.core.worker_pool import WorkerPool
from internav_data.dataset import ASSETS, EPISODES, SCENES, from_table
from internav_data.dataset.manifest import MANIFEST, MANIFEST_LIMITS
from internav_data.dataset.parquet import open_stored
from internav_data.dataset.scene_hardware import ranges_of
from internav_data.records import LoaderStream, Purpose, generator
from internav_data.records.errors import InternavError, UsageError
from internav_data.verification.checked_config import CheckedConfig, checked_config
from internav_data.verification.files import (
    CHANGING,
    check_file,
    check_listing,
    check_manifest,
)
from internav_data.verification.findings import LEVELS, FindingCollector, Findings, Level, join
from internav_data.verification.scenes import check_scene
from internav_data.verification.shapes import Shapes
from internav_data.verification.tables import check_tables, number_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from internav_data.core.storage import Store, StoreLike
    from internav_data.dataset import DataFile, Manifest
    from internav_data.records import Episode, House

    Progress = Callable[[str, int, int], None]

UNTRUE = "schema not as stated: physics not checked"
FIRST_ENGINE = "bullet"
"""Engine of the datasets whose config names none."""
MAX_STARTS = 3
"""Times that a validation begins, again each time that the dataset was extended under it."""
CHECKABLE = "geometry.checkable"
"""Predicate of scenes whose values let a check fail with an error."""
SCENES_A_UNIT = 10
"""Number of scenes that a worker checks before it reports."""


@dataclass(frozen=True, slots=True)
class ShardRef:
    """Files and row groups that hold a scene's rows; `episodes` is None if it has none."""

    scene_id: str
    house: tuple[str, int]
    episodes: tuple[str, int] | None


WITHOUT_SOLID = {"schema.assets.parts", "schema.assets.corners"}
"""Findings of assets of which some part is no solid: no geometry can be checked with them."""


@dataclass(frozen=True, slots=True)
class Unit:
    """Scenes that one worker checks."""

    store: Store
    assets: DataFile
    shard_refs: tuple[ShardRef, ...]
    catalogue_version: int
    physics: CheckedConfig | None = None
    """Settings for the level `physics`; None to omit it."""
    made_here: tuple[range, ...] = ()
    """Numbers of scenes of a mixed dataset that this machine's arithmetic made."""

    def physics_of(self, scene_id: str) -> CheckedConfig | None:
        """Return the settings for one of its scenes."""
        if self.physics is None or not any(number_of(scene_id) in each for each in self.made_here):
            return self.physics
        return replace(self.physics, same_hardware=True)


def validate(
    path: StoreLike,
    level: Level = "geometry",
    sample: int | None = None,
    workers: int = 1,
    progress: Progress | None = None,
    engine: str | None = None,
) -> Findings:
    """Check every statement of a dataset, up to a level.

    Parameters
    ----------
    path
        Folder of a finished dataset, or `s3://bucket/prefix`, which is read as it is, without a
        copy.
    level
        `files`: hashes, checksums, nothing unlisted. `schema`: columns, ranges, ids.
        `geometry`: every predicate of every house and episode, derived again by shapely, scipy
        and networkx. `physics`: settling, outcomes and experts, replayed. Each level runs
        those before it; an episode whose geometry is untrue is not replayed.
    sample
        Number of scenes whose geometry and physics are checked, drawn from the dataset's seed;
        None for all.
    workers
        Processes for geometry and physics.
    progress
        Called with the level, the number of units done and the total.
    engine
        Name of another physics engine than the dataset's: at the level `physics` it is asked for
        the outcomes of all pushes, which are compared (`Findings.agreement`, no findings) and not
        replayed. None, or the dataset's own: replay.

    Returns
    -------
    Findings
        The same for any number of workers.

    Raises
    ------
    UsageError
        No such folder, level, sample, number of workers or engine.
    MissingEngineError
        The engine is not installed.
    CorruptDataError
        The folder holds no finished dataset.
    InternavError
        Some scenes could not be checked: their worker processes died again and again. Or fewer
        were checked than there are, for no reason that is a finding. Or a generator extended the
        dataset over and over meanwhile.

    """
    _check_arguments(level, sample, workers)
    store = store_of(path)
    if engine is not None:
        _check_engine(engine, level)
    for _ in range(MAX_STARTS):
        before = _version(store)
        try:
            findings = _validate_once(
                *(store, level, sample, workers, progress or (lambda *_: None), engine)
            )
        except (InternavError, OSError):
            if before == _version(store):
                raise
            continue
        if findings.ok or before == _version(store):
            return findings
    raise InternavError(
        f"{store.at('')}: a generator extended the dataset {MAX_STARTS} times while it was being "
        "validated: validate it once the generator has ended"
    )


def _version(store: Store) -> str:
    """Return a text that differs once another manifest has been put in place."""
    try:
        content = store.read(MANIFEST, stop=MANIFEST_LIMITS.max_bytes + 1)
    except OSError:
        return ""
    return hashlib.sha256(content).hexdigest()


def _validate_once(
    store: Store,
    level: Level,
    sample: int | None,
    workers: int,
    progress_callback: Progress,
    engine: str | None,
) -> Findings:
    whole = FindingCollector()
    manifest = check_manifest(store, whole)
    if manifest is None:
        return whole.findings(level)
    check_listing(store, manifest, whole)
    damaged: frozenset[str] = frozenset()
    for done, file in enumerate(manifest.files, start=1):
        report = check_file(store, file)
        if report.by_predicate:
            damaged |= {file.path}
        whole.absorb(report)
        progress_callback("files", done, len(manifest.files))
    tables = FindingCollector()
    if level != "files":
        progress_callback("schema", 0, 1)
        tables, unsafe = check_tables(store, manifest, damaged)
        whole.absorb(tables)
        progress_callback("schema", 1, 1)
        damaged |= unsafe
        if WITHOUT_SOLID & set(tables.by_predicate):
            damaged |= {file.path for file in manifest.of("assets")}
    if level in {"geometry", "physics"}:
        physics = _physics_of(manifest, engine) if level == "physics" else None
        if physics is not None and tables.by_predicate:
            # The engine must not receive values that may not be numbers at all.
            physics = None
            whole.notes[UNTRUE] += sum(counts.episodes for counts in manifest.counts.values())
        _check_scenes(store, manifest, damaged, whole, sample, workers, progress_callback, physics)
        if whole.counts["made elsewhere"]:
            known = manifest.hardware_scenes is not None
            names = [name for name in manifest.hardware if not known or name != hardware()]
            whole.judge_differences("; ".join(names) or "hardware that is not stated")
    found = whole.findings(level)
    _account_for(manifest, found, sample, store.at(""))
    return found


def _physics_of(manifest: Manifest, engine: str | None) -> CheckedConfig:
    """Return the settings of the level `physics`; `engine` as in `validate`."""
    config, here = checked_config(manifest.config), manifest.hardware == (hardware(),)
    other = None if engine == (config.engine or FIRST_ENGINE) else engine
    return replace(config, same_hardware=here or other is not None, other_engine=other)


def _account_for(manifest: Manifest, found: Findings, sample: int | None, place: str) -> None:
    """Compare what was checked with what there is: nothing is called valid that nobody looked at.

    Raises
    ------
    InternavError
        No finding says why something was left out.

    """
    scenes = sum(counts.scenes for counts in manifest.counts.values())
    episodes = sum(counts.episodes for counts in manifest.counts.values())
    files = len(manifest.files) + len(manifest.metadata or ())
    asked = {"files": files - found.notes.get(CHANGING, 0)}
    if found.level in {"geometry", "physics"}:
        asked["scenes"] = scenes if sample is None else min(sample, scenes)
        if sample is None:
            asked["episodes"] = episodes
    if found.level == "physics" and not found.notes:
        asked["replayed"] = asked.get("episodes", found.checked.get("episodes", 0))
    for name, count in asked.items():
        checked = found.checked.get(name, 0)
        if found.ok and checked < count:
            raise InternavError(
                f"{place}: {checked} of {count} {name} were checked and nothing says why; run the "
                "same command again, and report this if it comes back"
            )


def _check_arguments(level: str, sample: int | None, workers: int) -> None:
    if level not in LEVELS:
        raise UsageError(f"level: expected one of {', '.join(LEVELS)}, got {level!r}")
    if sample is not None and sample < 1:
        raise UsageError(f"sample: expected at least 1 scene, got {sample}")
    if workers < 1:
        raise UsageError(f"workers: expected at least 1, got {workers}")


def _check_engine(engine: str, level: str) -> None:
    if level != "physics":
        raise UsageError(f"engine {engine!r}: only the level physics asks one, got level {level!r}")
    from internav_data.verification.replay.comparison import check_engine  # noqa: PLC0415 - engines

    check_engine(engine)


def _check_scenes(
    store: Store,
    manifest: Manifest,
    damaged: frozenset[str],
    whole: FindingCollector,
    sample: int | None,
    workers: int,
    progress_callback: Progress,
    physics: CheckedConfig | None,
) -> None:
    assets = [file for file in manifest.of("assets") if file.path not in damaged]
    shard_refs = _shard_refs(store, manifest, damaged)
    if not assets or not shard_refs:
        return
    if sample is not None and sample < len(shard_refs):
        rng = generator(manifest.seed, Purpose.LOADER, attempt=LoaderStream.ROWS, draw=sample)
        chosen = sorted(rng.permutation(len(shard_refs))[:sample].tolist())
        shard_refs = [shard_refs[k] for k in chosen]
    made_here = ranges_of((manifest.hardware_scenes or {}).get(hardware(), ""))
    units = [
        Unit(
            store,
            assets[0],
            tuple(shard_refs[k : k + SCENES_A_UNIT]),
            manifest.catalogue_version,
            physics,
            made_here,
        )
        for k in range(0, len(shard_refs), SCENES_A_UNIT)
    ]
    done = 0
    for unit, report in zip(units, _check_units(units, workers), strict=True):
        whole.absorb(report)
        done += len(unit.shard_refs)
        progress_callback("geometry" if physics is None else "physics", done, len(shard_refs))


def _check_units(units: Sequence[Unit], workers: int) -> Iterator[FindingCollector]:
    """Yield the findings of each unit, in order.

    Raises
    ------
    InternavError
        A unit could not be checked: its worker died again and again, or met a bug.
    """
    if workers == 1 or len(units) == 1:
        yield from map(check_unit, units)
        return
    waiting: dict[int, FindingCollector] = {}
    following = 0
    with WorkerPool(min(workers, len(units)), Recipe(_unit_checker, tuple(units))) as pool:
        for result in pool.run(range(len(units))):
            if isinstance(result, Failed):
                raise InternavError(_unchecked(units[result.task], result.reason))
            waiting[result.task] = result.value
            while following in waiting:
                yield waiting.pop(following)
                following += 1


def _unit_checker(units: Sequence[Unit]) -> Callable[[int], FindingCollector]:
    """Set a worker up: return a function that checks the unit of a number."""
    return lambda number: check_unit(units[number])


def _unchecked(unit: Unit, reason: str) -> str:
    first, last = unit.shard_refs[0].scene_id, unit.shard_refs[-1].scene_id
    return f"{unit.store.at('')}: {first} … {last} could not be checked: {reason}"


def _shard_refs(store: Store, manifest: Manifest, damaged: frozenset[str]) -> list[ShardRef]:
    """Find every scene's rows, in order of scenes."""
    found: dict[str, dict[str, tuple[str, int]]] = {"scenes": {}, "episodes": {}}
    for name, spec in (("scenes", SCENES), ("episodes", EPISODES)):
        for file in manifest.of(name):
            if file.path in damaged:
                continue
            with open_stored(store, file.path, spec) as parquet:
                for group in range(parquet.metadata.num_row_groups):
                    column = parquet.read_group(group, ["scene_id"])
                    for scene_id in column.column(0).unique().to_pylist():
                        found[name].setdefault(scene_id, (file.path, group))
    return [
        ShardRef(scene_id, found["scenes"][scene_id], found["episodes"].get(scene_id))
        for scene_id in sorted(found["scenes"], key=lambda s: (number_of(s), s))
    ]


class _Reader:
    """Reader of row groups as records; it caches the last one of each table."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._last: dict[str, tuple[tuple[str, int], list[Any]]] = {}

    def _group(self, name: str, row_group: tuple[str, int]) -> list[Any]:
        if name not in self._last or self._last[name][0] != row_group:
            file, group = row_group
            spec = SCENES if name == "scenes" else EPISODES
            with open_stored(self._store, file, spec) as parquet:
                table = parquet.read_group(group)
            extra: dict[str, Any] | None = {"assets": {}} if name == "scenes" else None
            self._last[name] = (row_group, from_table(table, spec, extra))
        return self._last[name][1]

    def house(self, shard_ref: ShardRef) -> House:
        houses: list[House] = self._group("scenes", shard_ref.house)
        return next(house for house in houses if house.scene_id == shard_ref.scene_id)

    def episodes(self, shard_ref: ShardRef) -> list[Episode]:
        if shard_ref.episodes is None:
            return []
        group = self._group("episodes", shard_ref.episodes)
        return [episode for episode in group if episode.scene_id == shard_ref.scene_id]


_SHAPES: dict[str, Shapes] = {}
"""Shapes of this process, by sha256 of the assets' file, computed once for all its units."""


def check_unit(unit: Unit) -> FindingCollector:
    """Check the geometry of a unit's scenes, and the physics if the unit asks for it."""
    reader, reports = _Reader(unit.store), []
    for shard_ref in unit.shard_refs:
        file = shard_ref.episodes[0] if shard_ref.episodes else shard_ref.house[0]
        report = FindingCollector(file, shard_ref.scene_id)
        with report.guard(CHECKABLE):
            house, episodes = reader.house(shard_ref), reader.episodes(shard_ref)
            physics = unit.physics_of(shard_ref.scene_id)
            report.absorb(
                check_scene(
                    *(house, episodes, _shapes(unit), file, physics, unit.catalogue_version)
                )
            )
        reports.append(report)
    return join(reports)


def _shapes(unit: Unit) -> Shapes:
    key = unit.assets.sha256
    if key not in _SHAPES:
        _SHAPES.clear()
        with open_stored(unit.store, unit.assets.path, ASSETS) as parquet:
            table = parquet.read_all()
        _SHAPES[key] = Shapes({a.asset_id: a for a in from_table(table, ASSETS)})
    return _SHAPES[key]
