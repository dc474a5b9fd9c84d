from __future__ import annotations

import hashlib
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from internav_data.planner.search import expert_of_episode
from internav_data.records.errors import InternavError, UsageError
from internav_data.render.camera import Camera, CameraView, StaticScene
from internav_data.views import Replay, read_actions, replay_frames, write_video
from internav_data.views.replay_story import describe, shots
from internav_data.world import Action, HouseModel

AHEAD, LEFT, RIGHT, DOWN, PUSH, PICK, DROP, DONE = 0, 1, 2, 3, 5, 9, 10, 11
# From (3, 1) looking north: to the door's height, up to the chair in the door, away with it.
TO_THE_DOOR = [*[AHEAD] * 4, RIGHT, *[AHEAD] * 4]
TRIED = [*TO_THE_DOOR, PICK, PUSH, LEFT, DOWN]
SIZE = 200


@pytest.fixture(scope="module")
def model(hand_house):
    return HouseModel.of(hand_house)


@pytest.fixture(scope="module")
def tried(model, hand_episode):
    return Replay.of(model, hand_episode, model.house.assets, TRIED)


@pytest.fixture(scope="module")
def solved(model, hand_episode):
    expert = expert_of_episode(model, hand_episode, model.house.assets)
    return Replay.of(model, replace(hand_episode, expert=expert), model.house.assets)


@pytest.fixture(scope="module")
def frames(tried):
    return list(tried.frames(size=SIZE, fps=12.0))


def digest(frames):
    total = hashlib.sha256()
    for frame in frames:
        total.update(frame.tobytes())
    return total.hexdigest()


def eye(frame):
    """The camera's picture in a frame: below a header, behind a gap of 4 at this size."""
    header = 2 * round(15 * SIZE / 400)
    return frame[header : header + SIZE, 4 : 4 + SIZE]


def test_frames_are_as_many_as_the_actions_ask_for(frames):
    # Title and end 18 each; a move, turn or look a quarter of a second; a failure 0.6 s; a push
    # 0.4 s of pointing, 0.5 s of sliding (its last picture is the result's), 0.6 s of result.
    assert len(frames) == 18 + 9 * 3 + 7 + (5 + 5 + 7) + 2 * 3 + 18
    assert {frame.shape for frame in frames} == {frames[0].shape}
    assert frames[0].dtype == np.uint8
    assert frames[0].shape[0] % 2 == frames[0].shape[1] % 2 == 0


def test_the_same_episode_gives_the_same_frames(tried, frames, hand_house, hand_episode):
    next(iter(tried.frames(size=300)))  # what was drawn before does not matter
    again = replay_frames(hand_house, hand_episode, hand_house.assets, TRIED, size=SIZE)
    assert digest(again) == digest(frames)


def test_the_camera_shows_what_the_world_is_like(tried, frames, model, hand_episode):
    """Against pictures of a camera set up by hand, after every action."""
    scenery, camera, count = StaticScene.of(model.house), Camera(SIZE), 18
    assets = model.house.assets
    props = scenery.props((assets[o.asset_id], o.pose) for o in hand_episode.obstacles)
    for moment in tried.story.moments[1:10]:
        count += 3
        x, y = moment.world.position
        view = CameraView(
            scenery, props, x, y, 90.0 * moment.world.quarter, moment.world.horizon_deg
        )
        assert np.array_equal(eye(frames[count - 1]), camera.render([view]).rgb[0])
    pushed = tried.story.moments[11].pose(1 + 1)
    props.move(len(model.house.objects), pushed)
    after = tried.story.moments[13]
    x, y = after.world.position
    view = CameraView(scenery, props, x, y, 90.0, after.world.horizon_deg)
    assert np.array_equal(
        eye(frames[-1])[20:-20, 20:-20], camera.render([view]).rgb[0][20:-20, 20:-20]
    )


def test_words_say_what_happened_and_why_not(tried, solved):
    told = [describe(tried.story, m) for m in tried.story.moments]
    assert told[0] == "start"
    assert told[1:10] == [*["move ahead"] * 4, "turn right", *["move ahead"] * 4]
    assert told[10].startswith("pick up failed: nothing to pick up")
    assert told[11].startswith("push ahead: Chair 1 slid ")
    result = tried.story.moments[11].result
    assert f"{result.displacement_m:.2f} m" in told[11]
    assert told[11].endswith("the way is open")
    last = list(shots(tried.story, 12.0))[-1]
    assert (last.mood, last.text) == ("bad", "ended after 13 actions, not done at the goal")
    assert not tried.success
    assert solved.success
    last = list(shots(solved.story, 12.0))[-1]
    assert (last.mood, last.text) == ("good", f"done: reached the goal in {solved.steps} actions")


def test_a_slide_runs_from_where_it_stood_to_where_it_lies(tried):
    cut = [s for s in shots(tried.story, 60.0) if s.target == 2]
    begin, end = tried.story.moments[10].pose(2), tried.story.moments[11].pose(2)
    x = [s.poses[2].x for s in cut]
    assert x[0] == begin.x
    assert x[-1] == end.x
    assert x == sorted(x)
    assert len(set(x)) == 31
    assert cut[0].text == "push ahead: Chair 1"
    assert cut[0].path_steps is None
    assert cut[-1].path_steps is not None


def test_what_is_held_is_told_and_leaves_an_outline(model, hand_episode):
    beside = replace(hand_episode.obstacles[1], x=3.0, y=1.8)
    episode = replace(hand_episode, obstacles=(hand_episode.obstacles[0], beside))
    played = Replay.of(model, episode, model.house.assets, [PICK, AHEAD, DROP])
    told = [describe(played.story, m) for m in played.story.moments]
    assert told[1].startswith("pick up Apple 2")
    assert told[3].startswith("drop Apple 2")
    cut = list(shots(played.story, 4.0))
    assert [s.poses[3] is None for s in cut] == [False, False, True, True, False, False]
    assert played.story.moments[1].world.held == 3
    # The camera no longer has it; what is shown in a corner instead is not the camera's.
    assets, film = model.house.assets, list(played.frames(size=SIZE, fps=4.0))
    chair = episode.obstacles[0]
    view = CameraView(*_alone(model, [(assets[chair.asset_id], chair.pose)]), 3.0, 1.25, 90.0, 30.0)
    seen, wanted = eye(film[-9]), Camera(SIZE).render([view]).rgb[0]
    assert np.array_equal(seen[: SIZE // 2], wanted[: SIZE // 2])
    assert np.array_equal(seen[:, : SIZE // 2], wanted[:, : SIZE // 2])
    assert not np.array_equal(seen[SIZE // 2 :, SIZE // 2 :], wanted[SIZE // 2 :, SIZE // 2 :])


def _alone(model, obstacles):
    scenery = StaticScene.of(model.house)
    return scenery, scenery.props(obstacles)


def test_the_map_shows_the_agent_where_it_stands(tried, frames):
    from internav_data.views.replay_painters import AGENT_COLOUR, MapPainter

    painter = MapPainter(tried.story, SIZE)
    canvas = painter.canvas
    shot = list(shots(tried.story, 12.0))[-1]
    picture = painter.draw(shot)
    assert picture.shape == (SIZE, painter.size[0], 3)
    rows, columns = canvas.window((4.0 - 0.16, 2.0 - 0.16), (4.0 + 0.16, 2.0 + 0.16))
    near = picture[rows.start // 2 : rows.stop // 2, columns.start // 2 : columns.stop // 2]
    close = np.abs(near.astype(int) - np.array(AGENT_COLOUR)).max(axis=-1) < 30
    assert close.mean() > 0.3, "the arrow on it is white"
    first = painter.draw(next(iter(shots(tried.story, 12.0))))
    near = first[rows.start // 2 : rows.stop // 2, columns.start // 2 : columns.stop // 2]
    assert (np.abs(near.astype(int) - np.array(AGENT_COLOUR)).max(axis=-1) < 30).mean() < 0.1
    assert np.array_equal(painter.draw(shot), picture), "nothing of one picture is left in the next"


def share_of(picture, canvas, low, high, colour):
    """Return the share of a rectangle of the map, metres, that is about of a colour."""
    rows, columns = canvas.window(low, high)
    near = picture[rows.start // 2 : rows.stop // 2, columns.start // 2 : columns.stop // 2]
    return (np.abs(near.astype(int) - np.array(colour)).max(axis=-1) < 40).mean()


def test_the_map_shows_the_trail_and_where_things_stood(tried):
    from internav_data.views.replay_painters import AGENT_COLOUR, GHOST, MapPainter

    painter = MapPainter(tried.story, 400)
    all_shots = list(shots(tried.story, 12.0))
    first, last = painter.draw(all_shots[0]), painter.draw(all_shots[-1])
    trail = ((2.95, 1.5), (3.05, 1.7))
    assert share_of(last, painter.canvas, *trail, AGENT_COLOUR) > 0.3
    assert share_of(first, painter.canvas, *trail, AGENT_COLOUR) == 0.0
    stood = ((4.75, 2.18), (5.25, 2.27))  # the chair's back
    assert share_of(last, painter.canvas, *stood, GHOST) > 0.1
    for shot in all_shots[2::4]:
        fresh = MapPainter(tried.story, 400)
        assert np.array_equal(fresh.draw(shot), painter.draw(shot)), "of the shot alone"


def test_words_are_written_below_and_fit(tried, frames, model, hand_episode):
    footer = 2 * round(38 * SIZE / 400)
    red = np.array((200, 36, 24))

    def words(frame):
        return frame[-footer : -footer + 16]

    assert (words(frames[20]) < 100).all(axis=-1).sum() > 30
    assert (np.abs(words(frames[-1]).astype(int) - red).max(axis=-1) < 40).sum() > 30
    assert (np.abs(words(frames[20]).astype(int) - red).max(axis=-1) < 40).sum() == 0
    for frame in frames:
        assert (words(frame)[:, -3:] > 200).all(), "nothing runs over the edge"


def test_a_panel_is_asked_once_a_moment_and_drawn_beside(model, hand_episode, frames):
    asked = []

    def panel(moment):
        asked.append(moment.step)
        return np.full((SIZE, 40, 3), 10 + moment.step, np.uint8)

    film = list(
        replay_frames(
            model, hand_episode, model.house.assets, TRIED, size=SIZE, fps=12.0, panel=panel
        )
    )
    assert asked == list(range(len(TRIED) + 1))
    assert film[0].shape[1] == frames[0].shape[1] + 40 + 4
    assert (film[0][60, -30] == 10).all()
    assert (film[-1][60, -30] == 10 + len(TRIED)).all()
    with pytest.raises(UsageError, match=r"\(200, w, 3\)"):
        list(
            replay_frames(
                model, hand_episode, model.house.assets, TRIED, size=SIZE,
                panel=lambda _: np.zeros((SIZE - 1, 40, 3), np.uint8),
            )
        )  # fmt: skip


def test_nothing_after_done_is_played_and_waiting_is_allowed(model, hand_episode):
    played = Replay.of(model, hand_episode, model.house.assets, [-1, DONE, AHEAD])
    assert [r.action for r in played.story.results] == [Action.WAIT, Action.DONE]
    assert describe(played.story, played.story.moments[-1]) == "done failed: not at the goal"


@pytest.mark.parametrize("kind", ["mp4", "gif"])
def test_a_film_is_read_back_whole(frames, tmp_path, kind):
    path = tmp_path / "deep" / f"film.{kind}"
    assert write_video(path, iter(frames), 12.0) == len(frames)
    capture, back = cv2.VideoCapture(str(path)), []
    while True:
        good, frame = capture.read()
        if not good:
            break
        back.append(frame[..., ::-1])
    wanted = frames
    if kind == "gif":  # equal ones in a row are one
        wanted = [f for k, f in enumerate(frames) if k == 0 or not np.array_equal(f, frames[k - 1])]
    else:
        assert round(capture.get(cv2.CAP_PROP_FPS), 3) == 12.0
    assert len(back) == len(wanted)
    assert all(frame.shape == wanted[0].shape for frame in back)
    for seen, frame in zip(back, wanted, strict=True):
        assert np.abs(seen.astype(int) - frame).mean() < 6.0
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_an_mp4_of_odd_sides_gets_a_row_and_a_column(tmp_path):
    frame = np.full((51, 63, 3), 120, np.uint8)
    write_video(tmp_path / "odd.mp4", [frame] * 3, 5.0)
    good, seen = cv2.VideoCapture(str(tmp_path / "odd.mp4")).read()
    assert good
    assert seen.shape == (52, 64, 3)


def test_a_film_that_fails_leaves_nothing_and_keeps_the_older_one(tmp_path):
    def broken():
        yield np.zeros((40, 40, 3), np.uint8)
        raise UsageError("no more")

    for kind in ("mp4", "gif"):
        path = tmp_path / f"film.{kind}"
        path.write_bytes(b"older")
        for frames in (broken(), iter([])):
            with pytest.raises(UsageError):
                write_video(path, frames, 5.0)
        assert path.read_bytes() == b"older"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["film.gif", "film.mp4"]
    with pytest.raises(UsageError, match=r"\.avi"):
        write_video(tmp_path / "film.avi", broken(), 5.0)
    with pytest.raises(UsageError, match="second"):
        write_video(tmp_path / "film.gif", broken(), 0.0)
    with pytest.raises(InternavError, match="cannot be written"):
        write_video(tmp_path / "film.gif" / "film.gif", broken(), 5.0)


def test_what_cannot_be_played_is_refused(model, hand_episode):
    assets = model.house.assets
    with pytest.raises(UsageError, match="no expert"):
        Replay.of(model, hand_episode, assets)
    with pytest.raises(UsageError, match="action 1: expected"):
        Replay.of(model, hand_episode, assets, [0, 13])
    with pytest.raises(UsageError, match="10000"):
        Replay.of(model, hand_episode, assets, [0] * 10_001)
    with pytest.raises(UsageError, match="Chair_0"):
        Replay.of(model, hand_episode, {}, [0])
    with pytest.raises(UsageError, match="scene-000009"):
        Replay.of(model, replace(hand_episode, scene_id="scene-000009"), assets, [0])
    film = Replay.of(model, hand_episode, assets, [0])
    with pytest.raises(UsageError, match="160 to 1080"):
        film.frames(size=20)
    with pytest.raises(UsageError, match="1 to 60"):
        film.frames(fps=0.0)


def test_actions_are_read_by_name_and_number(tmp_path):
    path = tmp_path / "mine.json"
    path.write_text(json.dumps(["MoveAhead", "rotate_left", "PUSH_BACK", 9, 11, -1]))
    assert read_actions(path).actions == (0, 1, 6, 9, 11, -1)
    assert read_actions(path).episode_id is None
    path.write_text(json.dumps({"episode_id": "scene-000003/0001", "actions": [0, "Done"]}))
    assert read_actions(path).actions == (0, 11)
    assert read_actions(path).episode_id == "scene-000003/0001"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("MoveAhead\nDone\n", "not JSON"),
        ("[" * 100_000, "not JSON"),
        ('"MoveAhead"', "a list of actions"),
        ("[]", "1 to 10000"),
        ("[0" + ",0" * 10_000 + "]", "1 to 10000"),
        ('["Jump"]', "action 0 is 'Jump'; expected one of 0 MoveAhead"),
        ("[0, 13]", "action 1 is '13'"),
        ("[0, true]", "action 1 is 'True'"),
        ("[1.0]", "action 0 is '1.0'"),
        ('{"acts": [0]}', "'acts'"),
        ('{"actions": [0], "episode_id": 3}', "episode_id"),
        (" " * 1_000_001, "too large"),
    ],
)
def test_a_bad_file_of_actions_is_told_apart(tmp_path, text, words):
    path = tmp_path / "mine.json"
    path.write_text(text)
    with pytest.raises(UsageError, match=r"mine\.json") as caught:
        read_actions(path)
    assert words in str(caught.value)
    with pytest.raises(UsageError, match=r"none\.json"):
        read_actions(tmp_path / "none.json")
