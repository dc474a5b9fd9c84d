from __future__ import annotations

import json
import math
import re

import pytest

from internav_data.evaluation.metrics import MEASURES
from internav_data.evaluation.statements import as_json as said_json
from internav_data.evaluation.statements import differences, fairness, sentences
from internav_data.evaluation.tables import (
    NOT_COMPARABLE,
    NOTHING,
    PAPER_3,
    PAPER_4,
    PAPER_5,
    as_json,
    markdown,
    table_3,
    table_4,
    table_5,
    variant_of,
    written,
)


@pytest.fixture(scope="module")
def runs(row, evaluation):
    def run(name, seed, share, **changes):
        rows = [
            row(
                k,
                scene=s,
                success=(5 * s + k) % 10 < round(10 * share),
                pushes_tried=2,
                pushes_done=1,
            )
            for s in range(6)
            for k in range(5)
        ]
        rows += [row(9, scene=9, mode="lengthened", success=share > 0.5)]
        return evaluation(rows, name, training_seed=seed, **changes)

    return run


def cells(table, name):
    (found,) = [row for row in table.rows if row.name == name]
    return [cell.text for cell in found.cells]


def test_columns_are_those_of_the_paper(runs):
    table = table_3({"camp": [runs("camp", 0, 0.5)]})
    assert [name for name, _ in table.groups] == [
        "all", "N >= 4 rooms", "non-interactive", "blocked",
    ]  # fmt: skip
    assert [count for _, count in table.groups] == [31, 0, 1, 30]
    assert [MEASURES[name].title for name in table.columns] == ["SR", "FDT", "SPL", "STS"]
    five = table_5({"camp": [runs("camp", 0, 0.5)]})
    assert [MEASURES[name].title for name in five.columns[:4]] == ["IR", "ISR", "PuSR", "PiSR"]
    assert table.headings()[0] == "all (n = 31) SR(%) ↑"
    assert table.headings()[1] == "FDT(m) ↓"


def test_figures_stand_in_their_columns(runs):
    methods = {"camp": [runs("camp", 0, 0.5)]}
    assert cells(table_3(methods), "camp") == [
        "48.4", "0.00", "0.800", "0.500", *[NOTHING] * 4, "0.0", "0.00", "0.800", "0.500",
        "50.0", "0.00", "0.800", "0.500",
    ]  # fmt: skip
    assert cells(table_5(methods), "camp") == [
        "0.000", "50.0", "50.0", NOTHING, "0.000", "1.935",
    ]  # fmt: skip
    assert cells(table_5(methods), "CaMP, the paper's")[3:] == ["29.8", NOTHING, NOTHING]


def test_nothing_is_said_as_such(runs):
    text = markdown(table_3({"camp": [runs("camp", 0, 0.5)]}))
    assert "No episode is N >= 4 rooms: n = 0." in text
    assert "N >= 4 rooms (n = 0)" in text
    assert "nan" not in text.lower()
    assert "One training seed" in text


def test_seeds_give_intervals(runs):
    seeds = [runs("camp", k, 0.4 + 0.1 * k) for k in range(3)]
    (text, *_) = cells(table_3({"camp": seeds}), "camp")
    # 12/31, 15/31 and (18 + 1)/31: t with two degrees of freedom is 4.303.
    values = [12 / 31, 15 / 31, 19 / 31]
    mean = sum(values) / 3
    half = 4.302653 * math.sqrt(sum((v - mean) ** 2 for v in values) / 2 / 3)
    assert text == f"{100 * mean:.1f} ± {100 * half:.1f}"


def test_the_papers_figures_are_whole_and_marked(runs):
    methods = {"ppo-intent": [runs("ppo-intent", 0, 0.5, method="ppo-intent", sync_every=1)]}
    for table, paper, size in (
        (table_3(methods), PAPER_3, 12),
        (table_4(methods), PAPER_4, 12),
        (table_5(methods), PAPER_5, 4),
    ):
        assert NOT_COMPARABLE in table.notes
        assert NOT_COMPARABLE in markdown(table)
        rows = [row for row in table.rows if row.source == "paper"]
        assert [row.name for row in rows] == [f"{name}, the paper's" for name in paper]
        assert all(len(values) == size for values in paper.values())
        assert not any(row["comparable"] for row in as_json(table)["rows"][-len(paper) :])
    assert cells(table_3(methods), "CaMP, the paper's")[:5] == [
        "56.3", "3.67", "0.327", "0.177", "41.4",
    ]  # fmt: skip
    # Gains that the paper's text states (section 5.4), from its tables.
    gains = [PAPER_3["CaMP"][k] - PAPER_3["PPO"][k] for k in (0, 2, 3)]
    assert gains == pytest.approx([13.6, 0.075, 0.043])
    assert [PAPER_3["CaMP"][k] - PAPER_3["PPO"][k] for k in (4, 6)] == pytest.approx([18.1, 0.092])
    assert PAPER_4["integrated intent"] == PAPER_3["CaMP"]
    less = [PAPER_4["integrated intent"][k] - PAPER_4["wo/intent"][k] for k in (0, 2, 4, 6)]
    assert less == pytest.approx([5.5, 0.033, 10.4, 0.080])


def test_ablations_are_named_as_in_the_paper(runs):
    def about(method, **changes):
        return runs("x", 0, 0.5, method=method, **changes).about

    camp = {k: about("camp", intent=k) for k in ("integrated", "policy", "recursive", "none")}
    named = [variant_of(each) for each in camp.values()]
    assert named == ["integrated intent", "policy intent", "recursive intent", "wo/intent"]
    assert variant_of(about("camp", intent="integrated", without_intent=True)) == "test wo/intent"
    assert variant_of(about("ppo-intent", sync_every=5)) == "sync. /5*rollout"
    assert set(named) <= set(PAPER_4)
    assert variant_of(about("ppo")) == ""
    assert table_4({"ppo": [runs("ppo", 0, 0.5, method="ppo")]}) is None


def test_as_json_is_shares_and_nulls(runs):
    methods = {"camp": [runs("camp", k, 0.4 + 0.1 * k) for k in range(2)]}
    text = json.dumps([as_json(table_3(methods)), said_json(methods)], allow_nan=False)
    (first, *_) = json.loads(text)[0]["rows"]
    figures = {(f["group"], f["measure"]): f for f in first["figures"]}
    assert figures["all", "success"]["value"] == pytest.approx((12 + 15) / 62)
    assert figures["all", "success"]["seeds"] == 2
    assert figures["N >= 4 rooms", "spl"]["value"] is None


def test_numbers_are_written_in_their_units():
    assert written("success", 0.5) == "50.0"
    assert written("distance_m", 1.234) == "1.23"
    assert written("ir_m", 0.4021, 0.1) == "0.402 ± 0.100"
    assert written("spl", None) == NOTHING


def test_methods_are_compared_over_seeds(runs):
    methods = {
        "camp": [runs("camp", k, 0.6 + 0.1 * (k % 2)) for k in range(5)],
        "ppo": [runs("ppo", k, 0.2 + 0.1 * (k % 2)) for k in range(5)],
        "expert": [runs("expert", None, 1.0, is_reference=True)],
    }
    (found,) = differences(methods, "blocked", "success")
    assert (found.first, found.second, found.unit) == ("camp", "ppo", "seeds")
    assert found.interval.mean == pytest.approx(0.4)
    assert found.interval.excludes_zero
    said = "\n".join(sentences(methods))
    assert "Primary outcome, fixed beforehand: SR on blocked episodes" in said
    assert re.search(r"camp minus ppo 40\.0 % \[.*\] over 5 seeds\.", said)
    assert "5 seeds at a deviation of 5.5 between seeds" in said
    assert "found four times in five" in said
    assert "bootstrap over scenes: these" not in said, "never between methods with seeds"


def test_two_checkpoints_are_compared_over_scenes_and_labelled(runs):
    methods = {"camp": [runs("camp", 0, 0.7)], "ppo": [runs("ppo", 0, 0.3)]}
    (found,) = differences(methods, "blocked", "success")
    assert found.unit == "scenes"
    said = "\n".join(sentences(methods))
    assert "these two checkpoints alone" in said
    assert "about this one run, not about its method" in said
    assert "no difference between methods can be told from chance" in said
    three = {**methods, "hrl": [runs("hrl", 0, 0.3)]}
    assert differences(three, "blocked", "success") == [], "seeds are the unit"


def test_small_differences_are_not_resolved(runs):
    methods = {
        name: [runs(name, k, 0.3 + 0.1 * ((k + j) % 4)) for k in range(3)]
        for j, name in enumerate(("camp", "ppo"))
    }
    said = "\n".join(sentences(methods))
    assert re.search(r"camp minus ppo .* not resolved", said)


def test_what_is_all_alike_says_what_may_have_been_missed(runs, evaluation, row):
    every = evaluation([row(0, scene=s) for s in range(20)])
    said = "\n".join(sentences({"camp": [every]}))
    assert f"as frequent as in {100 * (1 - 0.05 ** (1 / 20)):.1f} % of scenes" in said


def test_costs_stand_beside(runs):
    given = {"environment_steps": 300_000, "cloned_frames": 150_000, "parameters": 1234}
    methods = {
        "camp": [runs("camp", k, 0.5, training_s=60.0 * (k + 1), **given) for k in range(3)],
        "ppo": [runs("ppo", 0, 0.5)],
        "expert": [runs("expert", None, 1.0, is_reference=True)],
    }
    _, rows = fairness(methods)
    assert rows == [
        ["camp", "3", "300,000", "150,000", "1,234", "2 min"],
        ["ppo", "1", *[NOTHING] * 4],
    ]
