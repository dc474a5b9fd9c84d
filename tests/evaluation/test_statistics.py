from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from scipy.special import stdtrit

from internav_data.evaluation.statistics import (
    by_method,
    check_comparable,
    deviation,
    figures,
    pooled_deviation,
    resolution,
    scene_interval,
    seed_difference,
    seed_interval,
)
from internav_data.records.errors import UsageError

A = [0.51, 0.55, 0.49, 0.56, 0.50]
B = [0.44, 0.47, 0.46]


def test_seed_intervals_are_students():
    found = seed_interval(A)
    half = 2.7764451 * np.std(A, ddof=1) / 5**0.5  # by the table of t, 4 degrees of freedom
    bounds = np.mean(A) - half, np.mean(A) + half
    assert (found.mean, found.low, found.high) == pytest.approx((np.mean(A), *bounds))
    assert found.half == pytest.approx(half)
    same = seed_interval([0.5, 0.5])
    assert (same.low, same.high) == (0.5, 0.5)
    assert deviation(A) == pytest.approx(np.std(A, ddof=1))


def test_one_seed_has_no_interval():
    one = seed_interval([0.5])
    assert (one.mean, one.low, one.high, one.half, one.count) == (0.5, None, None, None, 1)
    assert not one.excludes_zero
    assert seed_difference([0.5], A).low is None
    assert resolution(1, 0.1) is None
    assert pooled_deviation([[0.1], [0.2]]) is None


def test_differences_are_welchs():
    found = seed_difference(A, B)
    a, b = np.var(A, ddof=1) / len(A), np.var(B, ddof=1) / len(B)
    freedom = (a + b) ** 2 / (a**2 / (len(A) - 1) + b**2 / (len(B) - 1))
    half = stdtrit(freedom, 0.975) * (a + b) ** 0.5
    mean = np.mean(A) - np.mean(B)
    assert (found.mean, found.low, found.high) == pytest.approx((mean, mean - half, mean + half))
    assert found.excludes_zero
    assert not seed_difference(A, A).excludes_zero
    same = seed_difference([0.5, 0.5], [0.4, 0.4])
    assert (same.low, same.high) == pytest.approx((0.1, 0.1))


def test_five_seeds_at_a_deviation_of_two_points():
    """Half the interval by the table of t (8 degrees of freedom), and the power by simulation."""
    found = resolution(5, 2.0)
    assert found.half == pytest.approx(2.306004 * 2.0 * (2 / 5) ** 0.5, rel=1e-6)
    rng = np.random.default_rng(0)
    first = rng.normal(found.found, 2.0, (4000, 5))
    second = rng.normal(0.0, 2.0, (4000, 5))
    p = stats.ttest_ind(first, second, axis=1).pvalue
    assert 0.75 < (p < 0.05).mean() < 0.87


def test_pooled_deviation_by_hand():
    assert pooled_deviation([[1.0, 3.0], [10.0, 10.0], [5.0]]) == pytest.approx((2.0 / 2) ** 0.5)


def test_scene_intervals_hold_whole_scenes_together(row):
    alike = [row(k, scene=s, success=s % 2 == 0) for s in range(20) for k in range(50)]
    found = scene_interval(alike, "success")
    assert (found.mean, found.count) == (0.5, 20)
    # As 20 coins, not as 1,000: half a width of about 1.96 * 0.5 / sqrt(20) = 0.22.
    assert 0.17 < found.half < 0.26
    assert scene_interval(alike, "success") == found, "the same every time"
    assert scene_interval(alike, "isr") is None, "nobody interacts"
    assert scene_interval([row()], "success") is None, "one scene"


def test_paired_scene_intervals_cancel_what_is_common(row):
    rng = np.random.default_rng(1)
    good = rng.random((40, 5)) < rng.random((40, 1))
    first = [row(k, scene=s, success=bool(good[s, k])) for s in range(40) for k in range(5)]
    second = [row(k, scene=s, success=bool(good[s, k] and k)) for s in range(40) for k in range(5)]
    found = scene_interval(first, "success", second)
    alone = scene_interval(first, "success")
    assert found.mean == pytest.approx(good[:, 0].sum() / 200)
    assert found.half < 0.7 * alone.half
    assert scene_interval(first, "success", first).half == 0.0


def test_ratios_are_of_sums_not_means_of_ratios(row):
    many = [row(0, scene=s, pushes_tried=1 + 9 * (s % 2), pushes_done=s % 2) for s in range(10)]
    assert scene_interval(many, "pusr").mean == pytest.approx(5 / 55)


def test_scenes_alone_find_false_winners_and_seeds_do_not(row):
    """Null comparisons: two methods that differ by nothing but their seeds' luck."""
    rng = np.random.default_rng(2)
    false_seeds = false_scenes = 0
    for _ in range(60):
        skills = rng.normal(0.5, 0.08, (2, 5))
        false_seeds += seed_difference(*skills.tolist()).excludes_zero
        one = [
            [row(k, scene=s, success=bool(rng.random() < p)) for s in range(60) for k in range(4)]
            for p in skills[:, 0]
        ]
        false_scenes += scene_interval(one[0], "success", one[1]).excludes_zero
    assert false_seeds <= 7, "one in twenty expected"
    assert false_scenes >= 15, "a third and more"


def test_what_cannot_be_compared_is_refused(row, evaluation):
    first = evaluation([row(0), row(1)], training_seed=0)
    good = evaluation([row(0), row(1)], training_seed=1)
    reference_policy = evaluation([row(0), row(1)], "expert", is_reference=True)
    greedy = evaluation([row(0), row(1)], "ppo", greedy=True)
    check_comparable([first, good, reference_policy])
    check_comparable([greedy, reference_policy])
    check_comparable([reference_policy, greedy])
    wrong = [
        (evaluation([row(0)], training_seed=1), "other episodes"),
        (evaluation([row(0), row(1)], "ppo", dataset="e"), "dataset"),
        (evaluation([row(0), row(1)], "ppo", split="val"), "split"),
        (evaluation([row(0), row(1)], "ppo", max_steps=200), "max_steps"),
        (greedy, "--greedy"),
        (first, "twice"),
    ]
    for other, word in wrong:
        with pytest.raises(UsageError, match=word):
            check_comparable([reference_policy, first, other])


def test_seeds_are_gathered_by_method(row, evaluation):
    seeds = [evaluation([row(success=k > 0)], training_seed=k) for k in range(3)]
    other = evaluation([row()], "ppo")
    methods = by_method([seeds[0], other, *seeds[1:]])
    assert list(methods) == ["camp", "ppo"]
    assert figures(methods["camp"], "all", "success") == [0.0, 1.0, 1.0]
    assert figures(methods["camp"], "hard", "success") == []
