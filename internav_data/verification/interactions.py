"""Predicates of outcomes and experts that need no physics: order, counts, derived flags."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from internav_data.records import Episode, Expert, Obstacle, Outcome
    from internav_data.verification.findings import FindingCollector

PUSH_OUTCOMES = ("push_east", "push_north", "push_west", "push_south")
PICK_OUTCOME = "pick"
OUTCOMES = (*PUSH_OUTCOMES, PICK_OUTCOME)
TOO_HEAVY = "too heavy"
PUSH_REASONS = ("", "not pushable", TOO_HEAVY, "something is in the way")
PICK_REASONS = ("", "not pickable", "something rests on it")
PUSHED_M = 0.05
"""Minimum displacement of a successful push."""

MAX_REACH = 4
"""Maximum number of pushes in a row of an outcome."""
BOX_SIDES = 4
"""Number of sides of a box in the plane."""

ACTIONS = 12
MOVE, ROTATE_LEFT, ROTATE_RIGHT = 0, 1, 2
PUSHES = (5, 6, 7, 8)
PICK, DROP, DONE = 9, 10, 11
MAX_ACTIONS = 500
BLIND = "blind_expert"
"""Column of the expert whose interactions may fail."""
SPACING_M = 0.25
ROUNDED_M = 1e-4
"""Stored lengths are rounded to 0.1 mm."""


class _InteractionCheck:
    """Check of one episode's outcomes and expert."""

    def __init__(self, episode: Episode, report: FindingCollector) -> None:
        self._episode = episode
        self._report = report

    def expect(self, holds: object, name: str, expected: object, got: object) -> None:
        self._report.expect(
            holds, f"schema.episodes.{name}", expected, got, self._episode.episode_id
        )

    def outcomes(self) -> None:
        """Check the outcomes: of all obstacles or of none."""
        known = [o.outcomes is not None for o in self._episode.obstacles]
        self.expect(all(known) or not any(known), "outcomes.all", "all or none", known)
        for number, obstacle in enumerate(self._episode.obstacles):
            if obstacle.outcomes is None:
                continue
            what = f"obstacle {number} ({obstacle.asset_id})"
            actions = tuple(outcome.action for outcome in obstacle.outcomes)
            self.expect(actions == OUTCOMES, "outcomes.order", f"{what}: {OUTCOMES}", actions)
            for outcome in obstacle.outcomes:
                self._outcome(obstacle, outcome, f"{what}, {outcome.action}")
                self._poses(number, outcome, f"{what}, {outcome.action}")
                self._reach(outcome, f"{what}, {outcome.action}")
            self._movable(obstacle, what)

    def _movable(self, obstacle: Obstacle, what: str) -> None:
        """Check whether an obstacle can be moved: some push of it is stopped by others at most."""
        pushes = [o for o in obstacle.outcomes or () if o.action in PUSH_OUTCOMES]
        light = obstacle.pushable and any(o.reason != TOO_HEAVY for o in pushes)
        self.expect(
            obstacle.movable in (None, light),
            "outcomes.movable",
            f"{what}: movable {light}",
            obstacle.movable,
        )

    def _outcome(self, obstacle: Obstacle, outcome: Outcome, what: str) -> None:
        pick = outcome.action == PICK_OUTCOME
        reasons = PICK_REASONS if pick else PUSH_REASONS
        reason, able = outcome.reason, obstacle.pickable if pick else obstacle.pushable
        self.expect(reason in reasons, "outcomes.reason", f"{what}: one of {reasons}", reason)
        self.expect(
            (reason == "") == outcome.success,
            "outcomes.success",
            f"{what}: a reason when it fails, none else",
            f"success {outcome.success}, reason {reason!r}",
        )
        self.expect(
            (reason == reasons[1]) == (not able),
            "outcomes.able",
            f"{what}: {reasons[1]!r} if and only if it is",
            repr(reason),
        )
        far, seconds = outcome.displacement_m, outcome.seconds
        moved = far == 0.0 if pick or not outcome.success else far >= PUSHED_M
        self.expect(
            moved, "outcomes.displacement", f"{what}: {PUSHED_M} m or more if pushed, else 0", far
        )
        idle = pick or not able
        self.expect(
            (seconds == 0.0) == idle, "outcomes.seconds", f"{what}: 0 unless pushed", seconds
        )
        self._distances(outcome, what, pick=pick)

    def _poses(self, number: int, outcome: Outcome, what: str) -> None:
        """Check which objects an outcome says have moved; earlier releases stored nothing."""
        stored = outcome.moved is not None
        pushed = outcome.success and outcome.action != PICK_OUTCOME
        self.expect(
            (outcome.pose is not None) == (stored and pushed),
            "outcomes.pose",
            f"{what}: {'a pose' if stored and pushed else 'null'}",
            outcome.pose,
        )
        self.expect(
            outcome.swept is None or (pushed and len(outcome.swept) == BOX_SIDES),
            "outcomes.swept",
            f"{what}: {BOX_SIDES} distances of a successful push, else null",
            outcome.swept,
        )
        resting = (False, True) if outcome.seconds else (True,)
        self.expect(
            outcome.at_rest in (resting if stored else (None,)),
            "outcomes.at_rest",
            f"{what}: one of {resting if stored else None}",
            outcome.at_rest,
        )
        moved = [(o.object_id, o.obstacle) for o in outcome.moved or ()]
        others = set(range(len(self._episode.obstacles))) - {number}
        known = all((a is None) != (b is None) and (b is None or b in others) for a, b in moved)
        # Objects of the scene by id, then obstacles by index, each once.
        keys = [(a is None, a or 0, b or 0) for a, b in moved]
        self.expect(
            known and keys == sorted(set(keys)) and (pushed or not moved),
            "outcomes.moved",
            f"{what}: other objects, then other obstacles, ascending; none unless pushed",
            moved,
        )

    def _reach(self, outcome: Outcome, what: str) -> None:
        """Check what pushes in a row say, where they are stored, against the first of them."""
        reach, opened = outcome.reach_m, outcome.reach_opened
        if reach is None:
            self.expect(opened is None, "outcomes.reach_opened", f"{what}: null", opened)
            return
        pushed = outcome.success and outcome.action != PICK_OUTCOME
        self.expect(
            pushed and 1 <= len(reach) <= MAX_REACH and reach[0] == outcome.displacement_m,
            "outcomes.reach_m",
            f"{what}: of a successful push 1 … {MAX_REACH} distances from {outcome.displacement_m}",
            reach,
        )
        blocked = self._episode.obstructed_path_steps is None
        self.expect(
            (opened is None or (blocked and 1 <= opened <= len(reach)))
            and (opened == 1) == outcome.opened,
            "outcomes.reach_opened",
            f"{what}: 1 if opened, else null or up to {len(reach)} where the lattice was cut off",
            opened,
        )

    def _distances(self, outcome: Outcome, what: str, *, pick: bool) -> None:
        episode = self._episode
        steps, obstructed_path_m = outcome.path_steps_after, outcome.path_m_after
        opened = outcome.success and episode.obstructed_path_steps is None and steps is not None
        self.expect(
            outcome.opened == opened, "outcomes.opened", f"{what}: {opened}", outcome.opened
        )
        if not outcome.success:
            before = (episode.obstructed_path_steps, episode.obstructed_path_m)
            same = (steps, obstructed_path_m) == before
            self.expect(same, "outcomes.unchanged", f"{what}: {before}", (steps, obstructed_path_m))
            return
        straight = math.dist((episode.start.x, episode.start.y), (episode.goal.x, episode.goal.y))
        min_length = max(straight, episode.shortest_path_m) if pick else straight
        max_length = math.inf if steps is None else steps * SPACING_M
        if pick and episode.obstructed_path_m is not None:
            max_length = min(max_length, episode.obstructed_path_m)
        # A lattice path bounds the Euclidean one; removing an obstacle makes no path longer.
        length = math.inf if obstructed_path_m is None else obstructed_path_m
        self.expect(
            min_length - ROUNDED_M <= length <= max_length + ROUNDED_M,
            "outcomes.path_m_after",
            f"{what}: {min_length:.4f} … {max_length:.4f} m",
            obstructed_path_m,
        )
        if pick:
            far = math.inf if steps is None else steps
            longest = (
                math.inf if episode.obstructed_path_steps is None else episode.obstructed_path_steps
            )
            self.expect(
                episode.shortest_path_steps <= far <= longest,
                "outcomes.path_steps_after",
                f"{what}: {episode.shortest_path_steps} … {longest}",
                steps,
            )

    def expert(self, expert: Expert, column: str) -> None:
        """Check the statements about an expert that follow from its actions alone."""
        actions = expert.actions
        unknown = [a for a in actions if not 0 <= a < ACTIONS]
        self.expect(not unknown, f"{column}.actions", f"0 … {ACTIONS - 1}", unknown)
        self.expect(
            0 < len(actions) <= MAX_ACTIONS,
            f"{column}.actions",
            f"1 … {MAX_ACTIONS} actions",
            len(actions),
        )
        ends = [k for k, action in enumerate(actions) if action == DONE]
        last = [len(actions) - 1]
        self.expect(ends == last, f"{column}.done", f"Done ({DONE}) once, at the end", ends)
        for name, true in (
            ("steps", len(actions)),
            ("pushes", sum(actions.count(push) for push in PUSHES)),
            ("picks", actions.count(PICK)),
            ("path_m", SPACING_M * actions.count(MOVE)),
        ):
            stated = getattr(expert, name)
            self.expect(stated == true, f"{column}.{name}", true, stated)
        if column == BLIND:
            return  # what it tries may fail, a second Pickup too
        hands = [a for a in actions if a in {PICK, DROP}]
        by_turns = all(a == (PICK, DROP)[k % 2] for k, a in enumerate(hands))
        self.expect(by_turns, f"{column}.hands", "Pickup and Drop by turns", hands)


def check_interactions(episode: Episode, report: FindingCollector, *, solvable: bool) -> None:
    """Check the outcomes and the expert of an episode, if it has them.

    Parameters
    ----------
    episode
        Episode to check.
    report
        Collector that receives the findings.
    solvable
        Whether every episode of the dataset must have an expert.

    """
    check = _InteractionCheck(episode, report)
    check.outcomes()
    if episode.expert is not None:
        check.expert(episode.expert, "expert")
    elif solvable:
        check.expect(False, "expert.present", "an expert", None)  # noqa: FBT003 - counted
    if episode.blind_expert is not None:
        check.expert(episode.blind_expert, BLIND)
