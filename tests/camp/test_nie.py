"""`nie`: keypoints of what is in sight, by hand, and what is foreseen of them."""

import math

import pytest

torch = pytest.importorskip("torch")

from internav_data.camp.agents import make_agent  # noqa: E402
from internav_data.records.errors import UsageError  # noqa: E402
from internav_data.world.actions import ACTION_COUNT  # noqa: E402

SIZE = 16


def scene(depth=2.0, horizon=1, pixels=((6, 8), (10, 12)), number=3):
    """A flat thing at a depth over rows and columns; the floor elsewhere."""
    ids = torch.full((1, 1, SIZE, SIZE), -1, dtype=torch.int32)
    (top, bottom), (left, right) = pixels
    ids[..., top:bottom, left:right] = number
    return {
        "ids": ids,
        "depth": torch.full((1, 1, SIZE, SIZE, 1), depth),
        "horizon": torch.tensor([[horizon]]),
    }


@pytest.fixture
def agent(config):
    return make_agent("nie", config())


def test_corners_of_a_flat_thing_seen_straight_ahead(agent):
    """Pixels 10 and 11 of 16 lie between slopes 5/16 and 7/16 to the right; 6 and 7 above."""
    objects, corners = agent.sighted(scene())
    assert objects[0, 0].tolist() == [2, -1, -1, -1, -1, -1]
    corners = corners[0, 0, 0]
    low, high = corners.min(0).values, corners.max(0).values
    assert low.tolist() == pytest.approx([2.0, -2 * 7 / 16, 2 * 1 / 16])
    assert high.tolist() == pytest.approx([2.0, -2 * 5 / 16, 2 * 3 / 16])
    assert len({tuple(c) for c in corners.tolist()}) == 4  # flat: corners coincide in depth


def test_corners_are_level_when_the_camera_looks_down(agent):
    """The middle of a picture taken 30 degrees down at depth d is d cos 30 ahead, d sin 30 down."""
    seen = scene(horizon=2, pixels=((7, 9), (7, 9)))
    corners = agent.sighted(seen)[1][0, 0, 0]
    middle = corners.mean(0).tolist()
    assert middle[0] == pytest.approx(2 * math.cos(math.pi / 6), abs=0.1)
    assert middle[1] == pytest.approx(0.0, abs=1e-6)
    assert middle[2] == pytest.approx(-2 * math.sin(math.pi / 6), abs=0.1)


def test_the_nearest_come_first_and_no_more_than_asked_for(agent):
    seen = scene()
    for k in range(8):
        seen["ids"][0, 0, 0, k] = 10 + k
        seen["depth"][0, 0, 0, k] = 1.5 - 0.1 * k
    objects, _ = agent.sighted(seen)
    assert objects[0, 0].tolist() == [16, 15, 14, 13, 12, 11]


def test_at_the_start_nothing_is_foreseen_to_move(agent):
    corners = torch.randn(2, 5, 8, 3)
    ahead = agent.predicted(torch.randn(2, 5, 64), corners)
    torch.testing.assert_close(ahead, corners.unsqueeze(-3).expand(2, 5, ACTION_COUNT, 8, 3))


def test_the_loss_is_how_far_things_in_sight_went_unforeseen(collected):
    """0.1 m ahead for all corners of one thing: L1 is 0.1 / 3, times the weight 3."""
    agent, _, (rollout, _) = collected("nie")
    record = rollout.batch.record
    record.corners.zero_()
    record.objects.fill_(-1)
    record.objects[..., 0] = 4
    record.corners[1:, :, 0, :, 0] += 0.1
    record.objects[5:, 1, 0] = 9  # another thing: nothing is known of where 4 went
    rollout.batch.episode_starts[1:] = False
    rollout.batch.episode_starts[3, 2] = True  # another episode
    loss = agent.evaluate(rollout.batch).loss
    right = torch.zeros(8, 4)
    right[0] = 0.1
    torch.testing.assert_close(loss, right)
    record.corners[1:, :, 0, :, 0] += torch.arange(7)[:, None, None] * 0.1
    loss = agent.evaluate(rollout.batch).loss
    right[:7] = 0.1
    right[2, 2] = right[4, 1] = 0.0
    torch.testing.assert_close(loss, right)


def test_nobody_in_sight_changes_nothing(agent):
    seen = {**scene(), "rgb": torch.zeros(1, 1, SIZE, SIZE, 3, dtype=torch.uint8)}
    seen |= {"goal": torch.ones(1, 1, 2), "held": torch.zeros(1, 1).long()}
    seen["ids"][:] = -1
    features = agent.summarised(agent.encoder(seen), *agent.sighted(seen))
    assert torch.isfinite(features).all()
    assert not features[..., -64:].any()


def test_masks_are_needed(agent):
    with pytest.raises(UsageError, match="sensors="):
        agent.sighted({"depth": torch.zeros(1)})
