from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from internav_data.records.errors import UsageError
from internav_data.views import draw_episode, draw_house, episode_lines
from internav_data.views.episodes import _legend
from internav_data.views.plan import _arrow, _scale_place, _scale_width, house_canvas

MARGIN = 0.75
PIXELS = 900
SCALE = PIXELS / (9.0 + 2 * MARGIN)


def at(picture, x, y):
    """Median colour of the 3 x 3 pixels around a point of the hand-written house."""
    row, column = round((4.0 + MARGIN - y) * SCALE), round((x + MARGIN) * SCALE)
    return np.median(picture[row - 1 : row + 2, column - 1 : column + 2].reshape(-1, 3), axis=0)


def near(colour, wanted, tolerance=40):
    return bool(np.abs(np.asarray(colour, float) - np.asarray(wanted, float)).max() <= tolerance)


@pytest.fixture(scope="module")
def picture(hand_house):
    return draw_house(hand_house, pixels=PIXELS)


def test_the_plans_longer_side_is_what_was_asked_for(hand_house):
    picture = draw_house(hand_house, pixels=700, caption=False)
    assert picture.dtype == np.uint8
    assert picture.shape == (round(700 * 5.5 / 10.5), 700, 3)


def test_a_house_is_drawn_alike_twice(hand_house, picture):
    assert np.array_equal(draw_house(hand_house, pixels=PIXELS), picture)


def test_things_and_walls_are_where_they_stand(picture):
    assert near(at(picture, 1.6, 1.45), (171, 128, 84)), "the table's top"
    assert near(at(picture, 8.2, 2.4), (86, 120, 146)), "the bed's cover, north-east"
    assert near(at(picture, 5.0, 0.7), (66, 68, 78), 12), "the wall between the rooms"
    assert near(at(picture, -0.5, 3.0), (250, 249, 246), 6), "nothing outside"
    assert at(picture, 2.2, 4.0)[2] > at(picture, 2.2, 4.0)[0] + 20, "the window's pane is blue"


def test_what_is_higher_hides_what_is_lower(picture):
    # The chair's seat reaches under the table's edge at y = 2.0: the table is seen there.
    assert near(at(picture, 1.6, 1.985), (171, 128, 84), 60)
    assert near(at(picture, 1.6, 2.25), (98, 122, 150)), "the seat, over the rug"
    assert near(at(picture, 0.75, 1.2), (170, 120, 110)), "the rug beside the table"


def test_an_open_door_is_a_gap_and_the_entrance_is_closed(picture):
    assert at(picture, 5.0, 2.0).mean() > 180
    assert at(picture, 4.0, 0.0).mean() < 150


def test_what_hangs_overhead_hides_nothing(hand_house, picture):
    table = hand_house.objects[1]
    lifted = replace(table, object_id=9, x=3.5, y=3.0, z=2.1)
    higher = replace(hand_house, objects=(*hand_house.objects, lifted))
    drawn = draw_house(higher, pixels=PIXELS)
    assert near(at(drawn, 3.3, 2.8), at(picture, 3.3, 2.8), 3)


def test_an_episode_shows_obstacles_start_and_goal(hand_house, hand_episode):
    drawn = draw_episode(hand_house, hand_episode, pixels=PIXELS)
    red, green, blue = at(drawn, 5.12, 1.86)
    assert red > 180
    assert green > 150
    assert blue < 110, "the chair in the door is yellow"
    assert near(at(drawn, 7.0 + 0.165, 1.0), (36, 104, 214), 60), "the goal is blue"
    assert near(at(drawn, 3.0 + 0.15, 1.0), (40, 148, 84), 60), "the start is green"
    tip = at(drawn, 3.0, 1.24)
    assert tip.mean() > 200, "the arrow points north, as the start's yaw of 90 degrees does"


def test_rooms_on_the_way_are_tinted_and_others_pale(hand_house, hand_episode):
    alone = replace(hand_episode, room_paths=((1,),))
    drawn = draw_episode(hand_house, alone, pixels=PIXELS)
    plain = draw_house(hand_house, pixels=PIXELS)
    assert at(drawn, 4.0, 3.2).mean() > at(plain, 4.0, 3.2).mean() + 10
    gain = at(drawn, 6.0, 3.0) - at(plain, 6.0, 3.0)
    assert gain[2] > gain[0]


def test_a_way_is_drawn_where_it_runs(hand_house, hand_episode):
    way = np.array([[3.5, 3.0], [4.5, 3.0]])
    drawn = draw_episode(hand_house, hand_episode, pixels=PIXELS, path=way)
    assert near(at(drawn, 4.0, 3.0), (36, 104, 214), 60)


def test_obstacles_need_their_assets(hand_house, hand_episode):
    bare = replace(
        hand_house, assets={k: v for k, v in hand_house.assets.items() if "App" not in k}
    )
    with pytest.raises(UsageError, match="Apple_0"):
        draw_episode(bare, hand_episode)
    drawn = draw_episode(bare, hand_episode, {"Apple_0": hand_house.assets["Apple_0"]}, pixels=300)
    assert drawn.shape[1] == 300


def test_an_episode_of_another_house_is_refused(hand_house, hand_episode):
    with pytest.raises(UsageError, match="scene-000004"):
        draw_episode(hand_house, replace(hand_episode, scene_id="scene-000004"))


def test_captions_say_what_the_episode_says(hand_episode):
    first, second = episode_lines(hand_episode)
    assert "scene-000003/0001" in first
    assert "blocked, sealed" in first
    assert "shortest path 22 steps, 5.10 m" in first
    assert second == "1 Chair 10.0 kg (push)   2 Apple 0.2 kg (pick)"
    assert first.endswith("with obstacles cut off")
    off_grid = replace(hand_episode, sealed=False, obstructed_path_m=6.5)
    assert "cut off on the grid, 6.50 m off it" in episode_lines(off_grid)[0]
    open_one = replace(
        hand_episode,
        mode="lengthened",
        obstructed_path_steps=40,
        obstructed_path_m=8.25,
        sealed=False,
    )
    assert (
        "lengthened   shortest path 22 steps, 5.10 m   with obstacles 40 steps, 8.25 m"
        in (episode_lines(open_one)[0])
    )


def test_a_fixed_obstacle_is_hatched(hand_house, hand_episode):
    chair = hand_episode.obstacles[0]
    fixed = replace(hand_episode, obstacles=(replace(chair, pushable=False),))
    pushed = replace(hand_episode, obstacles=(chair,))
    seat = (slice(200, 280), slice(470, 515))
    plain = draw_episode(hand_house, pushed, pixels=PIXELS)[seat]
    hatched = draw_episode(hand_house, fixed, pixels=PIXELS)[seat]
    dark = [(image.sum(axis=2) < 260).mean() for image in (plain, hatched)]
    assert dark[1] > dark[0] + 0.03


def test_the_canvas_leaves_a_margin_around_the_outline(hand_house):
    canvas = house_canvas(hand_house, PIXELS)
    assert canvas.scale == pytest.approx(SCALE)


@pytest.mark.parametrize(
    ("x", "y", "yaw_deg", "place"),
    [
        (4.0, 0.0, 0.0, "left"),
        (1.0, 0.0, 0.0, "right"),
        (8.0, 0.0, 0.0, "left"),
        (4.0, 4.0, 0.0, "left"),
        (9.0, 0.6, 90.0, "left"),
    ],
)
def test_the_scale_keeps_clear_of_the_entrances_arrow(hand_house, x, y, yaw_deg, place):
    entrance = next(door for door in hand_house.doors if not door.open)
    moved = replace(entrance, x=x, y=y, yaw_deg=yaw_deg)
    rest = tuple(door for door in hand_house.doors if door.open)
    house = replace(hand_house, doors=(*rest, moved))
    canvas = house_canvas(house, PIXELS)
    width = _scale_width(canvas)
    found = _scale_place(canvas, house)
    assert found == ((0.0 if place == "left" else 9.0 - width), pytest.approx(-0.45))
    arrow = np.vstack(_arrow(house, moved))
    bar = shapely.box(*found, found[0] + width, found[1] + 0.09)
    assert shapely.distance(bar, shapely.MultiPoint(arrow).convex_hull) > 0.05


def test_the_legends_colours_differ(hand_episode):
    entries = [np.array(colour, float) for colour, _ in _legend(hand_episode)]
    for k, one in enumerate(entries):
        for other in entries[k + 1 :]:
            assert np.linalg.norm(one - other) > 40.0
