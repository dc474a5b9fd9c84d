from __future__ import annotations

import io

import cv2
import numpy as np
import pytest

from internav_data.records.errors import UsageError
from internav_data.views.gif import write_gif


def decoded(frames, fps, tmp_path):
    """Frames and hundredths of a second as two other decoders see them."""
    path = tmp_path / "film.gif"
    with path.open("wb") as file:
        assert write_gif(file, frames, fps) == len(frames)
    good, film = cv2.imreadanimation(str(path))
    assert good
    pictures = [frame[..., 2::-1] for frame in film.frames]
    capture, again = cv2.VideoCapture(str(path)), []
    while True:
        good, frame = capture.read()
        if not good:
            break
        again.append(frame[..., ::-1])
    assert len(again) == len(pictures)
    assert all(np.array_equal(a, b) for a, b in zip(again, pictures, strict=True))
    return pictures, [round(ms / 10) for ms in film.durations]


def blocks(rng, count, side=16, size=12):
    """A picture of squares of few colours, eight levels apart so that none are taken as one."""
    colours = rng.choice(32, (count, 3)) * 8
    return np.kron(
        colours[rng.integers(count, size=(size, size))], np.ones((side, side, 1))
    ).astype(np.uint8)


def test_few_colours_come_back_exactly(tmp_path):
    rng = np.random.default_rng(1)
    frames = [blocks(rng, 60) for _ in range(4)]
    pictures, stay = decoded(frames, 10.0, tmp_path)
    assert all(np.array_equal(a, b) for a, b in zip(pictures, frames, strict=True))
    assert stay == [10, 10, 10, 10]


def test_noise_fills_the_table_of_codes_and_comes_back_near(tmp_path):
    rng = np.random.default_rng(2)
    frames = [rng.integers(0, 256, (150, 201, 3)).astype(np.uint8) for _ in range(2)]
    pictures, _ = decoded(frames, 5.0, tmp_path)
    for seen, frame in zip(pictures, frames, strict=True):
        # 255 colours for all of them: a cube's side of 256 / 6.3, half of it off at the worst.
        assert np.abs(seen.astype(int) - frame).mean() < 16.0


def test_a_smooth_picture_loses_little(tmp_path):
    ramp = np.linspace(40, 220, 300)[None, :, None] * np.array([1.0, 0.8, 0.6])
    frame = np.repeat(ramp, 200, axis=0).astype(np.uint8)
    (seen,), _ = decoded([frame], 5.0, tmp_path)
    assert np.abs(seen.astype(int) - frame).max() <= 4


def test_what_did_not_change_is_not_stored_again(tmp_path):
    rng = np.random.default_rng(3)
    first = rng.integers(0, 256, (200, 200, 3)).astype(np.uint8)
    second = first.copy()
    second[50:60, 70:90] = 255 - second[50:60, 70:90]
    one, two, same = io.BytesIO(), io.BytesIO(), io.BytesIO()
    write_gif(one, [first], 5.0)
    write_gif(two, [first, second], 5.0)
    write_gif(same, [first, first.copy(), first], 5.0)
    assert len(two.getvalue()) - len(one.getvalue()) < 2500
    assert len(same.getvalue()) == len(one.getvalue())
    pictures, _ = decoded([first, second], 5.0, tmp_path)
    rest = np.ones((200, 200), bool)
    rest[50:60, 70:90] = False
    assert np.array_equal(pictures[0][rest], pictures[1][rest])
    assert np.abs(pictures[1][50:60, 70:90].astype(int) - second[50:60, 70:90]).mean() < 16.0


def test_a_shade_more_or_less_is_left_as_it_is():
    rng = np.random.default_rng(5)
    first = blocks(rng, 60)
    second = np.clip(first + rng.integers(-2, 3, first.shape), 0, 255).astype(np.uint8)
    one, two = io.BytesIO(), io.BytesIO()
    write_gif(one, [first], 5.0)
    write_gif(two, [first, second], 5.0)
    assert len(two.getvalue()) - len(one.getvalue()) < 900


def test_a_film_lasts_as_long_as_its_frames(tmp_path):
    rng = np.random.default_rng(4)
    a, b, c = (blocks(rng, 20) for _ in range(3))
    _, stay = decoded([a, a, b, c, c, c, c], 12.0, tmp_path)
    assert len(stay) == 3
    assert sum(stay) == round(700 / 12)
    assert stay == [17, 8, 33]


def test_colours_that_drift_slowly_are_followed(tmp_path):
    frames = [np.full((8, 8, 3), 100 + k, np.uint8) for k in range(60)]
    pictures, _ = decoded([*frames, np.zeros((8, 8, 3), np.uint8)], 10.0, tmp_path)
    assert abs(int(pictures[-2][0, 0, 0]) - 159) <= 6


def test_no_frames_and_frames_of_two_sizes_are_refused():
    with pytest.raises(UsageError, match="one frame"):
        write_gif(io.BytesIO(), [], 5.0)
    with pytest.raises(UsageError, match=r"\(5, 4, 3\)"):
        write_gif(io.BytesIO(), [np.zeros((4, 4, 3), np.uint8), np.zeros((5, 4, 3), np.uint8)], 5.0)
