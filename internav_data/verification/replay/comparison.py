"""Comparison of a dataset's outcomes with those of another engine: counts, and no findings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.physics import get_solver
from internav_data.physics.engines.installed import require_engine
from internav_data.verification.interactions import PUSH_OUTCOMES
from internav_data.verification.replay.outcomes import OutcomeCheck

if TYPE_CHECKING:
    from internav_data.records import Episode
    from internav_data.verification.findings import FindingCollector
    from internav_data.verification.replay.checked_scene import CheckedScene


def check_engine(name: str) -> None:
    """Check that an engine is known and installed.

    Raises
    ------
    UsageError
        No engine has this name.
    MissingEngineError
        Its library is not installed.

    """
    require_engine(name)


def compare_outcomes(
    scene: CheckedScene, episode: Episode, report: FindingCollector, engine: str
) -> None:
    """Ask an engine for each outcome of a push that is stored, and count where it agrees.

    It agrees where `success` and `opened` are the same. Counted are all, by type of obstacle, and
    by the reason that is stored.
    """
    world, first = scene.world(episode, engine), len(scene.model.items)
    name = episode.episode_id

    def expect(holds: object, predicate: str, expected: object, got: object) -> bool:
        return report.expect(holds, predicate, expected, got, name)

    for number, obstacle in enumerate(episode.obstacles):
        for outcome in obstacle.outcomes or ():
            if not obstacle.pushable or outcome.action not in PUSH_OUTCOMES:
                continue
            check = OutcomeCheck(scene, episode, outcome, f"obstacle {number}", expect)
            success, opened, _ = check.ask(world, first + number)
            agrees = (success, opened) == (outcome.success, outcome.opened)
            for group in ("", f"type {obstacle.type}", f"reason {outcome.reason or 'success'}"):
                report.opinions[group, agrees] += 1
    report.counts["compared episodes"] += 1
    solver = get_solver(engine)
    report.notes[f"outcomes compared with {solver.name} of {solver.build}, not replayed"] += 1
