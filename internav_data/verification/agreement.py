"""Predicates of second opinions: what another engine said, as far as a row tells.

The other engine's end of the pushed obstacle is stored, and whether it agrees; ends of other
objects are not. So all but one case follows from a row: where both engines succeed in an episode
that is cut off, only the other engine knows whether it opens.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.verification.interactions import PICK_OUTCOME

if TYPE_CHECKING:
    from internav_data.records import Episode, Obstacle, Outcome
    from internav_data.verification.findings import FindingCollector


def check_agreement(episode: Episode, report: FindingCollector) -> None:
    """Check the second opinions on an episode's outcomes against these, each by itself."""

    def expect(holds: object, name: str, expected: object, got: object) -> None:
        report.expect(holds, f"schema.episodes.{name}", expected, got, episode.episode_id)

    physics = episode.physics
    other = physics.other_engine
    expect(
        other != physics.engine and (other is None) == (physics.other_build is None),
        "physics.other_engine",
        f"another engine than {physics.engine} with its build, or null and null",
        (other, physics.other_build),
    )
    opinions: list[bool] = []
    for number, obstacle in enumerate(episode.obstacles):
        for outcome in obstacle.outcomes or ():
            what = f"obstacle {number} ({obstacle.asset_id}), {outcome.action}"
            asked = other is not None and _is_asked(obstacle, outcome)
            expect(
                (outcome.agrees is not None) == asked,
                "outcomes.agrees",
                f"{what}: {'true or false' if asked else 'null, as no other engine was asked'}",
                outcome.agrees,
            )
            expect(
                asked or outcome.other_pose is None,
                "outcomes.other_pose",
                f"{what}: null, as no other engine was asked",
                outcome.other_pose,
            )
            if asked and outcome.agrees is not None:
                opinions.append(outcome.agrees)
                known = _agrees(episode, outcome)
                expect(
                    known in (None, outcome.agrees),
                    "outcomes.agrees",
                    f"{what}: {known}, by the ends of both engines",
                    outcome.agrees,
                )
    agreed = None if other is None else all(opinions)
    expect(episode.agreed == agreed, "agreed", agreed, episode.agreed)


def _is_asked(obstacle: Obstacle, outcome: Outcome) -> bool:
    """Return whether a second engine is asked: for what an engine decides, a push."""
    return obstacle.pushable and outcome.action != PICK_OUTCOME


def _agrees(episode: Episode, outcome: Outcome) -> bool | None:
    """Return whether two engines agree; None where the row does not tell."""
    succeeds = outcome.other_pose is not None
    if succeeds != outcome.success:
        return False
    if not succeeds:
        return True
    return None if episode.obstructed_path_steps is None else True
