from __future__ import annotations

import dataclasses
import json
import re

import pytest

from internav_data.core.markdown import escaped
from internav_data.evaluation.archive import About, Evaluation
from internav_data.evaluation.evaluator import EvaluationConfig, evaluate
from internav_data.evaluation.reference_policies import reference_policy
from internav_data.evaluation.report import (
    data_of,
    find_log,
    methods_of,
    picked,
    read_log,
    shown_first,
    tables_of,
    text_of,
    write_page,
    write_texts,
)
from internav_data.evaluation.videos import videos
from internav_data.records.errors import UsageError


@pytest.fixture(scope="module")
def settings():
    return EvaluationConfig(max_steps=25, limit=6)


@pytest.fixture(scope="module")
def played(played_data, settings):
    found = []
    for name in ("expert", "random"):
        results = evaluate(reference_policy(name, played_data), played_data, settings)
        about = About(
            name, name, played_data.fingerprint, "all", 0, 25, is_reference=name == "expert"
        )
        found.append(Evaluation(about, tuple(results)))
    return found


def test_reference_policies_count_once(played, row, evaluation):
    methods = methods_of([played[0], played[1], played[0]])
    assert list(methods) == ["expert", "random"]
    assert [len(found) for found in methods.values()] == [1, 1]
    with pytest.raises(UsageError, match="twice"):
        methods_of([played[1], played[1]])


def test_texts_say_the_same_as_data(played, tmp_path):
    methods = methods_of(played)
    write_texts(tmp_path, methods)
    text = (tmp_path / "tables.md").read_text()
    assert text == text_of(methods)
    said = json.loads((tmp_path / "tables.json").read_text())
    assert said == json.loads(json.dumps(data_of(methods)))
    for line in said["sentences"]:
        assert escaped(line) in text
    assert [t["title"] for t in said["tables"]] == [t.title for t in tables_of(methods)]
    assert text.count("not comparable") == 2
    assert "What each was given" in text


def test_the_page_needs_nothing_from_elsewhere(played, played_data, tmp_path):
    named = {"<b>&me": [played[1]]}
    logs = {"run <1>": {"success": [(0.0, 0.1), (64.0, 0.4)], "kl": [(0.0, 0.0)]}}
    write_page(tmp_path / "report.html", named, played_data, logs)
    page = (tmp_path / "report.html").read_text()
    assert page.startswith("<!doctype html>")
    assert "<script" not in page
    assert "&lt;b&gt;&amp;me" in page
    assert "<b>&me" not in page
    sources = re.findall(r'(?:src|href)="([^"]{0,30})', page)
    assert sources
    assert all(source.startswith("data:image/png;base64,") for source in sources)
    assert not re.search(r"https?://|url\(|@import", page)
    assert page.count("<svg") == 2
    assert page.count("<figure>") == 6, "two of the best, the median and the worst"
    for word in ("best", "median", "worst"):
        assert page.count(f"<figcaption>{word}: ") == 2
    again = tmp_path / "again.html"
    write_page(again, named, played_data, logs)
    assert again.read_text() == page


def test_a_page_without_dataset_or_log_is_a_page(played, tmp_path):
    write_page(tmp_path / "report.html", methods_of(played))
    page = (tmp_path / "report.html").read_text()
    assert "<svg" not in page
    assert "<figure" not in page
    assert page.count("<table>") == 3


def test_best_median_and_worst(row):
    many = [row(k, success=k < 6, spl=k / 10 if k < 6 else 0.0, distance_m=k) for k in range(10)]
    found = [(word, int(r.episode_id[-4:])) for word, r in picked(many)]
    assert found == [
        ("best", 5), ("best", 4), ("median", 1), ("median", 0), ("worst", 8), ("worst", 9),
    ]  # fmt: skip
    assert [word for word, _ in picked(many[:1])] == ["best"]
    assert len(picked(many[:3])) == 3, "none twice"


def test_logs_are_read_forgivingly(tmp_path):
    assert find_log(tmp_path) is None
    path = tmp_path / "log.jsonl"
    path.write_text(
        '{"step": 64, "success": 0.25, "option": {"push": 0.5, "deep": {"no": 1}}, "word": "x"}\n'
        "not json\n[1, 2]\n\n"
        '{"success": 1.0}\n'
        '{"step": 128, "success": NaN, "flag": true, "kl": 1e999, "big": 1' + "0" * 400 + "}\n"
        '{"step": 192, "success": 0.5}\n' + "[" * 100_000 + "\n"
    )
    assert find_log(tmp_path) == path
    series = read_log(path)
    assert series["success"] == [(64.0, 0.25), (192.0, 0.5)]
    assert series["option/push"] == [(64.0, 0.5)]
    assert set(series) == {"success", "option/push"}
    assert shown_first(["kl", "z/success", "a"])[0] == "z/success"


def test_videos_show_the_episodes_that_were_played(played_data, played, settings, tmp_path):
    class Telling:
        name, image_size, sensors = "telling", 1, ()

        def __init__(self):
            self._inner = reference_policy("random", played_data)
            self.begin, self.start, self.act = (
                self._inner.begin, self._inner.start, self._inner.act,
            )  # fmt: skip

        def notes(self, slot):
            return [("option", ("a", "b"), (0.25, 0.75), slot)]

    short = dataclasses.replace(settings, max_steps=25)
    files = list(videos(tmp_path, Telling(), played[1].results[:3], played_data, short))
    assert [path.name.split("-")[0] for path in files] == ["best", "median", "worst"]
    assert all(path.read_bytes().startswith(b"GIF89a") for path in files)
