"""Intervals of figures over seeds and scenes, and the differences that they can resolve.

Between methods, training seeds are the unit: intervals by Student's t on the seeds' means. A
bootstrap over scenes alone ignores the spread between seeds and finds false winners in a third to a
half of null comparisons; it is used for fixed checkpoints only.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from internav_data.evaluation.metrics import GROUPS, MEASURES
from internav_data.records import EvaluationStream, Purpose, generator
from internav_data.records.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.core.typing import Floats
    from internav_data.evaluation.archive import Evaluation
    from internav_data.evaluation.metrics import EpisodeResult

CONFIDENCE: Final = 0.95
"""Coverage of intervals."""
POWER: Final = 0.8
"""Probability to find a true difference of the size `Resolution.found`."""
DRAWS: Final = 4000
"""Number of bootstrap resamples."""
_TWO: Final = 2


@dataclass(frozen=True, slots=True)
class Interval:
    """Mean with a confidence interval; bounds are None where a single value has no spread."""

    mean: float
    """Mean."""
    low: float | None
    """Lower bound."""
    high: float | None
    """Upper bound."""
    count: int
    """Number of seeds, or of scenes."""

    @property
    def half(self) -> float | None:
        """Half of the width; None without bounds."""
        return None if self.low is None or self.high is None else (self.high - self.low) / 2.0

    @property
    def excludes_zero(self) -> bool:
        """Whether both bounds lie on the same side of 0."""
        return self.low is not None and self.high is not None and self.low * self.high > 0.0


def deviation(values: Sequence[float]) -> float:
    """Return the standard deviation of a sample of two or more."""
    mean = math.fsum(values) / len(values)
    return math.sqrt(math.fsum((v - mean) ** 2 for v in values) / (len(values) - 1))


def seed_interval(values: Sequence[float]) -> Interval:
    """Return the 95 % t interval of a mean over seeds."""
    count, mean = len(values), math.fsum(values) / len(values)
    if count < _TWO:
        return Interval(mean, None, None, count)
    error = deviation(values) / math.sqrt(count)
    if error == 0.0:
        return Interval(mean, mean, mean, count)
    from scipy import stats  # noqa: PLC0415 - a second; figures without intervals need none

    low, high = stats.t.interval(CONFIDENCE, count - 1, loc=mean, scale=error)
    return Interval(mean, float(low), float(high), count)


def seed_difference(first: Sequence[float], second: Sequence[float]) -> Interval:
    """Return the 95 % interval of mean(first) - mean(second), by Welch's t over seeds.

    Seeds of two methods are not paired: the same number draws other networks.
    """
    mean = math.fsum(first) / len(first) - math.fsum(second) / len(second)
    count = min(len(first), len(second))
    if count < _TWO:
        return Interval(mean, None, None, count)
    if deviation(first) == deviation(second) == 0.0:
        return Interval(mean, mean, mean, count)
    from scipy import stats  # noqa: PLC0415 - as above

    with warnings.catch_warnings():
        # Seeds of equal figures, as 0 successes each, are no loss of precision.
        warnings.simplefilter("ignore", RuntimeWarning)
        test = stats.ttest_ind(first, second, equal_var=False)
    bounds = test.confidence_interval(CONFIDENCE)
    return Interval(mean, float(bounds.low), float(bounds.high), count)


@dataclass(frozen=True, slots=True)
class Resolution:
    """Smallest differences that two methods of equally many seeds can show."""

    seeds: int
    """Number of seeds of each method."""
    deviation: float
    """Standard deviation between the seeds of a method."""
    half: float
    """Half of the 95 % interval of a difference: smaller differences look like none."""
    found: float
    """Size of a true difference that is found four times in five."""


def resolution(seeds: int, spread: float) -> Resolution | None:
    """Return the resolution at a deviation between seeds; None with fewer than two seeds."""
    if seeds < _TWO:
        return None
    from scipy import stats  # noqa: PLC0415 - as above

    freedom, error = 2 * (seeds - 1), spread * math.sqrt(2.0 / seeds)
    half = float(stats.t.ppf((1.0 + CONFIDENCE) / 2.0, freedom)) * error
    more = float(stats.t.ppf(POWER, freedom)) * error
    return Resolution(seeds, spread, half, half + more)


def pooled_deviation(groups: Sequence[Sequence[float]]) -> float | None:
    """Return the deviation between seeds, pooled over methods; None where no method has two."""
    freedom = sum(len(values) - 1 for values in groups)
    if freedom < 1:
        return None
    squares = [deviation(v) ** 2 * (len(v) - 1) for v in groups if len(v) >= _TWO]
    return math.sqrt(math.fsum(squares) / freedom)


def scene_interval(
    results: Sequence[EpisodeResult], measure: str, other: Sequence[EpisodeResult] | None = None
) -> Interval | None:
    """Return the 95 % bootstrap interval over scenes, for fixed checkpoints alone.

    Parameters
    ----------
    results
        Results of one checkpoint.
    measure
        One of `MEASURES`.
    other
        Results of a second checkpoint on the same episodes; the interval is then that of the
        difference `results` minus `other`.

    Returns
    -------
    Interval or None
        None where the figure is not defined, or there is a single scene.
    """
    names = sorted({result.scene_id for result in results})
    sums = [_scene_sums(each, measure, names) for each in (results, other) if each is not None]
    if len(names) < _TWO or any(s[1].sum() == 0.0 for s in sums):
        return None
    # Our own bootstrap: `scipy.stats.bootstrap` cannot leave out resamples in which a rate has no
    # denominator (no interaction in any scene drawn), and answers nan.
    rng = generator(0, Purpose.EVALUATION, attempt=EvaluationStream.BOOTSTRAP)
    weights = rng.multinomial(len(names), np.full(len(names), 1.0 / len(names)), DRAWS)
    ones = np.ones((1, len(names)))
    drawn, whole = (_figure(w, sums) for w in (weights.astype(np.float64), ones))
    drawn = drawn[np.isfinite(drawn)]
    if not len(drawn):
        return None
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(drawn, [tail, 1.0 - tail]).tolist()
    return Interval(float(whole[0]), low, high, len(names))


def _figure(weights: Floats, sums: Sequence[tuple[Floats, Floats]]) -> Floats:
    """Return the figure, or difference of two, for rows of weights (draws, scenes): (draws,)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        figures: list[Floats] = [(weights @ above) / (weights @ below) for above, below in sums]
    return figures[0] if len(figures) == 1 else figures[0] - figures[1]


def _scene_sums(
    results: Sequence[EpisodeResult], measure: str, names: Sequence[str]
) -> tuple[Floats, Floats]:
    """Return the numerators and denominators of a measure by scene, (scenes,) each."""
    row = {name: k for k, name in enumerate(names)}
    above, below = np.zeros(len(names)), np.zeros(len(names))
    for result in results:
        a, b = MEASURES[measure].part(result)
        above[row[result.scene_id]] += a
        below[row[result.scene_id]] += b
    return above, below


def check_comparable(evaluations: Sequence[Evaluation]) -> None:
    """Refuse evaluations that did not play the same episodes in the same way.

    Raises
    ------
    UsageError
        Evaluations differ in dataset, split, steps or sampling, or one is there twice.
    """
    first = evaluations[0]
    known = {name: getattr(first.about, name) for name in ("dataset", "split", "max_steps")}
    ids = [result.episode_id for result in first.results]
    greedy = next((e.about.greedy for e in evaluations if not e.about.is_reference), False)
    seen: set[tuple[str, int | None]] = set()
    for each in evaluations:
        name = each.about.name
        for key, value in known.items():
            if getattr(each.about, key) != value:
                raise UsageError(
                    f"{name}: {key} is {getattr(each.about, key)!r}, that of {first.about.name} is "
                    f"{value!r}; evaluate both alike"
                )
        if [result.episode_id for result in each.results] != ids:
            raise UsageError(f"{name} and {first.about.name} played other episodes (--limit?)")
        if not each.about.is_reference and each.about.greedy != greedy:
            raise UsageError(f"{name}: --greedy must be given for all runs, or for none")
        key_of = (name, each.about.training_seed)
        if key_of in seen:
            raise UsageError(f"{name}: training seed {each.about.training_seed} is there twice")
        seen.add(key_of)


def by_method(evaluations: Sequence[Evaluation]) -> Mapping[str, list[Evaluation]]:
    """Return evaluations by the name of their row, in the order in which names first come."""
    groups: dict[str, list[Evaluation]] = {}
    for each in evaluations:
        groups.setdefault(each.about.name, []).append(each)
    return groups


def figures(evaluations: Sequence[Evaluation], group: str, measure: str) -> list[float]:
    """Return the figure of each evaluation that has one: one value a seed."""
    found = []
    for each in evaluations:
        value = MEASURES[measure].of(r for r in each.results if GROUPS[group](r))
        if value is not None:
            found.append(value)
    return found
