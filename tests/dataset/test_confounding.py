"""What looks tell about pushes: against a plain leave-one-out, and where the answer is known."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from internav_data.dataset import compute_stats, load_dataset
from internav_data.dataset.confounding import (
    PSEUDO_COUNTS,
    AssetLook,
    PushCounts,
    confounding,
)
from internav_data.records import type_affordances

ASSETS = 40


def drawn(rng, chance, count=4000):
    """Obstacles of random assets of two types, their four pushes alike with a chance by asset."""
    assets = rng.integers(ASSETS, size=count)
    won = 4 * (rng.random(count) < np.array([chance(int(a)) for a in assets]))
    levels = np.array([assets // 20, assets // 5, assets], np.int64)
    return levels, np.full(count, 4), won, np.ones(count)


def entropy(p):
    return -sum(q * math.log2(q) for q in (p, 1.0 - p) if q > 0.0)


def test_where_the_asset_decides_it_tells_nearly_all():
    row = confounding(*drawn(np.random.default_rng(0), lambda asset: asset % 2))
    assert row.information_share > 0.95
    assert row.guess_accuracy == 1.0


def test_where_nothing_decides_it_tells_nothing():
    for seed in range(5):
        data = drawn(np.random.default_rng(seed), lambda _: 0.6, count=200)
        row = confounding(*data)
        levels, pushes, won, _ = data
        tried, right = (np.bincount(levels[-1], n, minlength=ASSETS) for n in (pushes, won))
        left = sum(n * entropy(k / n) for n, k in zip(tried, right, strict=True) if n)
        plug_in = 1.0 - left / tried.sum() / entropy(right.sum() / tried.sum())
        assert row.information_share < 0.01
        assert plug_in > 0.1, "shares of the data themselves would tell something"


def test_where_the_type_decides_partly_it_is_what_the_distribution_says():
    chances = (0.2, 0.8)
    row = confounding(*drawn(np.random.default_rng(2), lambda asset: chances[asset // 20]))
    expected = 1.0 - entropy(0.2) / entropy(0.5)
    assert row.information_share == pytest.approx(expected, abs=0.03)
    assert row.guess_accuracy == pytest.approx(0.8, abs=0.02)
    assert row.base_rate == pytest.approx(0.5, abs=0.03)


def slow(looks, obstacles):
    """The same by leaving obstacles out one by one."""
    best = (math.inf, 0.0)
    total = sum(n for _, n, _ in obstacles)
    base = sum(k for *_, k in obstacles) / total
    for weights in product(PSEUDO_COUNTS, repeat=3):
        bits, right = 0.0, 0
        for place, (own, n, k) in enumerate(obstacles):
            others = [o for other, o in enumerate(obstacles) if other != place]
            p = (sum(o[2] for o in others) + 0.5) / (sum(o[1] for o in others) + 1.0)
            for weight, alike in zip(weights, same_groups(looks, own), strict=True):
                group = [o for o in others if o[0] in alike]
                p = (sum(o[2] for o in group) + weight * p) / (sum(o[1] for o in group) + weight)
            bits -= k * math.log2(p) + (n - k) * math.log2(1.0 - p)
            right += k if p >= 0.5 else n - k
        best = min(best, (bits / total, right / total))
    return base, best[1], max(0.0, 1.0 - best[0] / entropy(base))


def same_groups(looks, own):
    """Assets of one's type, those of one's quarter of its volumes, and one's own."""
    kind = looks[own].type
    members = sorted((k for k, a in looks.items() if a.type == kind), key=lambda k: looks[k].size)
    quarter = 4 * members.index(own) // len(members)
    alike = [m for k, m in enumerate(members) if 4 * k // len(members) == quarter]
    return members, alike, [own]


def test_the_estimate_is_that_of_leaving_out_one_by_one():
    rng = np.random.default_rng(3)
    looks = {
        f"{kind}_{k}": AssetLook(f"{kind}_{k}", kind, (1.0 + k, 1.0, 1.0), True, False, True)
        for kind in ("Chair", "Desk")
        for k in range(6)
    }
    names = rng.choice(list(looks), 25).tolist()
    obstacles = [(name, 4, int(rng.binomial(4, 0.3 + 0.4 * (name < "D")))) for name in names]
    counts = PushCounts()
    counts.cells.update(obstacles)
    row = counts.row(looks.values())
    base, accuracy, told = slow(looks, obstacles)
    assert row.pushes == 100
    assert row.base_rate == pytest.approx(base, abs=1e-6)
    assert row.guess_accuracy == pytest.approx(accuracy, abs=1e-6)
    assert row.information_share == pytest.approx(told, abs=1e-6)


def test_statistics_count_the_pushes_of_types_that_are_pushed(dataset_folder):
    episodes = load_dataset(dataset_folder)
    pushed = {t for t, a in type_affordances(episodes.assets.values()).items() if a == "push"}
    tries = [
        outcome.success
        for episode in episodes
        for obstacle in episode.obstacles
        if obstacle.type in pushed
        for outcome in obstacle.outcomes or ()
        if outcome.action.startswith("push")
    ]
    told = compute_stats(dataset_folder)["confounding"]
    assert told["pushes"] == len(tries) > 0
    assert told["base_rate"] == pytest.approx(sum(tries) / len(tries), abs=1e-6)


def test_without_pushes_there_are_no_figures():
    assert PushCounts().row([]) is None
