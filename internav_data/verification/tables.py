"""Level `schema`: columns, ranges, order, ids and the links between the tables."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.core.storage import StoreError
from internav_data.dataset import ASSETS, EPISODES, SCENES, from_table
from internav_data.dataset.parquet import open_stored
from internav_data.dataset.tables import SPECS
from internav_data.records import OUTSIDE
from internav_data.records.errors import InternavError
from internav_data.verification.agreement import check_agreement
from internav_data.verification.attributes import AttributeCheck
from internav_data.verification.checked_config import checked_config
from internav_data.verification.episode_config import check_episode_config, episode_request
from internav_data.verification.findings import FindingCollector
from internav_data.verification.house_config import check_house_config, house_request
from internav_data.verification.interactions import check_interactions
from internav_data.verification.ranges import check_ranges
from internav_data.verification.surfaces import SINCE, check_flat

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import pyarrow as pa

    from internav_data.core.storage import Store
    from internav_data.dataset import DataFile, Manifest
    from internav_data.records import House
    from internav_data.verification.house_config import RoomPlan

_MAX_DIGITS = 12
"""Digits of a scene's number."""
SPLIT_PERIOD = 120
"""Period of the splits: of every 120 scenes number 0 is val, 1 is test, the others are train."""


@dataclass(frozen=True, slots=True)
class SceneKeys:
    """Ids of a scene to which its episodes may refer."""

    split: str
    room_ids: frozenset[int]
    door_ids: frozenset[int]


@dataclass(slots=True)
class DatasetKeys:
    """Ids to which tables may refer, gathered table by table."""

    assets: frozenset[str] = frozenset()
    scenes: dict[str, SceneKeys] = field(default_factory=dict)
    episodes: Counter[str] = field(default_factory=Counter)
    first_rooms: RoomPlan | None = None
    """Rooms of the first house."""
    attributes: AttributeCheck | None = None
    """Check of the objects' attributes; None without assets to compare them with."""


def split_of(scene: int) -> str:
    """Return the split of a scene's number."""
    return {0: "val", 1: "test"}.get(scene % SPLIT_PERIOD, "train")


def number_of(scene_id: str) -> int:
    """Return a scene's number, -1 if the id has none."""
    digits = scene_id.rpartition("-")[2]
    return int(digits) if digits.isdecimal() and len(digits) <= _MAX_DIGITS else -1


def check_tables(
    store: Store, manifest: Manifest, damaged: frozenset[str]
) -> tuple[FindingCollector, frozenset[str]]:
    """Check all tables of a dataset but for damaged files.

    Also return the paths of files with values out of their range, of which no geometry can be
    derived in bounded time and memory.
    """
    whole = FindingCollector()
    unsafe: set[str] = set()
    keys = DatasetKeys()
    for name in ("assets", "scenes", "episodes"):
        for file in manifest.of(name):
            if file.path not in damaged:
                whole.absorb(_check_table(store, manifest, file, keys, unsafe))
    if keys.attributes is not None:
        keys.attributes.shares(whole)
    if not damaged:
        _check_counts(manifest, keys, whole)
    return whole, frozenset(unsafe)


def _check_table(
    store: Store, manifest: Manifest, file: DataFile, keys: DatasetKeys, unsafe: set[str]
) -> FindingCollector:
    report = FindingCollector(file.path)
    unsafe.add(file.path)  # until its values are known
    spec = SPECS[file.table]
    try:
        with open_stored(store, file.path, spec) as opened:
            table = opened.read_all()
    except StoreError:
        raise  # of a bucket that cannot be reached nothing is known
    except InternavError as error:
        report.expect(False, "schema.columns", f"the columns of {file.table}", error)  # noqa: FBT003
        return report
    report.expect(table.schema.equals(spec.schema), "schema.columns", spec.schema, table.schema)
    with report.guard("schema.checkable"), np.errstate(all="ignore"):
        if check_ranges(table, file.table, report):
            unsafe.discard(file.path)
    with report.guard("schema.checkable"):
        if file.table == "assets":
            _check_assets(table, manifest, keys, report)
        elif file.table == "scenes":
            _check_scenes(table, manifest, file, keys, report)
        else:
            _check_episodes(table, manifest, file, keys, report)
    return report


def _check_assets(
    table: pa.Table, manifest: Manifest, keys: DatasetKeys, report: FindingCollector
) -> None:
    ids = table.column("asset_id").to_pylist()
    report.expect(ids == sorted(ids), "schema.assets.order", "rows by asset_id", "another order")
    report.expect(len(set(ids)) == len(ids), "schema.assets.unique", "each asset once", "one twice")
    keys.assets = frozenset(ids)
    assets = from_table(table, ASSETS)
    keys.attributes = AttributeCheck.of(manifest.config, assets)
    for asset in assets:
        report.expect(asset.parts, "schema.assets.parts", f"{asset.asset_id}: parts", "none")
        report.expect(
            all((part.shape == "hull") == bool(part.corners) for part in asset.parts),
            "schema.assets.corners",
            f"{asset.asset_id}: corners of hulls and of no other part",
            [(part.shape, len(part.corners)) for part in asset.parts],
        )
        if manifest.catalogue_version >= SINCE and asset.parts:
            check_flat(asset, report)


def _check_scenes(
    table: pa.Table, manifest: Manifest, file: DataFile, keys: DatasetKeys, report: FindingCollector
) -> None:
    houses = from_table(table, SCENES, {"assets": {}})
    request = house_request(manifest.seed, manifest.config)
    numbers = [house.scene for house in houses]
    report.expect(
        numbers == sorted(numbers), "schema.scenes.order", "rows by scene", "another order"
    )
    for house in houses:
        report.scene = house.scene_id
        wanted = f"scene-{house.scene:06d}"
        report.expect(house.scene_id == wanted, "schema.scenes.scene_id", wanted, house.scene_id)
        report.expect(
            house.scene_id not in keys.scenes, "schema.scenes.unique", "each scene once", "twice"
        )
        split = split_of(house.scene)
        report.expect(
            split == house.split == file.split,
            "schema.scenes.split",
            split,
            f"{house.split} in a file of {file.split}",
        )
        report.expect(house.seed == manifest.seed, "schema.scenes.seed", manifest.seed, house.seed)
        if request is not None:
            rooms = check_house_config(house, request, keys.first_rooms, report)
            keys.first_rooms = keys.first_rooms or rooms
        _check_links(house, keys, report)
        if keys.attributes is not None:
            keys.attributes.house(house, report)
        keys.scenes[house.scene_id] = SceneKeys(
            house.split,
            frozenset(room.room_id for room in house.rooms),
            frozenset(door.door_id for door in house.doors),
        )
    report.scene = ""


def _check_links(house: House, keys: DatasetKeys, report: FindingCollector) -> None:
    """Check that a house's ids are unique and refer to known ones."""

    def expect(name: str, wrong: Sequence[Any], expected: str) -> None:
        report.expect(not wrong, f"schema.scenes.{name}", expected, wrong)

    rooms = [room.room_id for room in house.rooms]
    report.expect(
        rooms == list(range(len(rooms))) and bool(rooms),
        "schema.scenes.room-ids",
        "rooms numbered from 0",
        rooms,
    )
    for name, ids in (
        ("door-ids", [d.door_id for d in house.doors]),
        ("window-ids", [w.window_id for w in house.windows]),
        ("object-ids", [t.object_id for t in house.objects]),
    ):
        expect(name, sorted(i for i, n in Counter(ids).items() if n > 1), "each id once")
    known = {*rooms, OUTSIDE}
    expect("door-rooms", [d.door_id for d in house.doors if not set(d.rooms) <= known], "rooms")
    expect(
        "door-rooms",
        [d.door_id for d in house.doors if d.rooms[0] >= d.rooms[1]],
        "two room ids, ascending",
    )
    expect("window-room", [w.window_id for w in house.windows if w.room not in rooms], "a room")
    expect("object-room", [t.object_id for t in house.objects if t.room not in rooms], "a room")
    things = {t.object_id for t in house.objects}
    expect(
        "object-support",
        [t.object_id for t in house.objects if t.support != -1 and t.support not in things],
        "an object or -1",
    )
    expect(
        "object-asset",
        sorted({t.asset_id for t in house.objects} - keys.assets),
        "assets of the assets table",
    )
    names = {material.name for material in house.materials}
    used = {n for room in house.rooms for n in (room.floor_material, room.wall_material)}
    expect("materials", sorted(used - names), "materials of the house")
    expect("room-graph", [p for p in house.room_graph if not set(p) <= set(rooms)], "rooms")


def _check_episodes(
    table: pa.Table, manifest: Manifest, file: DataFile, keys: DatasetKeys, report: FindingCollector
) -> None:
    columns = ("scene_id", "index", "episode_id", "split", "seed", "room_count", "obstacle_count")
    rows = list(zip(*(table.column(name).to_pylist() for name in columns), strict=True))
    order = [(number_of(row[0]), row[1]) for row in rows]
    report.expect(
        order == sorted(order), "schema.episodes.order", "rows by scene and index", "another order"
    )
    counts = _lengths(table, "obstacles")
    for row, obstacles in zip(rows, counts, strict=True):
        scene_id, index, episode_id, split, seed, room_count, obstacle_count = row
        report.scene = scene_id
        scene = keys.scenes.get(scene_id)
        where = episode_id

        def expect(name: str, expected: object, got: object, where: str = where) -> None:
            report.expect(expected == got, f"schema.episodes.{name}", expected, got, where)

        expect("episode_id", f"{scene_id}/{index:04d}", episode_id)
        expect("index", keys.episodes[scene_id], index)
        expect("split", split_of(number_of(scene_id)), split)
        expect("split", file.split, split)
        expect("seed", manifest.seed, seed)
        expect("obstacle_count", obstacles, obstacle_count)
        keys.episodes[scene_id] += 1
        if report.expect(
            scene, "schema.episodes.scene_id", "a scene of the scenes table", scene_id, where
        ):
            expect("room_count", len(scene.room_ids) if scene else 0, room_count)
    report.scene = ""
    _check_references(table, keys, report, manifest.config)


def _lengths(table: pa.Table, name: str) -> list[int]:
    return [n for chunk in table.column(name).chunks for n in chunk.value_lengths().to_pylist()]


def _check_references(
    table: pa.Table, keys: DatasetKeys, report: FindingCollector, config: Mapping[str, Any]
) -> None:
    """Check the ids that episodes name, their interactions, and what the config refuses."""
    solvable, request = checked_config(config).solvable, episode_request(config)
    for episode in from_table(table, EPISODES):
        scene = keys.scenes.get(episode.scene_id)
        if scene is None:
            continue
        report.scene = episode.scene_id
        check_interactions(episode, report, solvable=solvable)
        check_agreement(episode, report)
        if keys.attributes is not None:
            for number, obstacle in enumerate(episode.obstacles):
                keys.attributes.obstacle(obstacle, number, report, episode.episode_id)
        check_episode_config(episode, request, report)
        rooms = {episode.start.room, episode.goal.room}
        rooms.update(room for path in episode.room_paths for room in path)
        doors = {door for path in episode.node_paths for door in path.doors}
        assets = {obstacle.asset_id for obstacle in episode.obstacles}
        for name, unknown in (
            ("room", rooms - scene.room_ids),
            ("door", doors - scene.door_ids),
            ("asset", assets - keys.assets),
        ):
            report.expect(
                not unknown,
                f"schema.episodes.{name}",
                f"known {name} ids",
                sorted(unknown, key=str),
                episode.episode_id,
            )
    report.scene = ""


def _check_counts(manifest: Manifest, keys: DatasetKeys, report: FindingCollector) -> None:
    """Check that every requested scene is present with the number of episodes of the config."""
    given_up = {q.scene_id for q in manifest.quarantined}
    first = manifest.part.first_scene if manifest.part else 0
    wanted = {f"scene-{first + k:06d}" for k in range(manifest.scenes)} - given_up
    missing, surplus = sorted(wanted - set(keys.scenes)), sorted(set(keys.scenes) - wanted)
    report.expect(
        not missing, "schema.scenes.all", f"{len(wanted)} scenes", f"without {missing[:3]}"
    )
    report.expect(not surplus, "schema.scenes.all", f"{len(wanted)} scenes", f"also {surplus[:3]}")
    each = _episodes_by_split(manifest.config)
    for scene_id, scene in keys.scenes.items():
        want = each.get(scene.split)
        got = keys.episodes[scene_id]
        if want is not None and got != want:
            report.scene = scene_id
            report.expect(False, "schema.episodes.per-scene", want, got)  # noqa: FBT003
    report.scene = ""
    report.counts["predicates"] += len(keys.scenes)


def _episodes_by_split(config: Mapping[str, Any]) -> dict[str, int]:
    """Read the number of episodes a scene from the resolved config, by split; {} if missing."""
    usual, test = config.get("episodes_per_scene"), config.get("test_episodes_per_scene")
    if not isinstance(usual, int) or not isinstance(test, int):
        return {}
    return {"train": usual, "val": usual, "test": test}
