"""A valid dataset is broken in one place at a time; the validator must name what broke."""

import json
import re
from dataclasses import replace

import builders
import pytest
from builders import crate, scene_object
from manifests import edit_manifest
from scenery import ASSETS, obstacle, small_scenes, write_dataset

from internav_data.records import Pose
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.verification import validate


@pytest.fixture(scope="module")
def scenes():
    return small_scenes()


@pytest.fixture
def dataset(tmp_path, scenes):
    write_dataset(tmp_path / "ds", scenes)
    return tmp_path / "ds"


def predicates(findings):
    return set(findings.by_predicate)


def test_valid_dataset_is_valid_at_every_level(dataset):
    for level in ("files", "schema", "geometry"):
        findings = validate(dataset, level)
        assert findings.ok, findings.summary()
        assert findings.level == level
    assert findings.checked["scenes"] == 3
    assert findings.checked["episodes"] == 6
    assert "valid" in findings.summary()
    assert json.loads(findings.to_json())["ok"] is True


def test_workers_and_progress_change_nothing(dataset, monkeypatch):
    told = []
    alone = validate(dataset, progress=lambda *step: told.append(step))
    assert told[-1] == ("geometry", 3, 3)
    monkeypatch.setattr("internav_data.verification.levels.SCENES_A_UNIT", 1)
    assert validate(dataset, workers=2) == alone


def test_sample_looks_at_so_many_scenes(dataset):
    assert validate(dataset, sample=1).checked["scenes"] == 1
    assert validate(dataset, sample=1) == validate(dataset, sample=1)
    assert validate(dataset, sample=99).checked["scenes"] == 3


def test_arguments_are_judged(dataset, tmp_path):
    with pytest.raises(UsageError, match="level"):
        validate(dataset, "chemistry")
    with pytest.raises(UsageError, match="sample"):
        validate(dataset, sample=0)
    with pytest.raises(UsageError, match="workers"):
        validate(dataset, workers=0)
    with pytest.raises(UsageError, match="no such folder"):
        validate(tmp_path / "nowhere")
    with pytest.raises(CorruptDataError, match=r"manifest\.json"):
        validate(tmp_path)


# files


def shard(dataset, table="episodes"):
    return min((dataset / "data" / table).glob("*.parquet"))


def test_one_byte_changed(dataset):
    path = shard(dataset)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    findings = validate(dataset)
    assert "files.sha256" in predicates(findings)
    assert all(f.file == path.relative_to(dataset).as_posix() for f in findings.found)
    assert re.search(r"episodes/.*sha256|files\.", str(findings.found[0]))


def test_every_byte_of_a_shard_is_watched(dataset):
    path = shard(dataset)
    good = path.read_bytes()
    for shard_ref in range(0, len(good), max(1, len(good) // 25)):
        data = bytearray(good)
        data[shard_ref] ^= 0x10
        path.write_bytes(data)
        assert "files.sha256" in predicates(validate(dataset, "files"))


def test_truncated_shard(dataset):
    path = shard(dataset)
    path.write_bytes(path.read_bytes()[:-100])
    assert {"files.bytes", "files.sha256"} <= predicates(validate(dataset))


def test_missing_shard(dataset):
    shard(dataset, "scenes").unlink()
    assert "files.present" in predicates(validate(dataset))


def test_unlisted_file(dataset):
    (dataset / "data" / "episodes" / "extra.parquet").write_bytes(b"PAR1")
    findings = validate(dataset)
    assert predicates(findings) == {"files.unlisted"}
    assert findings.found[0].file == "data/episodes/extra.parquet"


def test_links_are_followed(dataset, tmp_path):
    path = shard(dataset)
    path.rename(tmp_path / "elsewhere.parquet")
    path.symlink_to(tmp_path / "elsewhere.parquet")
    (dataset / "data").rename(tmp_path / "data")
    (dataset / "data").symlink_to(tmp_path / "data")
    (tmp_path / "data" / "scenes").rename(tmp_path / "scenes")
    (tmp_path / "data" / "scenes").symlink_to(tmp_path / "scenes")
    assert validate(dataset).ok
    (tmp_path / "scenes" / "extra.parquet").write_bytes(b"PAR1")
    (tmp_path / "data" / "round").symlink_to(tmp_path / "data")
    findings = validate(dataset)
    assert predicates(findings) == {"files.unlisted"}
    assert {f.file for f in findings.found} == {"data/round", "data/scenes/extra.parquet"}


@pytest.mark.parametrize(
    ("name", "predicate"),
    [
        ("rows", "files.rows"),
        ("bytes", "files.bytes"),
        ("sha256", "files.sha256"),
        ("logical_digest", "files.logical-digest"),
    ],
)
def test_manifest_says_another(dataset, name, predicate):
    def change(raw):
        old = raw["files"][0][name]
        raw["files"][0][name] = old + 1 if isinstance(old, int) else "0" * 64
        if name == "rows":
            raw["counts"][raw["files"][0]["split"]]["episodes"] += 1

    edit_manifest(dataset, change)
    assert predicate in predicates(validate(dataset))


@pytest.mark.parametrize(
    "change",
    [
        lambda raw: raw["counts"]["val"].update(episodes=99),
        lambda raw: raw["files"][0].update(table="dpisodes"),
        lambda raw: raw["files"].append(raw["files"][0]),
        lambda raw: raw["files"].pop(),
        lambda raw: raw.update(scenes=0),
    ],
)
def test_manifest_that_contradicts_itself(dataset, change):
    edit_manifest(dataset, change)
    assert predicates(validate(dataset)) == {"files.manifest"}


def test_manifest_of_which_a_bit_was_flipped(dataset):
    path = dataset / "manifest.json"
    text = path.read_bytes()
    for at in range(5, len(text), len(text) // 40):
        path.write_bytes(text[:at] + bytes([text[at] ^ 1]) + text[at + 1 :])
        assert predicates(validate(dataset)) == {"files.manifest"}


@pytest.mark.parametrize("text", ["", "[]", "{", '{"format_version": 1}', '{"format_version": 99}'])
def test_manifest_unreadable(dataset, text):
    (dataset / "manifest.json").write_text(text)
    assert predicates(validate(dataset)) == {"files.manifest"}


def test_path_out_of_the_dataset(dataset):
    edit_manifest(dataset, lambda raw: raw["files"][0].update(path="data/../../secret.parquet"))
    assert predicates(validate(dataset)) == {"files.manifest"}


# schema and geometry: the data are rewritten, with hashes that fit


def with_scene(scenes, scene, house, episodes):
    """Scenes with one of them changed; of a change to the first nothing else is written."""
    return [*scenes[:scene], (house, episodes), *([] if scene == 0 else scenes[scene + 1 :])]


def change_episode(scenes, scene, index, /, **changes):
    house, episodes = scenes[scene]
    episodes = list(episodes)
    episodes[index] = replace(episodes[index], **changes)
    return with_scene(scenes, scene, house, episodes)


def change_obstacle(scenes, scene, index, /, **changes):
    old = scenes[scene][1][index].obstacles
    return change_episode(scenes, scene, index, obstacles=(replace(old[0], **changes), *old[1:]))


def change_house(scenes, scene, **changes):
    house, episodes = scenes[scene]
    return with_scene(scenes, scene, replace(house, **changes), episodes)


def judged(tmp_path, scenes, assets=None):
    write_dataset(tmp_path / "broken", scenes, assets)
    return validate(tmp_path / "broken")


EPISODE_CHANGES = {
    "steps": ({"obstructed_path_steps": 29}, "episode.obstructed-path-steps"),
    "clear steps": ({"shortest_path_steps": 25}, "episode.shortest-path-steps"),
    "cut off": ({"obstructed_path_steps": None}, "episode.obstructed-path-steps"),
    "sealed": ({"sealed": True}, "episode.sealed-flag"),
    "sealed and no way": ({"sealed": True, "obstructed_path_m": None}, "episode.sealed"),
    "clear length": ({"shortest_path_m": 6.2}, "episode.shortest-path-m"),
    "clear length too short": ({"shortest_path_m": 5.9}, "episode.shortest-path-m-bounds"),
    "way length": ({"obstructed_path_m": 6.3}, "episode.obstructed-path-m"),
    "way length too short": ({"obstructed_path_m": 6.01}, "episode.obstructed-path-m"),
    "mode": ({"mode": "blocked"}, "episode.mode"),
    "rooms on the way": ({"rooms_on_path": 1}, "episode.rooms-on-path"),
    "room paths": ({"room_paths": ()}, "episode.room-paths"),
    "room paths cut": ({"room_paths_truncated": True}, "episode.room-paths-truncated"),
    "node paths": ({"node_paths": ()}, "episode.node-paths"),
    "node paths cut": ({"node_paths_truncated": True}, "episode.node-paths-truncated"),
    "room count": ({"room_count": 3}, "schema.episodes.room_count"),
    "obstacle count": ({"obstacle_count": 2}, "schema.episodes.obstacle_count"),
    "split": ({"split": "train"}, "schema.episodes.split"),
    "seed": ({"seed": 4}, "schema.episodes.seed"),
    "index": ({"index": 5}, "schema.episodes.episode_id"),
    "episode id": ({"episode_id": "scene-000000/0007"}, "schema.episodes.episode_id"),
    "scene id": ({"scene_id": "scene-000044"}, "schema.episodes.scene_id"),
    "unrounded": ({"obstructed_path_m": 6.13181234}, "schema.episodes.obstructed_path_m"),
    "no obstacles": ({"obstacles": (), "obstacle_count": 0}, "episode.obstacle-count"),
    "agreed": ({"agreed": True}, "schema.episodes.agreed"),
}


@pytest.mark.parametrize("case", EPISODE_CHANGES)
def test_episode_says_something_untrue(tmp_path, scenes, case):
    changes, predicate = EPISODE_CHANGES[case]
    findings = judged(tmp_path, change_episode(scenes, 0, 1, **changes))
    assert predicate in predicates(findings), findings.summary()
    assert {f.scene for f in findings.found if f.scene} <= {"scene-000000", "scene-000044"}


END_CHANGES = {
    "into a wall": ({"i": 4, "j": 0, "x": 1.0, "y": 0.0}, "episode.start-free"),
    "out of the house": ({"i": 90, "j": 90, "x": 22.5, "y": 22.5}, "episode.start-free"),
    "into a table": ({"i": 4, "j": 3, "x": 1.0, "y": 0.75}, "episode.start-free"),
    "off its node": ({"x": 1.25}, "episode.start-node"),
    "another room": ({"room": 1}, "episode.start-room"),
    "no such room": ({"room": 7}, "schema.episodes.room"),
    "another yaw": ({"yaw_deg": 45}, "episode.start-yaw"),
    "faces a wall": ({"faces_wall": True}, "episode.start-faces-wall"),
    "in a pocket": ({"reachable_nodes": 3}, "episode.start-reachable-nodes"),
    "under the obstacle": ({"i": 10, "j": 8, "x": 2.5, "y": 2.0}, "episode.start-uncovered"),
    "near the goal": (
        {"i": 27, "j": 8, "x": 6.75, "y": 2.0, "room": 1},
        "episode.shortest-path-min",
    ),
}


@pytest.mark.parametrize("case", END_CHANGES)
def test_start_moved(tmp_path, scenes, case):
    changes, predicate = END_CHANGES[case]
    start = replace(scenes[0][1][1].start, **changes)
    extra = {"shortest_path_m": 0.25} if case == "near the goal" else {}
    findings = judged(tmp_path, change_episode(scenes, 0, 1, start=start, **extra))
    assert predicate in predicates(findings), findings.summary()


OBSTACLE_CHANGES = {
    "aside": ({"y": 2.25}, "episode.obstructed-path-m"),
    "into the wall": ({"x": 3.7, "y": 1.5}, "obstacle.overlap-house"),
    "out of the house": ({"x": -3.0}, "obstacle.inside"),
    "into the air": ({"z": 0.05}, "obstacle.floor"),
    "unrounded": ({"x": 2.50004321}, "schema.episodes.obstacles.element.x"),
    "not a unit": (
        {"quaternion": (0.0, 0.0, 0.1, 1.0)},
        "schema.episodes.obstacles.element.quaternion",
    ),
    "w below 0": (
        {"quaternion": (0.0, 0.0, 0.0, -1.0)},
        "schema.episodes.obstacles.element.quaternion.w",
    ),
    "leaning": ({"quaternion": (0.052336, 0.0, 0.0, 0.99863)}, "obstacle.upright"),
    "another mass": ({"mass_kg": 9.0}, "obstacle.mass_kg"),
    "another friction": ({"friction": 0.5}, "obstacle.friction"),
    "another type": ({"type": "Bar"}, "obstacle.type"),
    "not pushable": ({"pushable": False}, "obstacle.pushable"),
    "affordance": ({"affordance": "push"}, "obstacle.affordance"),
    "pickable": ({"pickable": True}, "obstacle.pickable"),
    "unknown asset": ({"asset_id": "Ghost_1"}, "schema.episodes.asset"),
    "furniture": ({"asset_id": "Cupboard_1"}, "obstacle.spawnable"),
    "node_path_segment": ({"node_path_segment": 2}, "obstacle.node_path_segment"),
    "settled too long": ({"settle_s": 1.5}, "schema.episodes.obstacles.element.settle_s"),
    "sank in": ({"settle_penetration_m": 0.003}, "obstacle.penetration"),
    "longest settle": ({"settle_s": 0.2}, "physics.settle"),
    "deepest contact": ({"settle_penetration_m": 0.001}, "physics.penetration"),
}


@pytest.mark.parametrize("case", OBSTACLE_CHANGES)
def test_obstacle_changed(tmp_path, scenes, case):
    changes, predicate = OBSTACLE_CHANGES[case]
    findings = judged(tmp_path, change_obstacle(scenes, 0, 1, **changes))
    assert predicate in predicates(findings), findings.summary()


def test_obstacle_moved_10_cm_out_of_the_gap(tmp_path, scenes):
    findings = judged(tmp_path, change_obstacle(scenes, 2, 0, y=1.72))
    assert predicates(findings) == {"episode.obstructed-path-m"}


def test_gap_shut_by_2_cm(tmp_path, scenes):
    findings = judged(tmp_path, change_obstacle(scenes, 2, 0, y=1.85))
    assert "episode.sealed" in predicates(findings), findings.summary()


def test_obstacles_in_each_other(tmp_path, scenes):
    one = scenes[0][1][1].obstacles[0]
    changes = {"obstacles": (one, replace(one, asset_id="Box_2", type="Box")), "obstacle_count": 2}
    assert "obstacle.overlap" in predicates(
        judged(tmp_path, change_episode(scenes, 0, 1, **changes))
    )


def with_screen(scenes, x, y, z=0.0, *others):
    """An episode whose obstacles are a screen on a flat foot and others."""
    made = builders.obstacle(builders.screen(), x, y, penetration_m=0.0001)
    obstacles = (*others, replace(made, z=z))
    return change_episode(scenes, 0, 1, obstacles=obstacles, obstacle_count=len(obstacles))


FEET = {
    "in a wall": ((2.5, 0.17), "obstacle.overlap-house-3d"),
    "in a cupboard": ((5.5, 3.15), "obstacle.overlap-house-3d"),
    "clear of all": ((2.5, 1.0), None),
    "beside a wall": ((2.5, 0.2), None),
}


@pytest.mark.parametrize("case", FEET)
def test_foot_that_no_footprint_holds(tmp_path, scenes, case):
    (x, y), predicate = FEET[case]
    assets = builders.by_id(*ASSETS.values(), builders.screen())
    findings = judged(tmp_path, with_screen(scenes, x, y), assets)
    seen = predicates(findings) & {
        *("obstacle.overlap-house", "obstacle.overlap-house-3d"),
        *("obstacle.overlap", "obstacle.overlap-3d"),
    }
    assert seen == ({predicate} if predicate else set()), findings.summary()


@pytest.mark.parametrize(("y", "inside"), [(1.51, True), (1.49, False)])
def test_foot_in_another_obstacle(tmp_path, scenes, y, inside):
    """Box_1 at (2.5, 2.0) begins at y = 1.7; the foot reaches 0.2 m from the screen's middle."""
    assets = builders.by_id(*ASSETS.values(), builders.screen())
    changed = with_screen(scenes, 2.5, y, 0.0, scenes[0][1][1].obstacles[0])
    seen = predicates(judged(tmp_path, changed, assets))
    assert ("obstacle.overlap-3d" in seen) == inside
    assert not seen & {"obstacle.overlap", "obstacle.overlap-house-3d"}


def test_episode_dropped(tmp_path, scenes):
    house, episodes = scenes[2]
    findings = judged(tmp_path, [*scenes[:2], (house, episodes[:1])])
    assert predicates(findings) == {"schema.episodes.per-scene"}


def test_rows_in_another_order(tmp_path, scenes):
    house, episodes = scenes[2]
    findings = judged(tmp_path, [*scenes[:2], (house, episodes[::-1])])
    assert "schema.episodes.order" in predicates(findings)


def test_asset_of_another_mass(tmp_path, scenes):
    assets = {**ASSETS, "Bar_1": replace(ASSETS["Bar_1"], mass_kg=1.0)}
    findings = judged(tmp_path, scenes, assets)
    assert predicates(findings) == {"obstacle.mass_kg"}


def test_asset_of_another_shape(tmp_path, scenes):
    assets = {**ASSETS, "Box_2": crate("Box_2", (0.3, 0.3, 0.6), mass_kg=8.0)}
    assert "episode.obstructed-path-m" in predicates(judged(tmp_path, scenes, assets))


def test_scene_missing(tmp_path, scenes):
    numbered = [replace(house, scene=2 * house.scene) for house, _ in scenes]
    others = [
        (replace(house, scene_id=f"scene-{house.scene:06d}"), episodes)
        for house, (_, episodes) in zip(numbered, scenes, strict=True)
    ]
    assert "schema.scenes.all" in predicates(judged(tmp_path, others))


# houses


def moved(thing, **changes):
    return replace(thing, **changes)


def house_cases(house):
    doors, rooms, things = house.doors, house.rooms, house.objects
    door, first, last = doors[0], rooms[0], rooms[-1]
    shifted = tuple((x + 0.5, y) for x, y in first.polygon)
    return {
        "door moved": ({"doors": (replace(door, y=door.y + 0.3),)}, "house.walls-gap"),
        "door closed": ({"doors": (replace(door, open=False),)}, "house.room-graph"),
        "door to itself": ({"doors": (replace(door, rooms=(0, 0)),)}, "schema.scenes.door-rooms"),
        "door of another room": (
            {"doors": (replace(door, rooms=(-1, 0)),)},
            "house.door-rooms",
        ),
        "open entrance": ({"doors": (replace(door, rooms=(-1, 1)),)}, "house.entrance"),
        "door of no room": ({"doors": (replace(door, rooms=(0, 9)),)}, "schema.scenes.door-rooms"),
        "narrower door": ({"doors": (replace(door, width_m=0.8),)}, "house.walls-gap"),
        "wider door": ({"doors": (replace(door, width_m=1.2),)}, "house.walls-closed"),
        "higher door": ({"doors": (replace(door, height_m=2.3),)}, "house.walls-closed"),
        "no wall": ({"walls": house.walls[1:]}, "house.walls-gap"),
        "stray wall": (
            {"walls": (*house.walls, replace(house.walls[0], x_min=2.0, x_max=2.1))},
            "house.walls-stray",
        ),
        "graph": ({"room_graph": ()}, "house.room-graph"),
        "house area": ({"area_m2": house.area_m2 + 1.0}, "house.area"),
        "room area": ({"rooms": (replace(first, area_m2=9.0), last)}, "house.room-area"),
        "room shifted": ({"rooms": (replace(first, polygon=shifted), last)}, "house.rooms-overlap"),
        "room crossed": (
            {"rooms": (replace(first, polygon=(*first.polygon[:1], *first.polygon[:0:-1])), last)},
            "house.room-polygon",
        ),
        "room numbers": ({"rooms": (replace(first, room_id=3), last)}, "schema.scenes.room-ids"),
        "room slanted": (
            {"rooms": (replace(first, polygon=((0.0, 0.1), *first.polygon[1:])), last)},
            "house.room-polygon",
        ),
        "outline": (
            {"outline": ((0.0, 0.0), (8.0, 0.0), (8.0, 4.0), (0.0, 4.0))},
            "house.rooms-tile",
        ),
        "thing in a wall": ({"objects": (moved(things[0], y=0.3), *things[1:])}, "object.overlap"),
        "thing in a thing": (
            {"objects": (*things[:2], moved(things[2], x=6.0, y=3.3))},
            "object.overlap",
        ),
        "thing in another room": (
            {"objects": (moved(things[0], room=1), *things[1:])},
            "object.room",
        ),
        "thing before the door": (
            {"objects": (*things[:2], moved(things[2], x=4.4, y=2.0))},
            "house.door-clear",
        ),
        "thing in the air": (
            {"objects": (*things[:2], moved(things[2], support=0))},
            "object.support",
        ),
        "thing hanging free": (
            {"objects": (*things[:2], moved(things[2], x=6.0, y=1.5, z=1.2))},
            "object.support",
        ),
        "thing below the floor": (
            {"objects": (*things[:2], moved(things[2], z=-0.1))},
            "object.support",
        ),
        "thing of another type": (
            {"objects": (*things[:2], moved(things[2], type="Table"))},
            "object.type",
        ),
        "unknown thing": (
            {"objects": (*things[:2], moved(things[2], asset_id="Ghost_1"))},
            "schema.scenes.object-asset",
        ),
        "thing twice": (
            {"objects": (*things[:2], moved(things[2], object_id=1))},
            "schema.scenes.object-ids",
        ),
        "scene split": ({"split": "train"}, "schema.scenes.split"),
        "scene seed": ({"seed": 3}, "schema.scenes.seed"),
        "material": ({"materials": ()}, "schema.scenes.materials"),
    }


CASES = house_cases(small_scenes()[0][0])


@pytest.mark.parametrize("case", CASES)
def test_house_says_something_untrue(tmp_path, scenes, case):
    changes, predicate = CASES[case]
    findings = judged(tmp_path, change_house(scenes, 0, **changes))
    assert predicate in predicates(findings), findings.summary()


def test_room_cut_off_by_furniture(tmp_path, scenes):
    house = scenes[0][0]
    barrier = [
        scene_object(3 + k, "Bar_1", 1, 4.9, 0.61 + 1.21 * k, yaw_deg=90.0) for k in range(3)
    ]
    barrier.append(scene_object(6, "Box_2", 1, 4.9, 3.83))
    findings = judged(tmp_path, change_house(scenes, 0, objects=(*house.objects[:1], *barrier)))
    assert "house.reachable" in predicates(findings), findings.summary()


@pytest.mark.parametrize(
    ("asset_id", "y", "holds"),
    [("Box_2", 0.5, True), ("Box_2", 0.93, False), ("Pole_1", 0.5, False), ("Rug_0", 0.9, True)],
)
def test_things_of_a_group_stand_under_each_other_not_in_each_other(
    tmp_path, scenes, asset_id, y, holds
):
    """Under a table, in its legs, through its top; and the table on a rug, which is floor."""
    pole = builders.crate("Pole_1", (0.1, 0.1, 1.2))
    rug = builders.crate("Rug_0", (1.6, 1.4, 0.004), blocks=False, spawnable=False)
    house, assets = scenes[0][0], builders.by_id(*ASSETS.values(), pole, rug)
    other = scene_object(3, asset_id, 0, 1.0 if holds else 1.5, y, group=1)
    together = (replace(house.objects[0], group=1), *house.objects[1:], other)
    findings = judged(tmp_path, change_house(scenes, 0, objects=together), assets)
    assert ("object.overlap" not in predicates(findings)) == holds, findings.summary()


def test_things_may_hang_on_walls(tmp_path, scenes):
    house = scenes[0][0]
    picture = scene_object(3, "Box_2", 0, 0.16, 2.5)
    hung = (*house.objects, replace(picture, z=1.9))
    assert judged(tmp_path, change_house(scenes, 0, objects=hung)).ok


def test_pose_of_a_record_is_what_is_judged():
    assert obstacle("Bar_1", 1.0, 2.0).pose == Pose(1.0, 2.0, 0.0, (0.0, 0.0, 0.0, 1.0))
