"""Reports of evaluations: Markdown, JSON and one HTML page with training curves.

Curves come from a run's log, one JSON object of numbers a line; other lines are ignored.
"""

from __future__ import annotations

import json
import math
from io import TextIOWrapper
from typing import TYPE_CHECKING, Any, Final

from internav_data.core.files import open_regular
from internav_data.core.markdown import escaped, table_row
from internav_data.core.storage import write_atomically
from internav_data.evaluation.metrics import GROUPS, MEASURES
from internav_data.evaluation.statements import as_json as differences_json
from internav_data.evaluation.statements import fairness, sentences
from internav_data.evaluation.statistics import by_method, check_comparable
from internav_data.evaluation.tables import (
    as_json,
    cell,
    heading,
    markdown,
    table_3,
    table_4,
    table_5,
)
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from internav_data.dataset import Dataset
    from internav_data.evaluation.archive import Evaluation
    from internav_data.evaluation.metrics import EpisodeResult
    from internav_data.evaluation.statements import Methods
    from internav_data.evaluation.tables import Table
    from internav_data.records import Episode
    from internav_data.views.page import Page


MAX_BYTES: Final = 256_000_000
"""Size of a log above which it is not read."""
STEPS: Final = ("step", "steps", "environment_steps")
"""Names of the horizontal axis; the first one that a row has is used."""
FIRST: Final = ("success", "validation", "return", "reward", "spl", "sts")
"""Words in the names of the curves that are shown first."""
MAX_CURVES: Final = 24
"""Maximum number of curves."""

Series = dict[str, list[tuple[float, float]]]
"""Points (step, value) of each number of a log."""


def find_log(run: Path) -> Path | None:
    """Return a run's log, a .jsonl file in its folder; None without one."""
    found = sorted(path for path in run.glob("*.jsonl") if path.is_file())
    return found[0] if found else None


def read_log(path: Path) -> Series:
    """Return the points of each number of a log; lines that are no rows are ignored."""
    series: Series = {}
    if path.stat().st_size > MAX_BYTES:
        return series
    with TextIOWrapper(open_regular(path), encoding="utf-8-sig", errors="replace") as lines:
        for line in lines:
            row = _row(line)
            step = next((row[name] for name in STEPS if name in row), None)
            if step is None:
                continue
            for name, value in row.items():
                if name not in STEPS:
                    series.setdefault(name, []).append((step, value))
    return series


def shown_first(names: Sequence[str]) -> list[str]:
    """Return the names of the curves to show, those with a word of `FIRST` at the front."""

    def rank(name: str) -> tuple[int, str]:
        places = [k for k, word in enumerate(FIRST) if word in name.lower()]
        return (places[0] if places else len(FIRST)), name

    return sorted(names, key=rank)[:MAX_CURVES]


def _row(line: str) -> Mapping[str, float]:
    try:
        values: Any = json.loads(line)
    except (ValueError, RecursionError):
        return {}
    return _numbers(values) if isinstance(values, dict) else {}


def _numbers(values: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    found: dict[str, float] = {}
    for name, value in values.items():
        if isinstance(value, dict) and not prefix:
            found |= _numbers(value, f"{name}/")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            try:
                number = float(value)
            except OverflowError:
                continue
            if math.isfinite(number):
                found[f"{prefix}{name}"] = number
    return found


PICTURES_EACH: Final = 2
"""Number of pictures of the best, the median and the worst episodes each."""
_PIXELS: Final = 560


def methods_of(evaluations: Sequence[Evaluation]) -> Methods:
    """Return comparable evaluations by row; a reference policy counts once.

    Raises
    ------
    UsageError
        The evaluations are not of the same episodes, or one is there twice.
    """
    kept: list[Evaluation] = []
    references: set[str] = set()
    for each in evaluations:
        if each.about.is_reference:
            if each.about.name in references:
                continue
            references.add(each.about.name)
        kept.append(each)
    check_comparable(kept)
    return by_method(kept)


def tables_of(methods: Methods) -> list[Table]:
    """Return the paper's tables that have a row of these methods."""
    ablations = table_4(methods)
    return [table_3(methods), *([ablations] if ablations else []), table_5(methods)]


def text_of(methods: Methods) -> str:
    """Return tables and statements as Markdown."""
    about = next(iter(methods.values()))[0].about
    sampled = "likeliest actions" if about.greedy else "sampled actions"
    head = (
        f"Split {about.split}, dataset {about.dataset}, at most {about.max_steps} steps, "
        f"evaluation seed {about.seed}, {sampled}.\n"
    )
    parts = [head, *(markdown(table) for table in tables_of(methods))]
    headings, rows = fairness(methods)
    if rows:
        lines = [headings, ["---"] * len(headings), *rows]
        parts += ["### What each was given\n"]
        parts += ["\n".join(map(table_row, lines)) + "\n"]
    statements = "\n".join(f"- {escaped(line)}" for line in sentences(methods))
    return "\n".join([*parts, "### What this can tell\n", statements, ""])


def data_of(methods: Methods) -> dict[str, Any]:
    """Return tables, figures, differences and statements as plain data."""
    return {
        "format": 2,
        "tables": [as_json(table) for table in tables_of(methods)],
        "figures": {name: _all_figures(found) for name, found in methods.items()},
        "differences": differences_json(methods),
        "sentences": sentences(methods),
    }


def _all_figures(found: Sequence[Evaluation]) -> dict[str, Any]:
    """Return every figure of every group: value, half of its interval, number of seeds."""
    figures: dict[str, Any] = {}
    for group in GROUPS:
        cells = {name: cell(found, group, name) for name in MEASURES}
        figures[group] = {
            name: {"value": each.value, "half": each.half, "seeds": each.seeds}
            for name, each in cells.items()
        }
    return figures


def write_texts(folder: Path, methods: Methods) -> None:
    """Write `tables.md` and `tables.json`."""
    write_atomically(folder / "tables.md", text_of(methods).encode())
    text = json.dumps(data_of(methods), indent=2, ensure_ascii=False, allow_nan=False)
    write_atomically(folder / "tables.json", (text + "\n").encode())


def write_page(
    path: Path,
    methods: Methods,
    dataset: Dataset[Episode] | None = None,
    logs: Mapping[str, Series] | None = None,
) -> None:
    """Write the HTML report.

    Parameters
    ----------
    path
        File to write.
    methods
        Evaluations by row.
    dataset
        Dataset of the episodes; the best, median and worst ones are drawn, none without it.
    logs
        Logs by name of a run, for training curves.
    """
    from internav_data.views.page import Page  # noqa: PLC0415 - OpenCV

    about = next(iter(methods.values()))[0].about
    page = Page("camp-eval: " + ", ".join(methods))
    page.words(
        f"Split {about.split}, dataset {about.dataset}; at most {about.max_steps} steps; "
        f"evaluation seed {about.seed}; {'likeliest' if about.greedy else 'sampled'} actions."
    )
    for table in tables_of(methods):
        _add_table(page, table)
    headings, given = fairness(methods)
    if given:
        page.heading("What each was given")
        page.table((), headings, [("", row) for row in given])
    page.heading("What this can tell")
    for line in sentences(methods):
        page.words(line)
    if logs:
        _add_curves(page, logs)
    if dataset is not None:
        for name, found in methods.items():
            page.heading(f"Best, median and worst episodes of {name}")
            page.pictures(_pictures(found[0].results, dataset))
    page.write(path)


def picked(
    results: Sequence[EpisodeResult], each: int = PICTURES_EACH
) -> list[tuple[str, EpisodeResult]]:
    """Return the best, the median and the worst episodes: by success, SPL, then distance."""
    order = sorted(results, key=lambda r: (-r.success, -r.spl, r.distance_m, r.episode_id))
    count = len(order)
    middle = max(0, (count - each) // 2)
    places = [("best", range(each)), ("median", range(middle, middle + each))]
    places += [("worst", range(count - each, count))]
    found: dict[int, str] = {}
    for word, numbers in places:
        for k in numbers:
            if 0 <= k < count:
                found.setdefault(k, word)
    return [(found[k], order[k]) for k in sorted(found)]


def episodes_by_id(dataset: Dataset[Episode], wanted: Sequence[str]) -> dict[str, Episode]:
    """Return episodes of a dataset by id."""
    ids: list[str] = dataset.to_table(["episode_id"]).column("episode_id").to_pylist()
    numbers = [k for k, name in enumerate(ids) if name in set(wanted)]
    return {episode.episode_id: episode for episode in dataset.__getitems__(numbers)}


def _add_table(page: Page, table: Table) -> None:
    page.heading(table.title)
    spans = [(f"{name} (n = {count})", len(table.columns)) for name, count in table.groups]
    headings = ["", *(heading(name) for _ in table.groups for name in table.columns)]
    rows = [(row.source, [row.name, *(each.text for each in row.cells)]) for row in table.rows]
    page.table(spans, headings, rows)
    for note in table.notes:
        page.words(note, note=True)


def _add_curves(page: Page, logs: Mapping[str, Series]) -> None:
    from internav_data.views.curves import Curve, curves_svg  # noqa: PLC0415

    page.heading("Training")
    names = {name for series in logs.values() for name in series}
    pictures = []
    for name in shown_first(sorted(names)):
        found = [Curve(run, tuple(series[name])) for run, series in logs.items() if name in series]
        pictures.append(curves_svg(name, "environment steps", found))
    page.curves(pictures)


def _pictures(results: Sequence[EpisodeResult], dataset: Dataset[Episode]) -> list[Any]:
    from internav_data.views.trajectory import draw_trajectory  # noqa: PLC0415

    chosen = picked(results)
    episodes = episodes_by_id(dataset, [result.episode_id for _, result in chosen])
    pictures = []
    for word, result in chosen:
        episode = episodes[result.episode_id]
        image = draw_trajectory(
            dataset.scene(episode.scene_id), episode, dataset.assets, result.actions,
            pixels=_PIXELS, config=WorldConfig.of_dataset(dataset.manifest.config),
        )  # fmt: skip
        end = "success" if result.success else f"failed, {result.distance_m:.2f} m away"
        pictures.append(
            (
                image,
                (
                    f"{word}: {result.episode_id}, {result.mode}: {end}, {result.steps} steps, "
                    f"SPL {result.spl:.2f}, STS {result.sts:.2f}"
                ),
            )
        )
    return pictures
