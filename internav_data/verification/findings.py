"""Findings of a validation: predicate, place, expected and stored value."""

from __future__ import annotations

import json
from collections import Counter
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Literal

from internav_data.records.errors import InternavError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

Level = Literal["files", "schema", "geometry", "physics"]
LEVELS: tuple[Level, ...] = ("files", "schema", "geometry", "physics")
"""Levels in order: each runs those before it."""

MAX_FINDINGS = 1000
"""Findings kept in full; further ones are only counted, so that memory stays bounded."""
MAX_TEXT = 2_000
"""Characters of a value in a finding."""
MAX_SHOWN = 20
"""Findings written out in the summary."""
ELSEWHERE_M = 0.001
"""Tolerance of settled poses in a dataset that other hardware made, metres."""
MAX_DIFFERING = 0.005
"""Share of falls, outcomes and experts that may end otherwise on other hardware; one always may."""


@dataclass(frozen=True, slots=True, order=True)
class Finding:
    """One untrue statement of a dataset."""

    file: str
    """Path inside the dataset; empty where a finding is about a scene as a whole."""
    scene: str
    episode: str
    predicate: str
    """Dotted name of the predicate that does not hold, as `episode.obstructed-path-steps`."""
    expected: str
    got: str

    def __str__(self) -> str:
        """Return one line: file and row, predicate, expected, got."""
        name = self.episode or self.scene
        where = ": ".join(part for part in (self.file, name) if part)
        return f"{where or 'dataset'}: {self.predicate}: expected {self.expected}, got {self.got}"


@dataclass(frozen=True, slots=True)
class Agreement:
    """Agreement of another engine with the stored outcomes of a group of pushes."""

    agree: int
    """Number of outcomes with the same success and opening."""
    asked: int
    """Number of outcomes that the engine was asked for."""

    def __str__(self) -> str:
        """Return share and counts: `99.5 % (597 of 600)`."""
        return f"{self.agree / max(1, self.asked):.1%} ({self.agree} of {self.asked})"


@dataclass(frozen=True, slots=True)
class Findings:
    """Result of `validate`: counts and findings, in a fixed order."""

    level: Level
    checked: dict[str, int]
    """Number of files, rows, scenes, episodes and predicates that were checked."""
    found: tuple[Finding, ...]
    """Findings, sorted, at most `MAX_FINDINGS`."""
    total: int
    """Number of all findings."""
    by_predicate: dict[str, int] = field(default_factory=dict)
    """Number of findings of each predicate."""
    notes: dict[str, int] = field(default_factory=dict)
    """Reasons why something was not checked, with numbers of episodes; not faults of the data."""

    agreement: dict[str, Agreement] = field(default_factory=dict)
    """Agreement with another engine by group of outcomes, where one was asked; no finding."""

    @property
    def ok(self) -> bool:
        """Whether there are no findings."""
        return self.total == 0

    def summary(self) -> str:
        """Return a text for a terminal: the counts, then the first findings."""
        looked = ", ".join(f"{count} {name}" for name, count in self.checked.items())
        notes = [f"note: {count} x {text}" for text, count in self.notes.items()]
        notes += [f"agreement, {group}: {share}" for group, share in self.agreement.items()]
        if self.ok:
            return "\n".join([f"valid at level {self.level}: {looked}", *notes])
        lines = [f"invalid at level {self.level}: {self.total} findings in {looked}"]
        lines += [f"  {name}: {count}" for name, count in self.by_predicate.items()]
        lines += [str(finding) for finding in self.found[:MAX_SHOWN]]
        if self.total > MAX_SHOWN:
            lines.append(f"… and {self.total - MAX_SHOWN} more")
        return "\n".join(lines + notes)

    def to_json(self) -> str:
        """Return the whole result as a JSON object."""
        return json.dumps({"ok": self.ok, **asdict(self)}, indent=2)


def _text(value: object) -> str:
    text = str(value)
    return text if len(text) <= MAX_TEXT else f"{text[:MAX_TEXT]}…"


class FindingCollector:
    """Collector of the findings of one file or scene."""

    def __init__(self, file: str = "", scene: str = "") -> None:
        self.file = file
        self.scene = scene
        self.found: list[Finding] = []
        self.differences: list[Finding] = []
        """Results of another kind than on the hardware that made the data."""
        self.differing: Counter[str] = Counter()
        """Number of those of each predicate, those that are not kept too."""
        self.counts: Counter[str] = Counter()
        self.by_predicate: Counter[str] = Counter()
        self.notes: Counter[str] = Counter()
        self.opinions: Counter[tuple[str, bool]] = Counter()
        """Outcomes compared with another engine's, by group ("" is all) and whether it agrees."""

    def expect(
        self, holds: object, predicate: str, expected: object, got: object, episode: str = ""
    ) -> bool:
        """Count one predicate, keep a finding if it does not hold, return whether it holds."""
        self.counts["predicates"] += 1
        if holds:
            return True
        self.by_predicate[predicate] += 1
        if len(self.found) < MAX_FINDINGS:
            self.found.append(
                Finding(self.file, self.scene, episode, predicate, _text(expected), _text(got))
            )
        return False

    @contextmanager
    def guard(self, predicate: str) -> Iterator[None]:
        """Turn an error of what runs inside into a finding: hostile values end no validation.

        Errors for users pass: they say what to do.
        """
        try:
            yield
        except InternavError:
            raise
        except Exception as error:  # noqa: BLE001 - whatever such values lead to
            self.expect(False, predicate, "values that can be checked", repr(error))  # noqa: FBT003

    def differ(self, predicate: str, expected: object, got: object, episode: str) -> None:
        """Note a result of another kind than on the hardware that made the data."""
        self.counts["differing"] += 1
        self.differing[predicate] += 1
        if len(self.differences) < MAX_FINDINGS:
            self.differences.append(
                Finding(self.file, self.scene, episode, predicate, _text(expected), _text(got))
            )

    def judge_differences(self, made_on: str) -> None:
        """Take the differences as findings where there are too many, as notes else.

        `made_on` names the hardware that made the data.
        """
        differing, compared = self.counts["differing"], self.counts["compared"]
        self.notes[
            f"made on {_text(made_on)}: compared within {1000.0 * ELSEWHERE_M:g} mm; "
            f"{differing} of {compared} falls, outcomes and experts end otherwise here"
        ] += self.counts["made elsewhere"]
        if differing > max(1.0, MAX_DIFFERING * compared):
            self.found = sorted(self.found + self.differences)[:MAX_FINDINGS]
            self.by_predicate += self.differing
            return
        for found in sorted(self.differences)[:MAX_SHOWN]:
            self.notes[f"ends otherwise here: {found}"] += 1

    def absorb(self, other: FindingCollector) -> None:
        """Add the findings and counts of another collector."""
        self.found = sorted(self.found + other.found)[:MAX_FINDINGS]
        self.differences = sorted(self.differences + other.differences)[:MAX_FINDINGS]
        self.differing += other.differing
        self.counts += other.counts
        self.by_predicate += other.by_predicate
        self.notes += other.notes
        self.opinions += other.opinions

    def findings(self, level: Level) -> Findings:
        """Return the result, in an order that does not depend on the number of workers."""
        return Findings(
            level,
            dict(sorted(self.counts.items())),
            tuple(sorted(self.found)[:MAX_FINDINGS]),
            sum(self.by_predicate.values()),
            dict(sorted(self.by_predicate.items())),
            dict(sorted(self.notes.items())),
            agreement_of(self.opinions),
        )


def agreement_of(opinions: Mapping[tuple[str, bool], int]) -> dict[str, Agreement]:
    """Return the agreement of each group, all of them first, as "all"."""
    groups = sorted({group for group, _ in opinions})
    return {
        group or "all": Agreement(
            agree := opinions.get((group, True), 0), agree + opinions.get((group, False), 0)
        )
        for group in groups
    }


def join(collectors: Iterable[FindingCollector]) -> FindingCollector:
    """Combine several collectors into one."""
    whole = FindingCollector()
    for collector in collectors:
        whole.absorb(collector)
    return whole
