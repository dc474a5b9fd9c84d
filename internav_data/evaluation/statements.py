"""Statements beside the tables: intervals, differences, and the resolution of the evaluation."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

from internav_data.evaluation.metrics import GROUPS, MEASURES
from internav_data.evaluation.statistics import (
    Interval,
    deviation,
    figures,
    pooled_deviation,
    resolution,
    scene_interval,
    seed_difference,
)
from internav_data.evaluation.tables import NOTHING, written

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.evaluation.archive import Evaluation

    Methods = Mapping[str, Sequence[Evaluation]]

PRIMARY: Final = ("blocked", "success")
"""Group and measure of the primary outcome, fixed beforehand."""
SECONDARY: Final = (
    ("all", "success"),
    ("all", "spl"),
    ("all", "sts"),
    ("all", "ir_m"),
    ("all", "isr"),
)
"""Groups and measures of the secondary outcomes."""
_TWO: Final = 2


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference between two rows of a table."""

    first: str
    """Name of the first row."""
    second: str
    """Name of the second row."""
    group: str
    """One of `GROUPS`."""
    measure: str
    """One of `MEASURES`."""
    unit: str
    """Unit of the interval: seeds, or scenes (then of two checkpoints, not of methods)."""
    interval: Interval
    """Mean and bounds of first minus second."""


def differences(methods: Methods, group: str, measure: str) -> list[Difference]:
    """Return the difference of each pair of trained methods.

    The interval is over seeds where both have at least two. It is over scenes where there are just
    two runs, one each; then it concerns these checkpoints alone.
    """
    trained = {name: found for name, found in methods.items() if not found[0].about.is_reference}
    found_differences = []
    for first, second in combinations(trained, 2):
        values = [figures(trained[name], group, measure) for name in (first, second)]
        if min(map(len, values)) >= _TWO:
            over, unit = seed_difference(*values), "seeds"
        else:
            two = [trained[name] for name in (first, second)]
            if len(trained) != _TWO or any(len(found) != 1 for found in two):
                continue
            chosen = [[r for r in f[0].results if GROUPS[group](r)] for f in two]
            found = scene_interval(chosen[0], measure, chosen[1])
            if found is None:
                continue
            over, unit = found, "scenes"
        found_differences.append(Difference(first, second, group, measure, unit, over))
    return found_differences


def sentences(methods: Methods) -> list[str]:
    """Return the statements about the figures of methods, primary outcome first."""
    lines = [f"Primary outcome, fixed beforehand: {_name(*PRIMARY)}."]
    lines += _one_run(methods)
    pairs = differences(methods, *PRIMARY)
    lines += [_sentence(each) for each in pairs]
    if len(pairs) > 1:
        lines.append(
            f"{len(pairs)} pairs are compared, each at 95 %: one in twenty differs by chance alone."
        )
    for group, measure in SECONDARY:
        lines += [_sentence(each) for each in differences(methods, group, measure)]
    return [*lines, *_resolved(methods)]


def fairness(methods: Methods) -> tuple[list[str], list[list[str]]]:
    """Return headings and rows of the steps, frames and time that each trained method had."""
    headings = ["", "seeds", "environment steps", "expert frames", "parameters", "training"]
    rows = []
    for name, found in methods.items():
        if found[0].about.is_reference:
            continue
        about = found[0].about
        times = [e.about.training_s for e in found if e.about.training_s is not None]
        minutes = f"{sum(times) / len(times) / 60.0:.0f} min" if times else NOTHING
        counts = (about.environment_steps, about.cloned_frames, about.parameters)
        cells = [NOTHING if count is None else f"{count:,}" for count in counts]
        rows.append([name, str(len(found)), *cells, minutes])
    return headings, rows


def as_json(methods: Methods) -> list[dict[str, Any]]:
    """Return every difference as plain data."""
    return [
        {
            "first": each.first, "second": each.second, "group": each.group,
            "measure": each.measure, "difference": each.interval.mean, "unit": each.unit,
            "low": each.interval.low, "high": each.interval.high, "count": each.interval.count,
        }
        for place in (PRIMARY, *SECONDARY)
        for each in differences(methods, *place)
    ]  # fmt: skip


def _one_run(methods: Methods) -> list[str]:
    """Return statements on the uncertainty of rows with a single run."""
    trained = {name: found for name, found in methods.items() if not found[0].about.is_reference}
    lines = []
    for name, found in (trained or methods).items():
        if len(found) > 1:
            continue
        for group, measure in (PRIMARY, SECONDARY[0]):
            chosen = [r for r in found[0].results if GROUPS[group](r)]
            over = scene_interval(chosen, measure)
            count = f"{len(chosen)} episodes"
            if over is None:
                lines.append(f"{name}: {_name(group, measure)}: {count}: no interval.")
                continue
            count += f" in {over.count} scenes"
            value = f"{name}: {_name(group, measure)} {_bounds(measure, over)} over {count}"
            if over.low == over.high:
                # A bootstrap of equal scenes has no width: how rare may the other outcome be?
                unseen = written(measure, 1.0 - 0.05 ** (1.0 / over.count))
                lines.append(
                    f"{value}, all alike; another outcome may be as frequent as in {unseen} % of "
                    "scenes without having shown here (at 95 %)."
                )
                continue
            lines.append(
                f"{value} (bootstrap over scenes: about this one run, not about its method)."
            )
    return lines


def _sentence(each: Difference) -> str:
    whose = "" if each.unit == "seeds" else " (bootstrap over scenes: these two checkpoints alone)"
    word = "" if each.interval.excludes_zero else ", not resolved"
    return (
        f"{_name(each.group, each.measure)}: {each.first} minus {each.second} "
        f"{_bounds(each.measure, each.interval)} over {each.interval.count} {each.unit}"
        f"{whose}{word}."
    )


def _resolved(methods: Methods) -> list[str]:
    """Return statements on the differences that the seeds and episodes could show."""
    group, measure = PRIMARY
    trained = [f for f in methods.values() if not f[0].about.is_reference]
    values = [figures(found, group, measure) for found in trained]
    values = [each for each in values if each]
    if not values:
        return []
    spread, seeds = pooled_deviation(values), min(map(len, values))
    known = None if spread is None else resolution(seeds, spread)
    if spread is None or known is None:
        return ["One seed a method: no difference between methods can be told from chance."]
    line = (
        f"{seeds} seeds at a deviation of {written(measure, spread)} between seeds: differences "
        f"in {_name(group, measure)} below {written(measure, known.half)} points look like none, "
        f"one of {written(measure, known.found)} is found four times in five."
    )
    own = _episode_error(trained[0][0], group, measure)
    if own is None:
        return [line]
    return [
        line,
        (
            f"The test scenes themselves are a sample: another {evaluation_size(trained[0][0])} "
            f"would move each row by about {written(measure, own)}, all rows much alike."
        ),
    ]


def evaluation_size(evaluation: Evaluation) -> str:
    """Return the numbers of scenes and episodes of an evaluation, in words."""
    scenes = len({result.scene_id for result in evaluation.results})
    return f"{scenes} scenes with {len(evaluation.results)} episodes"


def _episode_error(evaluation: Evaluation, group: str, measure: str) -> float | None:
    """Return the deviation of a mean over scenes: each scene's figure against the others'."""
    chosen = [r for r in evaluation.results if GROUPS[group](r)]
    scenes = sorted({r.scene_id for r in chosen})
    found = [
        mean
        for scene in scenes
        for mean in [MEASURES[measure].of(r for r in chosen if r.scene_id == scene)]
        if mean is not None
    ]
    return deviation(found) / len(found) ** 0.5 if len(found) >= _TWO else None


def _name(group: str, measure: str) -> str:
    return f"{MEASURES[measure].title} on {group} episodes"


def _bounds(measure: str, over: Interval) -> str:
    unit = " %" if MEASURES[measure].unit == "%" else ""
    low, high = written(measure, over.low), written(measure, over.high)
    return f"{written(measure, over.mean)}{unit} [{low}, {high}]"
