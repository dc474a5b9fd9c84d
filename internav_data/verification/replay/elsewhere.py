"""Replay of episodes that other hardware made: the same kinds of results, nearly the same poses.

Arithmetic that differs in the last bit moves a settled object by micrometres. What stands on an
edge may topple on one machine and stay on another: few do, and those are counted and listed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from internav_data.records import Episode
    from internav_data.verification.findings import FindingCollector

TURN_TOLERANCE: Final = 2e-3
"""Tolerance of a settled pose's quaternion: 4 mrad, 1 mm at 0.25 m."""
MEASURES: Final = frozenset((
    *("physics.settle-time", "physics.settle-depth"),
    *("physics.outcome-displacement", "physics.outcome-seconds"),
    *("physics.outcome-path-steps-after", "physics.outcome-path-m-after"),
    *("physics.outcome-pose", "physics.outcome-moved", "physics.outcome-at-rest"),
    *("physics.outcome-reach", "physics.outcome-reach-opened"),
    "physics.outcome-other-pose",
))  # fmt: skip
"""Predicates of numbers that follow from poses: on other hardware they need not hold."""
KINDS: Final = frozenset((
    "physics.settle-refused",
    *("physics.outcome-reason", "physics.outcome-success", "physics.outcome-opened"),
    "physics.outcome-agrees",
))  # fmt: skip
"""Predicates of kinds of results, beside all those of experts."""
_EXPERTS: Final = ("physics.expert-", "physics.blind-expert-")


class TolerantExpect:
    """`Expect` of an episode: measures pass, differences in kind are noted, all else is a finding.

    Parameters
    ----------
    episode
        Episode to check; each fall, outcome and expert of it is compared once.
    report
        Collector that receives findings and differences.

    """

    def __init__(self, episode: Episode, report: FindingCollector) -> None:
        self._episode, self._report = episode, report
        self._differing: set[str] = set()
        outcomes = sum(len(obstacle.outcomes or ()) for obstacle in episode.obstacles)
        compared = len(episode.obstacles) + outcomes
        compared += (episode.expert is not None) + (episode.blind_expert is not None)
        report.counts["compared"] += compared

    def __call__(self, holds: object, predicate: str, expected: object, got: object) -> bool:
        """Count one predicate and return whether it holds."""
        name = self._episode.episode_id
        if holds or not (predicate in MEASURES | KINDS or predicate.startswith(_EXPERTS)):
            return self._report.expect(holds, predicate, expected, got, name)
        if predicate not in MEASURES:
            expert = [prefix for prefix in _EXPERTS if predicate.startswith(prefix)]
            subject = expert[0] if expert else str(expected).partition(":")[0]
            if subject not in self._differing:
                self._differing.add(subject)
                self._report.differ(predicate, expected, got, name)
        return False
