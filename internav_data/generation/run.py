"""Runs: from a config to a finished dataset, through kills and resumes.

Every scene is a pure function of the config and its index. Workers stage each finished scene as one
file; scenes are put together in order of their index, the first ones as soon as they fill a shard.
So neither the executor, the number of workers and the order in which they end, nor any kill and
resume, changes a byte.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from internav_data.core.extras import require
from internav_data.core.interrupts import InterruptedRunError, Interrupts
from internav_data.core.messages import Done, Failed, Recipe
from internav_data.core.storage import FolderStore, disk_errors, store_of
from internav_data.dataset import (
    STAGING,
    DatasetPart,
    Identity,
    any_staged,
    assemble,
    clear_staging,
    commit_scenes,
    done_scenes,
    end_staging,
    find_damage,
    has_manifest,
    held_config,
    open_staging,
    read_manifest,
    repair_files,
    stage_quarantine,
    staged_scenes,
)
from internav_data.generation.commits import PrefixCommits
from internav_data.generation.config import GenerationConfig
from internav_data.generation.executors import DEFAULT_EXECUTOR, Executor, get_executor
from internav_data.generation.progress import GenerationProgress
from internav_data.generation.report import Report, report_of
from internav_data.generation.rules import source_digest
from internav_data.generation.scenes import (
    ScenePayload,
    asset_folders,
    obstacle_shares,
    scene_maker,
)
from internav_data.houses.quota import room_count
from internav_data.physics.config import FIRST_PHYSICS, PhysicsConfig
from internav_data.physics.engines import DEFAULT_ENGINE
from internav_data.physics.engines.installed import require_engine
from internav_data.records import Pose
from internav_data.records.errors import (
    CorruptDataError,
    QuarantineError,
    UsageError,
)
from internav_data.records.splits import split_of_scene
from internav_data.records.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from internav_data.catalog import Catalogue
    from internav_data.core.storage import Store, StoreLike
    from internav_data.dataset import Manifest, Retry, Staging
    from internav_data.records import Asset

GENERATOR = "internav-gen"
BUSY = f"another {GENERATOR} is writing this dataset; wait for it to end or choose another --out"
"""Reason for which a second run in the same folder is refused."""
MAX_SCENES = 10_000_000
"""Number of scenes of a dataset: the manifest of more would be too large (`MANIFEST_LIMITS`)."""
MAX_FIRST_FAILURES = 20
"""Scenes that fail before one succeeds, after which the config is at fault."""
MAX_NAMED_MESHES = 5
"""Meshes that one error message names."""
_FIRST: Final = GenerationConfig(physics=FIRST_PHYSICS)
"""Values of the settings that a dataset's config lacks, since it is older than they are."""
TAIL_SCENES = 8
"""Last scenes, a slot of the executor, that begin largest first, so that all slots end together."""


def generate(
    out: StoreLike,
    config: GenerationConfig,
    scenes: int | range,
    workers: int = 0,
    progress: GenerationProgress | None = None,
    assets: Catalogue | None = None,
    executor: str | Executor = DEFAULT_EXECUTOR,
    setup: Callable[[ScenePayload], Callable[[int], int]] = scene_maker,
    *,
    retry_quarantined: bool = False,
    ray_address: str | None = None,
) -> Report:
    """Make a dataset of scenes 0 to scenes - 1 or a part of one, continue it, or extend it.

    The first scenes can be read while the others are being made. Quarantined scenes whose workers
    died are tried again.

    Parameters
    ----------
    out
        The dataset's folder, or `s3://bucket/prefix`: new, empty, or one that holds a dataset of
        this config.
    config
        Settings of every scene.
    scenes
        Number of scenes that the dataset is to hold; or a range of scenes: then it is a part of a
        dataset, which `internav_data.dataset.merge` joins with others.
    workers
        Number of scenes made at the same time; 0 for the executor's default, one a core.
    progress
        Reporter of every scene; silent by default.
    assets
        The catalogue of the config's asset folders, if it is loaded already.
    executor
        Name in `EXECUTORS`, or an executor, which then has its own number of workers.
    setup
        Recipe of the workers; tests pass stubs.
    retry_quarantined
        Whether to try all quarantined scenes again, those too that failed by themselves.
    ray_address
        Address of the cluster of the executor "ray": `host:port`, `auto`, or None for the one that
        runs on this machine.

    Raises
    ------
    ModuleNotFoundError
        A package of the extra `generate` is missing, or Ray where it is the executor.
    MissingEngineError
        The config's physics engine is not installed.
    UsageError
        A count or setting out of its bounds, or a folder that holds something else; a Ray cluster
        that does not answer, or a node of it with other versions than this machine.
    LockedError
        Another generator is at work in the folder.
    InterruptedRunError
        A signal ended the run; the first scenes can be read, all finished ones are kept, and the
        same call continues.
    QuarantineError
        Not one scene could be made.
    InternavError
        A full or read-only disk; finished scenes are kept.

    """
    # In a worker, what is missing would be a failure of each scene.
    require("numba", "platformdirs", "scipy")
    progress = progress or GenerationProgress()
    numbers = check_scenes(scenes)
    config.check()
    if isinstance(executor, str):
        executor = get_executor(executor, workers, ray_address)
    store = store_of(out)
    place = store.at("").rstrip("/")
    with disk_errors(place):
        _require_engine(config, store)
    assets = assets or _catalogue(config)
    identity = identity_for(config, assets)
    part = (
        None if isinstance(scenes, int) else DatasetPart(scenes.start, scenes.stop, identity.rules)
    )
    with disk_errors(place):
        if isinstance(store, FolderStore) and store.root.exists() and not store.root.is_dir():
            raise UsageError(f"{place} is a file: give a folder that is new, empty or a dataset")
        with store.lock(BUSY):
            _forget_idle_staging(store)
            staging = open_staging(store, identity, _FIRST.identity(assets.digest), part)
            done = _done_before(staging, numbers, "all" if retry_quarantined else "died")
            numbers = range(numbers.start, max(numbers.stop, _held_end(store)))
            part = replace(part, end_scene=numbers.stop) if part else None
            commits = PrefixCommits(staging, identity, _all_of(assets), done, progress, part)
            queue = _SceneQueue(config, numbers, tuple(k for k in numbers if k not in done))
            recipe = Recipe(setup, ScenePayload(config, assets, staging))
            with Interrupts() as stop:
                _repair(executor, recipe, progress, stop)
                _make(executor, recipe, queue, commits, progress, stop)
                if stop():
                    commits.commit_all()
                    raise InterruptedRunError(_interruption(place, progress), stop.signum)
            manifest = _assembled(staging, identity, assets, numbers, progress, part)
    return report_of(store.root if isinstance(store, FolderStore) else place, manifest, progress)


def with_held_engine(config: GenerationConfig, out: StoreLike) -> GenerationConfig:
    """Return a config with the physics engine of the dataset that a folder holds, if it holds one.

    Raises
    ------
    CorruptDataError
        The dataset's manifest is damaged, or names no engine that there is.

    """
    held = held_config(out)
    if held is None:
        return config
    engine = PhysicsConfig.of_dataset(held).engine
    return replace(config, physics=replace(config.physics, engine=engine))


def _require_engine(config: GenerationConfig, store: Store) -> None:
    """Check that the engine is installed; another one is offered where no scene is made yet."""
    begun = held_config(store) is not None
    place = store.at("") if begun else ""
    require_engine(config.physics.engine, place, switchable=not begun)
    if config.physics.other_engine is not None:
        require_engine(config.physics.other_engine, "cross-check")


def _catalogue(config: GenerationConfig) -> Catalogue:
    from internav_data.catalog import catalogue  # noqa: PLC0415

    assets = catalogue(asset_folders(config))
    if config.assets:
        ours = catalogue().assets
        users = [a for asset_id, a in assets.assets.items() if asset_id not in ours]
        check_standing(users, config.physics.engine)
    return assets


def check_standing(assets: Iterable[Asset], engine: str = DEFAULT_ENGINE) -> None:
    """Refuse meshes that do not stay where they are put: none of them would be spawned.

    Parameters
    ----------
    assets
        Assets of a user.
    engine
        Name of the physics engine that lets them fall.

    Raises
    ------
    UsageError
        Some meshes tip over or roll away; it names them.

    """
    from internav_data.physics import Body, settle  # noqa: PLC0415 - numba, for users with meshes
    from internav_data.physics.scene import UPRIGHT  # noqa: PLC0415 - as above

    origin = Pose(0.0, 0.0, 0.0, UPRIGHT)
    rests = (
        (asset.asset_id, settle(Body.of(asset, origin), math.inf, tuple, engine).refusal)
        for asset in assets
    )
    fallen = [f"{asset_id} {refusal}" for asset_id, refusal in rests if refusal]
    if fallen:
        named = ", ".join(fallen[:MAX_NAMED_MESHES])
        more = ", …" if len(fallen) > MAX_NAMED_MESHES else ""
        raise UsageError(
            f"assets: {len(fallen)} of your meshes do not stay where they are put "
            f"({named}{more}); write "
            "lay_flat = true or ignore = true for them in assets.toml, or turn them yourself"
        )


def check_scenes(scenes: int | range) -> range:
    """Return the numbers of a dataset's scenes, given how many they are or which.

    Raises
    ------
    UsageError
        They are none, or beyond `MAX_SCENES`.

    """
    if isinstance(scenes, range):
        first, end = scenes.start, scenes.stop
        if scenes.step != 1 or not 0 <= first < end <= MAX_SCENES:
            raise UsageError(
                f"scene range is {first}:{end}: expected A:B with 0 <= A < B <= {MAX_SCENES:,}, "
                "for the scenes A up to B - 1"
            )
        return scenes
    if not 1 <= scenes <= MAX_SCENES:
        raise UsageError(f"scenes is {scenes}: ask for 1 to {MAX_SCENES:,} scenes")
    return range(scenes)


def identity_for(config: GenerationConfig, assets: Catalogue) -> Identity:
    """Return the identity of a dataset: runs with equal ones make the same scenes."""
    return Identity(
        generator=GENERATOR,
        generator_version=__version__,
        seed=config.seed,
        catalogue_version=assets.version,
        catalogue_digest=assets.digest,
        config=config.identity(assets.digest),
        rules=source_digest(),
        obstacle_shares=obstacle_shares(assets, config),
    )


def _all_of(assets: Catalogue) -> tuple[Asset, ...]:
    return tuple(assets.assets.values())


def _done_before(staging: Staging, numbers: range, retry: Retry) -> frozenset[int]:
    done, store = done_scenes(staging, retry), staging.store
    first, end = min(done, default=numbers.start), max(done, default=-1) + 1
    if first < numbers.start or _held_end(store) < numbers.stop < end:
        least = min(first, numbers.start)
        wanted = f"--scene-range {least}:{end}" if numbers.start else f"--scenes {end}"
        raise UsageError(
            f"{store.at('')}: scenes {first} to {end - 1} are finished there and would be lost: "
            f"ask for {wanted} or more, or remove {store.at(STAGING)} first"
        )
    return done


def _held_end(store: Store) -> int:
    """Return the number after that of the last scene of the dataset in place; 0 without one."""
    return read_manifest(store).scene_numbers.stop if has_manifest(store) else 0


@dataclass(frozen=True, slots=True)
class _SceneQueue:
    """Scenes that a run has to make."""

    config: GenerationConfig
    numbers: range
    """Numbers of the dataset's scenes, those made before included."""
    todo: tuple[int, ...]
    """Scenes to make, ascending."""

    def expected(self, scene: int) -> int:
        """Return the number of episodes that a scene should have."""
        return self.config.episodes_of(split_of_scene(scene))

    def ordered(self, slots: int) -> list[int]:
        """Return the scenes to make; the last ones largest first, so that all workers end together.

        The dataset does not depend on the order.
        """
        cut = max(0, len(self.todo) - TAIL_SCENES * slots)
        seed = self.config.seed
        tail = sorted(self.todo[cut:], key=lambda scene: -room_count(seed, scene))
        return [*self.todo[:cut], *tail]


def _make(
    executor: Executor,
    recipe: Recipe,
    queue: _SceneQueue,
    commits: PrefixCommits,
    progress: GenerationProgress,
    stop: Interrupts,
) -> None:
    """Have the scenes made; those that cannot be are stored as quarantined."""
    staging: Staging = recipe.payload.staging
    total = len(queue.numbers)
    before = total - len(queue.todo)
    progress.begin(total, before, sum(queue.expected(scene) for scene in queue.todo))

    def tick() -> bool:
        progress.tick()
        return not stop()

    results = executor.run(recipe, queue.ordered(executor.slots), tick)
    with contextlib.closing(results):  # after an error workers end at once, with the iterator
        for result in results:
            scene = result.task
            episodes = result.value if isinstance(result, Done) else 0
            if isinstance(result, Failed):
                progress.log(f"scene-{scene:06d} is quarantined: {result.reason}")
                _stage_failure(staging, result)
            progress.scene(episodes, expected=queue.expected(scene))
            none_made = not before and progress.quarantined == progress.scenes
            if isinstance(result, Failed) and none_made and progress.scenes >= MAX_FIRST_FAILURES:
                raise _hopeless(staging.store, progress.scenes, result.reason)
            commits.add(scene)
    progress.end()


def _repair(
    executor: Executor, recipe: Recipe, progress: GenerationProgress, stop: Interrupts
) -> None:
    """Make missing and damaged files of the dataset again, from their scenes made again."""
    staging: Staging = recipe.payload.staging
    damage = find_damage(staging.store)
    if damage is None:
        return
    wanted = damage.all_scenes()
    staged = staged_scenes(staging, wanted)
    todo = [k for k in wanted if k not in staged]
    progress.log(
        f"missing or damaged: {', '.join(damage.paths)}; making {len(todo)} scenes again for them"
    )
    results = executor.run(recipe, todo, lambda: not stop())
    with contextlib.closing(results):
        for result in results:
            if isinstance(result, Failed):
                raise CorruptDataError(
                    f"{staging.store.at('')}: {', '.join(damage.paths)}: missing or damaged, and "
                    f"scene {result.task} could not be made again ({result.reason}): restore the "
                    "files from where the dataset came, or generate it anew in another folder"
                )
    if stop():
        raise InterruptedRunError(
            f"interrupted while damaged files of {staging.store.at('')} were made again: run the "
            "same command again to continue",
            stop.signum,
        )
    repair_files(staging, damage, _all_of(recipe.payload.assets))


def _stage_failure(staging: Staging, failed: Failed) -> None:
    stage_quarantine(
        staging,
        failed.task,
        failed.reason,
        split=split_of_scene(failed.task),
        attempts=failed.attempts,
        died=failed.died,
    )


def _assembled(
    staging: Staging,
    identity: Identity,
    assets: Catalogue,
    numbers: range,
    progress: GenerationProgress,
    part: DatasetPart | None,
) -> Manifest:
    store, end = staging.store, numbers.stop
    staged = staged_scenes(staging)
    if has_manifest(store) and min(staged, default=end) >= end:
        if read_manifest(store).part != part:  # a longer one was asked for before
            commit_scenes(staging, identity, _all_of(assets), end, part)
        if not staged:
            end_staging(store)
        return read_manifest(store)
    if not staged:
        staging.check()  # so removed with its folder, or alone
        raise CorruptDataError(
            f"{store.at(STAGING)}: its scenes were removed while this run was at work: run the "
            "command again, in a folder that stays"
        )
    none_is_good = all(state.quarantined for state in staged.values())
    if part is None and not has_manifest(store) and none_is_good:
        raise _hopeless(store, len(staged), next(iter(staged.values())).quarantined)
    progress.log(f"writing {len(numbers)} scenes into {store.at('')}")
    if max(staged) >= end:  # they stay for a run that asks for them
        return commit_scenes(staging, identity, _all_of(assets), end, part)
    return assemble(store, identity, _all_of(assets), end, part)


def _forget_idle_staging(store: Store) -> None:
    """Remove the staging of a run that ended before its first scene did.

    It would bind the folder to that run's config, which the user may just be mending.
    """
    if not has_manifest(store) and not any_staged(store):
        clear_staging(store)


def _hopeless(store: Store, count: int, reason: str) -> QuarantineError:
    """Return the error for a config by which no scene can be made; remove what it staged."""
    if not has_manifest(store):
        clear_staging(store)
    return QuarantineError(f"none of {count} scenes could be made: {reason}; nothing was written")


def _interruption(out: str, progress: GenerationProgress) -> str:
    done = progress.scenes_before + progress.scenes
    readable = (
        f"the first {progress.readable} can be read" if progress.readable else "they are kept"
    )
    return (
        f"interrupted after {done} of {progress.scenes_total} scenes; {readable} in {out}: "
        "run the same command again to continue"
    )
