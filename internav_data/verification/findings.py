"""What a validation found: which predicate, where, what was expected and what the data says."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Literal

from internav_data.records.errors import ValidationError

if TYPE_CHECKING:
    from collections.abc import Iterable

Level = Literal["files", "schema", "geometry", "physics"]
LEVELS: tuple[Level, ...] = ("files", "schema", "geometry", "physics")
"""In order: each level runs those before it."""

KEPT = 1000
"""Findings kept in full; further ones are only counted, so that memory stays bounded."""
SHOWN = 20
"""Findings written out in the summary."""


@dataclass(frozen=True, slots=True, order=True)
class Finding:
    """One untrue statement of a dataset."""

    file: str
    """Path inside the dataset; empty where a finding is about a scene as a whole."""
    scene: str
    episode: str
    predicate: str
    """Dotted name of what does not hold, as `episode.steps`."""
    expected: str
    got: str

    def __str__(self) -> str:
        """One line: where, what, expected, got."""
        place = self.episode or self.scene
        where = ": ".join(part for part in (self.file, place) if part)
        return f"{where or 'dataset'}: {self.predicate}: expected {self.expected}, got {self.got}"


@dataclass(frozen=True, slots=True)
class Findings:
    """Result of `validate`: what was looked at and what was found, in a fixed order."""

    level: Level
    checked: dict[str, int]
    """How many files, rows, scenes and episodes were looked at, predicates judged."""
    found: tuple[Finding, ...]
    """At most `KEPT`, sorted."""
    total: int
    """How many there were in all."""
    by_predicate: dict[str, int] = field(default_factory=dict)
    notes: dict[str, int] = field(default_factory=dict)
    """What could not be judged and why, and in how many episodes. No fault of the data."""

    @property
    def ok(self) -> bool:
        """Whether nothing was found."""
        return self.total == 0

    def summary(self) -> str:
        """Return a text for a terminal: what was checked, then the first findings."""
        looked = ", ".join(f"{count} {name}" for name, count in self.checked.items())
        notes = [f"note: {count} x {text}" for text, count in self.notes.items()]
        if self.ok:
            return "\n".join([f"valid at level {self.level}: {looked}", *notes])
        lines = [f"invalid at level {self.level}: {self.total} findings in {looked}"]
        lines += [f"  {name}: {count}" for name, count in self.by_predicate.items()]
        lines += [str(finding) for finding in self.found[:SHOWN]]
        if self.total > SHOWN:
            lines.append(f"… and {self.total - SHOWN} more")
        return "\n".join(lines + notes)

    def to_json(self) -> str:
        """Return the whole result as a JSON object."""
        return json.dumps({"ok": self.ok, **asdict(self)}, indent=2)

    def raise_if_any(self) -> None:
        """Raise a ValidationError that names the first finding, if there is one."""
        if not self.ok:
            rest = f" (and {self.total - 1} more)" if self.total > 1 else ""
            raise ValidationError(f"{self.found[0]}{rest}; generate the dataset again")


class FindingCollector:
    """Judges predicates of one file or scene and keeps what fails."""

    def __init__(self, file: str = "", scene: str = "") -> None:
        self.file = file
        self.scene = scene
        self.found: list[Finding] = []
        self.counts: Counter[str] = Counter()
        self.by_predicate: Counter[str] = Counter()
        self.notes: Counter[str] = Counter()

    def expect(
        self, holds: object, predicate: str, expected: object, got: object, episode: str = ""
    ) -> bool:
        """Judge one predicate; keep a finding where it does not hold. Return whether it holds."""
        self.counts["predicates"] += 1
        if holds:
            return True
        self.by_predicate[predicate] += 1
        if len(self.found) < KEPT:
            self.found.append(
                Finding(self.file, self.scene, episode, predicate, str(expected), str(got))
            )
        return False

    def absorb(self, other: FindingCollector) -> None:
        """Take over what another collector found and counted."""
        self.found = sorted(self.found + other.found)[:KEPT]
        self.counts += other.counts
        self.by_predicate += other.by_predicate
        self.notes += other.notes

    def findings(self, level: Level) -> Findings:
        """Return the result, in an order that no worker count changes."""
        return Findings(
            level,
            dict(sorted(self.counts.items())),
            tuple(sorted(self.found)[:KEPT]),
            sum(self.by_predicate.values()),
            dict(sorted(self.by_predicate.items())),
            dict(sorted(self.notes.items())),
        )


def join(collectors: Iterable[FindingCollector]) -> FindingCollector:
    """Gather several collectors into one."""
    whole = FindingCollector()
    for collector in collectors:
        whole.absorb(collector)
    return whole
