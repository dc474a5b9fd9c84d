import json
import re
import shutil
import sys
from dataclasses import replace

import cv2
import numpy as np
import pytest

from internav_data.dataset import load_dataset
from internav_data.dataset.location import MINI
from internav_data.geometry import part_corners, transform
from internav_data.physics.engines import ENGINES
from internav_data.records import Outcome
from internav_data.records.errors import CorruptDataError
from internav_data.viewer import ViewedDataset, respond
from internav_data.viewer.episode_facts import outcome_text

FULL = "/api/episode/scene-000001/1"  # two obstacles: number 13 of the hand-written ones


def got(viewed, url):
    response = respond(viewed, url)
    assert response.status == 200, response.body[:300]
    return json.loads(response.body) if "json" in response.kind else response.body


def error(viewed, url, status):
    response = respond(viewed, url)
    assert response.status == status, response.body[:300]
    text = json.loads(response.body)["error"]
    assert "\n" not in text
    return text


def image(data):
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)


def test_an_episodes_facts_are_its_records(viewed, folder):
    facts = got(viewed, FULL)
    episode = next(e for e in load_dataset(folder) if e.episode_id == "scene-000001/0001")
    assert facts["episode_id"] == episode.episode_id
    assert [o["type"] for o in facts["obstacles"]] == [o.type for o in episode.obstacles]
    assert facts["distances"]["shortest_path_m"] == episode.shortest_path_m
    assert facts["expert"]["steps"] == episode.expert.steps
    east = facts["obstacles"][0]["outcomes"][0]
    assert east["at"] == [6.2, 2.0]
    assert [each["name"] for each in east["moved"]] == ["Apple 2", "Chair"]
    assert "slides 1.20 m, takes 2 other objects along; the path is open: 24 steps" in east["text"]


def test_an_outcomes_polygons_are_the_parts_at_the_stored_pose(viewed, folder):
    facts = got(viewed, FULL)
    dataset = load_dataset(folder)
    episode = next(e for e in dataset if e.episode_id == "scene-000001/0001")
    stored = episode.obstacles[0].outcomes[0]
    asset = dataset.assets[episode.obstacles[0].asset_id]
    expected = np.vstack(
        [transform(part_corners(part), stored.pose)[:, :2] for part in asset.parts]
    )
    drawn = np.vstack(
        [np.reshape(p["points"], (-1, 2)) for p in facts["obstacles"][0]["outcomes"][0]["parts"]]
    )
    assert np.allclose(drawn.min(axis=0), expected.min(axis=0), atol=1e-3)
    assert np.allclose(drawn.max(axis=0), expected.max(axis=0), atol=1e-3)


def test_what_is_hidden_decides_no_kind_that_is_shown(viewed):
    chair, apple = got(viewed, FULL)["obstacles"]
    assert (chair["kind"], chair["privileged"]["kind"]) == ("push", "fixed")
    assert chair["privileged"]["mass_kg"] == 71.5
    assert apple["kind"] == "pick"
    assert {"mass_kg", "friction", "pushable", "pickable"} <= chair["privileged"].keys()
    assert not {"mass_kg", "friction", "pushable", "pickable"} & chair.keys()


def test_pictures_are_pictures(viewed):
    assert max(image(got(viewed, f"{FULL}/thumbnail")).shape) == 480
    floor = image(got(viewed, f"{FULL}/floor"))
    x0, y0, x1, y1 = got(viewed, FULL)["box"]
    assert floor.shape[1] / floor.shape[0] == pytest.approx((x1 - x0) / (y1 - y0), rel=0.01)
    assert image(got(viewed, f"{FULL}/play/0")).shape == (384, 384, 3)


def test_the_expert_is_played_and_what_it_pushes_moves(viewed):
    play = got(viewed, f"{FULL}/play")
    moments = play["moments"]
    assert len(moments) == 12
    assert moments[0]["moved"] == {}
    assert moments[0]["yaw_deg"] == 90
    assert moments[9]["next"] == "push ahead"
    assert play["objects"][str(moments[9]["target"])] == {"name": "Chair 1", "obstacle": 1}
    assert str(moments[9]["target"]) not in moments[9]["moved"]
    # The chair's stored mass makes it fixed: the push fails, and the page says so.
    assert not moments[10]["success"]
    assert "push ahead Chair 1 failed" in moments[10]["text"]
    at, cone = moments[9], np.reshape(moments[9]["cone"], (-1, 2))
    assert cone[0].tolist() == [at["x"], at["y"]]
    assert np.all(np.hypot(*(cone[1:] - cone[0]).T) <= 1.25 + 0.01)


def test_a_video_begins_and_ends_at_the_stored_poses(viewed):
    facts, url = got(viewed, FULL), f"{FULL}/obstacle/1/push_east"
    video = got(viewed, url)
    assert [each["name"] for each in video["objects"]] == ["Chair 1", "Apple 2", "Chair"]
    assert [each["obstacle"] for each in video["objects"]] == [1, 2, None]
    outcome = facts["obstacles"][0]["outcomes"][0]
    assert video["frames"][0][0] == facts["obstacles"][0]["parts"]
    assert video["frames"][-1][0] == outcome["parts"]
    assert video["frames"][-1][1] == outcome["moved"][0]["parts"]
    first, last = (image(got(viewed, f"{url}/{k}")) for k in (0, len(video["frames"]) - 1))
    assert first.shape == (320, 320, 3)
    assert np.abs(first.astype(int) - last).max() > 60
    picked = got(viewed, f"{FULL}/obstacle/2/pick")["frames"]
    assert picked[-2][0] is not None
    assert picked[-1][0] is None


def test_outcomes_need_no_physics(folder, monkeypatch):
    """The page of an episode is there without an engine; its expert says what is missing."""
    from internav_data.physics import registry

    def absent(*_):
        raise ModuleNotFoundError(name="pybullet")

    monkeypatch.setitem(sys.modules, "pybullet", None)
    monkeypatch.setattr(registry, "get_solver", absent)
    viewed = ViewedDataset(folder)
    assert got(viewed, FULL)["obstacles"][0]["outcomes"][0]["parts"]
    assert got(viewed, f"{FULL}/obstacle/1/push_east")["frames"]
    got(viewed, f"{FULL}/obstacle/1/push_east/3")


def test_an_expert_whose_engine_is_missing_is_a_line(monkeypatch):
    def absent():
        raise ModuleNotFoundError(name="mujoco")

    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setitem(ENGINES, "mujoco", absent)  # other tests may have connected it
    viewed = ViewedDataset(MINI)
    # First pushes come from stored outcomes: some expert pushes again.
    several = (e.episode_id for e in viewed.dataset if e.expert and e.expert.pushes > 1)
    urls = (f"/api/episode/{scene}/{int(k)}/play" for scene, k in (e.split("/") for e in several))
    refused = next(url for url in urls if respond(viewed, url).status != 200)
    assert re.search("mujoco.*: pip install", error(viewed, refused, 501))


def test_the_house_in_3d_holds_all_of_it(viewed, folder):
    import base64
    import io

    import trimesh

    page = got(viewed, FULL.replace("/api", "/view3d")).decode()
    assert "http:" not in page.replace("http://www.w3.org", "").partition("<body>")[0]
    glb = base64.b64decode(page.split('base64_data="')[1].split('"')[0])
    scene = trimesh.load(io.BytesIO(glb), file_type="glb")
    low, high = scene.bounds
    house = load_dataset(folder).scene("scene-000001")
    assert high[1] == pytest.approx(house.rooms[0].ceiling_m, abs=0.01)
    assert (low[0], high[0]) == (pytest.approx(0.06, abs=0.1), pytest.approx(8.94, abs=0.1))
    assert (low[2], high[2]) == (pytest.approx(-3.94, abs=0.1), pytest.approx(-0.06, abs=0.1))


def test_neighbours_are_those_of_the_filter(viewed):
    kept = got(viewed, "/api/episodes?mode=blocked&order=longest&limit=96")["episodes"]
    place = next(
        k for k, e in enumerate(kept) if (e["scene_id"], e["index"]) == ("scene-000001", 1)
    )
    near = got(viewed, f"{FULL}/neighbours?mode=blocked&order=longest")
    assert (near["place"], near["total"]) == (place, len(kept))
    assert (near["before"], near["after"]) == (kept[place - 1], kept[place + 1])
    outside = got(viewed, f"{FULL}/neighbours?mode=lengthened")
    assert outside["place"] is None


def test_statistics_are_those_beside_the_data_and_computed_where_they_are_not(
    viewed, folder, tmp_path
):
    stored = json.loads((folder / "stats.json").read_text())
    assert got(viewed, "/api/statistics")["stats"] == stored
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    (copy / "stats.json").write_text('{"episodes": 7}')
    assert got(ViewedDataset(copy), "/api/statistics")["stats"] == stored


@pytest.mark.parametrize(
    ("url", "status", "words"),
    [
        ("/api/episode/scene-000001/77", 404, ["no episode scene-000001/0077", "36 episodes in 3"]),
        ("/api/episode/scene-009999/0/thumbnail", 404, ["no episode scene-009999/0000"]),
        (f"{FULL}/obstacle/9/push_east", 400, ["no obstacle 9", "it has 2"]),
        (f"{FULL}/obstacle/1/push_north", 400, ["obstacle 1", "no pose is stored", "push_north"]),
        (f"{FULL}/obstacle/1/push_east/99", 400, ["frame", "0 to 8", "99"]),
        (f"{FULL}/play/999", 400, ["0 to 11", "999"]),
        ("/api/episodes?rooms=x", 400, ["rooms", "a number"]),
        ("/api/episode/../../etc/passwd", 404, ["nothing at"]),
        ("/api/episode/..%2f..%2fetc/0", 404, ["nothing at"]),
        ("/static/../viewed.py", 404, ["nothing at"]),
        ("/static/%2e%2e%2fviewed.js", 404, ["nothing at"]),
        ("/static/secret.js", 404, ["no module 'secret'"]),
        ("/manifest.json", 404, ["nothing at"]),
        ("//etc/passwd", 404, ["nothing at"]),
        ("/" + "x" * 5000, 414, ["4096"]),
        ("//[etc/passwd", 400, ["cannot be read"]),
        ("/api/episodes?" + "&".join(f"k{n}=1" for n in range(40)), 400, ["cannot be read"]),
    ],
)
def test_errors_are_a_line_with_what_to_do(viewed, url, status, words):
    text = error(viewed, url, status)
    assert all(word in text for word in words), text


def test_a_file_cut_short_behind_the_page_is_named_where_the_picture_would_be(folder, tmp_path):
    copy = tmp_path / "cut"
    shutil.copytree(folder, copy)
    viewed = ViewedDataset(copy)
    for path in copy.glob("data/episodes/*.parquet"):
        path.write_bytes(path.read_bytes()[:-200])
    for path in copy.glob("data/**/*.parquet"):
        path.write_bytes(path.read_bytes()[:-200])
    text = error(viewed, f"{FULL}/thumbnail", 500)
    assert "truncated or edited" in text
    with pytest.raises(CorruptDataError, match="truncated or edited"):
        ViewedDataset(copy)


def test_a_fault_of_ours_is_one_picture_less(viewed, monkeypatch):
    monkeypatch.setattr(ViewedDataset, "floor", lambda *_: 1 / 0)
    assert "ZeroDivisionError" in error(viewed, f"{FULL}/floor", 500)


def test_an_outcome_names_the_engine_that_disagrees(hand_episode):
    asked = replace(hand_episode.physics, other_engine="mujoco", other_build="mujoco 4")
    episode = replace(hand_episode, physics=asked)
    heavy = Outcome("push_east", False, 0.0, None, None, False, 0.0, "too heavy", agrees=False)
    assert outcome_text(episode, heavy) == "push east: too heavy; mujoco disagrees"
    for agrees in (True, None):
        assert outcome_text(episode, replace(heavy, agrees=agrees)) == "push east: too heavy"


@pytest.mark.parametrize(
    ("before", "after", "metres", "words"),
    [
        (None, 43, 9.155, "the path is open: 43 steps, 9.15 m to the goal"),
        (48, 48, 9.0, "the path stays: 48 steps, 9.00 m to the goal"),
        (48, 45, None, "45 steps to the goal: 3 fewer than before"),
        (None, None, None, "the path stays cut off"),
        (48, None, None, "the path is cut off"),
    ],
)
def test_an_outcome_tells_the_path_in_the_units_of_the_header(
    hand_episode, before, after, metres, words
):
    """Lattice steps and the Euclidean length, as for the path without obstacles."""
    episode = replace(hand_episode, obstructed_path_steps=before)
    pick = Outcome(
        "pick", True, 0.0, after, metres, before is None and after is not None, 0.0, None
    )
    assert outcome_text(episode, pick) == f"pick: in the agent's hand; {words}"
