"""Tables in the form of the paper's Tables 3, 4 and 5, with the paper's rows below ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from internav_data.core.markdown import table_row
from internav_data.evaluation.metrics import GROUPS, MEASURES
from internav_data.evaluation.statistics import Interval, seed_interval

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from internav_data.evaluation.archive import About, Evaluation

NOT_COMPARABLE: Final = (
    "Rows of the paper: AI2-THOR, 500 test episodes of its own dataset, other physics: not "
    "comparable with ours, printed for orientation only."
)
NOTHING: Final = "–"  # noqa: RUF001 - an en dash, as tables have it
_WIDE: Final = ("success", "distance_m", "spl", "sts")
_TABLE5: Final = ("ir_m", "isr", "pusr", "pisr", "openings", "interactions")
"""The paper's four measures and two of ours: an opening has no finite drop, so IR misses it."""
_PAPER_GROUPS: Final = ("all", "hard", "non-interactive")
_TITLES: Final = {
    "all": "all",
    "hard": "N >= 4 rooms",
    "non-interactive": "non-interactive",
    "blocked": "blocked",
}
_DIGITS: Final = {"%": 1, "m": 2, "": 3}

Row3 = tuple[float, ...]
PAPER_3: Final[Mapping[str, Row3]] = {
    "Random": (1.32, 7.68, 0.002, 0.001, 0, 12.29, 0, 0, 2.42, 7.35, 0.003, 0.001),
    "PPO": (42.7, 4.84, 0.252, 0.134, 23.3, 7.79, 0.139, 0.086, 51.5, 3.44, 0.306, 0.181),
    "NIE": (52.0, 3.94, 0.287, 0.155, 37.3, 6.54, 0.195, 0.102, 58.8, 3.01, 0.345, 0.188),
    "HRL": (43.4, 4.80, 0.253, 0.135, 24.3, 7.01, 0.169, 0.084, 51.9, 3.40, 0.316, 0.176),
    "PPO+intent": (54.7, 3.84, 0.305, 0.163, 38.0, 6.29, 0.198, 0.109, 70.4, 2.38, 0.390, 0.222),
    "CaMP": (56.3, 3.67, 0.327, 0.177, 41.4, 5.76, 0.231, 0.121, 72.3, 2.05, 0.407, 0.236),
}
PAPER_4: Final[Mapping[str, Row3]] = {
    "sync. /epoch": (53.0, 4.16, 0.316, 0.160, 36.7, 6.95, 0.196, 0.107, 63.4, 2.53, 0.375, 0.219),
    "sync. /rollout": (
        50.7, 4.22, 0.277, 0.145, 36.0, 6.82, 0.175, 0.105, 57.9, 3.10, 0.345, 0.191,
    ),
    "sync. /3*rollout": (
        54.7, 3.84, 0.305, 0.163, 37.3, 6.54, 0.195, 0.109, 70.4, 2.38, 0.390, 0.222,
    ),
    "sync. /5*rollout": (
        50.3, 4.25, 0.279, 0.150, 30.7, 6.85, 0.147, 0.098, 55.9, 3.21, 0.337, 0.185,
    ),
    "wo/intent": (50.8, 4.03, 0.294, 0.151, 31.0, 6.79, 0.151, 0.095, 59.2, 2.98, 0.347, 0.202),
    "test wo/intent": (
        41.7, 4.95, 0.202, 0.111, 24.7, 7.72, 0.110, 0.085, 50.5, 3.56, 0.296, 0.168,
    ),
    "recursive intent": (
        51.4, 4.06, 0.292, 0.156, 32.7, 7.04, 0.159, 0.096, 62.8, 2.61, 0.353, 0.215,
    ),
    "policy intent": (
        52.5, 4.32, 0.304, 0.155, 35.8, 7.09, 0.191, 0.100, 62.6, 2.91, 0.357, 0.216,
    ),
    "integrated intent": (
        56.3, 3.67, 0.327, 0.177, 41.4, 5.76, 0.231, 0.121, 72.3, 2.05, 0.407, 0.236,
    ),
}  # fmt: skip
PAPER_5: Final[Mapping[str, Row3]] = {
    "PPO": (0.271, 23.2, 23.8, 21.9),
    "PPO+intent": (0.371, 27.0, 25.1, 28.6),
    "CaMP wo/intent": (0.287, 20.4, 19.9, 23.5),
    "CaMP": (0.402, 27.6, 27.1, 29.8),
}


@dataclass(frozen=True, slots=True)
class Cell:
    """Figure in a table."""

    text: str
    """Figure as printed."""
    value: float | None
    """Mean over seeds in the measure's own unit (shares, not hundredths); None without one."""
    half: float | None = None
    """Half of the 95 % t interval over seeds."""
    seeds: int = 1
    """Number of seeds."""


@dataclass(frozen=True, slots=True)
class TableRow:
    """Row of a table."""

    name: str
    """Name of a method, or of a row of the paper."""
    source: str
    """Origin of the figures: ours, reference or paper."""
    cells: tuple[Cell, ...]
    """Figures, group by group."""


@dataclass(frozen=True, slots=True)
class Table:
    """Table in the paper's form."""

    title: str
    """Title."""
    groups: tuple[tuple[str, int], ...]
    """Heading of each group of columns, and the number of its episodes."""
    columns: tuple[str, ...]
    """Measures within each group, by their names in `MEASURES`."""
    rows: tuple[TableRow, ...]
    """Rows, the paper's last."""
    notes: tuple[str, ...]
    """Notes below the table."""

    def headings(self) -> list[str]:
        """Return the heading of each column but the first."""
        return [
            f"{group} (n = {count}) {heading(name)}" if k == 0 else heading(name)
            for group, count in self.groups
            for k, name in enumerate(self.columns)
        ]


def heading(measure: str) -> str:
    """Return a measure's name with its unit and the direction of improvement, as SR(%) ↑."""
    found = MEASURES[measure]
    unit = f"({found.unit})" if found.unit else ""
    arrow = {"more": " ↑", "less": " ↓", "": ""}[found.better]
    return f"{found.title}{unit}{arrow}"


def written(measure: str, value: float | None, half: float | None = None) -> str:
    """Return a figure as printed: hundredths for shares, a dash where there is none."""
    if value is None:
        return NOTHING
    unit = MEASURES[measure].unit
    times = 100.0 if unit == "%" else 1.0
    digits = 3 if measure == "ir_m" else _DIGITS[unit]
    text = f"{times * value:.{digits}f}"
    return text if half is None else f"{text} ± {times * half:.{digits}f}"


def cell(evaluations: Sequence[Evaluation], group: str, measure: str) -> Cell:
    """Return a method's figure over its seeds."""
    values = []
    for each in evaluations:
        chosen = (result for result in each.results if GROUPS[group](result))
        found = MEASURES[measure].of(chosen)
        if found is not None:
            values.append(found)
    if not values:
        return Cell(NOTHING, None, seeds=len(evaluations))
    over: Interval = seed_interval(values)
    return Cell(written(measure, over.mean, over.half), over.mean, over.half, len(values))


def table_3(methods: Mapping[str, Sequence[Evaluation]], *, blocked: bool = True) -> Table:
    """Return SR, FDT, SPL and STS on all, hard, non-interactive and, if asked, blocked episodes."""
    groups = (*_PAPER_GROUPS, "blocked") if blocked else _PAPER_GROUPS
    return _table("Table 3: quantitative results", groups, _WIDE, methods, PAPER_3)


def table_4(methods: Mapping[str, Sequence[Evaluation]]) -> Table | None:
    """Return the same columns for the variants of CaMP and PPO+intent; None without any."""
    variants = {
        f"{name} ({in_paper})": found
        for name, found in methods.items()
        for in_paper in [variant_of(found[0].about)]
        if in_paper
    }
    if not variants:
        return None
    return _table("Table 4: ablations", _PAPER_GROUPS, _WIDE, variants, PAPER_4)


def table_5(methods: Mapping[str, Sequence[Evaluation]]) -> Table:
    """Return IR, ISR, PuSR, PiSR, and openings and interactions an episode, on all episodes."""
    return _table("Table 5: interactions", ("all",), _TABLE5, methods, PAPER_5)


def row_name(about: About) -> str:
    """Return the name of a run's row: its method, and how it differs from the default one."""
    words = [about.method]
    # Methods without an intent have none of these two.
    words += [f"--intent {about.intent}"] if about.intent not in {"", "integrated"} else []
    words += [f"--sync-every {about.sync_every}"] if about.sync_every not in {None, 3} else []
    words += ["--without-intent"] if about.without_intent else []
    words += ["(cloned only)"] if about.cloned_frames and about.environment_steps == 0 else []
    return " ".join(words)


def variant_of(about: About) -> str:
    """Return the row of the paper's Table 4 to which a run corresponds; empty for none."""
    if about.method == "ppo-intent":
        return {1: "sync. /rollout", 3: "sync. /3*rollout", 5: "sync. /5*rollout"}.get(
            about.sync_every or 0, ""
        )
    if about.method != "camp":
        return ""
    if about.without_intent:
        return "test wo/intent"
    return "wo/intent" if about.intent == "none" else f"{about.intent} intent".strip()


def _table(
    title: str,
    groups: Sequence[str],
    columns: tuple[str, ...],
    methods: Mapping[str, Sequence[Evaluation]],
    paper: Mapping[str, Row3],
) -> Table:
    first = next(iter(methods.values()))[0].results
    counts = [sum(map(GROUPS[group], first)) for group in groups]
    rows = []
    for name, found in methods.items():
        cells = tuple(cell(found, group, measure) for group in groups for measure in columns)
        rows.append(TableRow(name, "reference" if found[0].about.is_reference else "ours", cells))
    for name, values in paper.items():
        cells = tuple(
            _paper_cell(columns[k % len(columns)], values[k]) if k < len(values) else
            Cell(NOTHING, None)
            for k in range(len(groups) * len(columns))
        )  # fmt: skip
        rows.append(TableRow(f"{name}, the paper's", "paper", cells))
    headed = tuple((_TITLES[group], count) for group, count in zip(groups, counts, strict=True))
    return Table(title, headed, columns, tuple(rows), _notes(headed, methods))


def _paper_cell(measure: str, value: float) -> Cell:
    share = value / 100.0 if MEASURES[measure].unit == "%" else float(value)
    return Cell(written(measure, share), share)


def _notes(
    groups: Sequence[tuple[str, int]], methods: Mapping[str, Sequence[Evaluation]]
) -> tuple[str, ...]:
    notes = [f"No episode is {name}: n = 0." for name, count in groups if not count]
    if any(len(found) > 1 for found in methods.values()):
        notes.append("±: half of the 95 % t interval over training seeds.")
    if any(not found[0].about.is_reference and len(found) == 1 for found in methods.values()):
        notes.append("One training seed: nothing is said about how another would do.")
    return (*notes, NOT_COMPARABLE)


def markdown(table: Table) -> str:
    """Return a table as Markdown, its notes below."""
    headings = ["", *table.headings()]
    lines = [f"### {table.title}", "", table_row(headings), table_row(["---"] * len(headings))]
    lines += [table_row([row.name, *(each.text for each in row.cells)]) for row in table.rows]
    return "\n".join([*lines, "", *(f"{note}  " for note in table.notes), ""])


def as_json(table: Table) -> dict[str, Any]:
    """Return a table as plain data: shares, not hundredths; null where there is no figure."""
    keys = [(group, name) for group, _ in table.groups for name in table.columns]
    rows = [
        {
            "name": row.name,
            "source": row.source,
            "comparable": row.source != "paper",
            "figures": [
                {"group": group, "measure": name, "value": each.value, "half": each.half,
                 "seeds": each.seeds}
                for (group, name), each in zip(keys, row.cells, strict=True)
            ],
        }
        for row in table.rows
    ]  # fmt: skip
    return {
        "title": table.title,
        "episodes": dict(table.groups),
        "rows": rows,
        "notes": list(table.notes),
    }
