"""Ranges of single values, column by column: the checks of a JSON Schema, vectorised."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from internav_data.verification.interactions import MAX_REACH, OUTCOMES, PICK_REASONS, PUSH_REASONS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from internav_data.verification.findings import FindingCollector

METRES = 4
"""Decimals of positions and lengths (0.1 mm)."""
TURNS = 6
"""Decimals of quaternions."""
MAX_PUSH_S = 11.0
"""Maximum duration of a push: a second at most until the release, ten until at rest."""
PATTERNS = ("plain", "planks", "tiles", "stripes", "carpet", "bricks")
"""Patterns of floors and walls."""
PART_MATERIALS = (
    "wood", "fabric", "metal", "plastic", "ceramic", "glass", "leather", "leaf", "food", "paper",
    "screen", "stone",
)  # fmt: skip
"""Materials of the parts of assets."""
UNIT = 3e-6
"""Tolerance of the length of a rounded quaternion."""


@dataclass(frozen=True, slots=True)
class Rule:
    """Rule for every value of one leaf column (the schema checks missing values)."""

    low: float = -math.inf
    high: float = math.inf
    choices: tuple[Any, ...] = ()
    digits: int | None = None
    """Maximum number of decimals of a stored float."""
    pattern: str = ""


COORDINATE = Rule(-250.0, 250.0, digits=METRES)
"""Floor plans of users reach over 200 m at most; a lattice over more takes the memory."""
ID = Rule(0, 32767)
ID_OR_NONE = Rule(-1, 32767)
SIZE = Rule(1e-4, 1e4, digits=METRES)
SCENE = Rule(pattern=r"scene-\d{6,}")
NAME = Rule(pattern=r"\S+")
WORDS = Rule(pattern=r"\S+( \S+)*")
MASS = Rule(1e-4, 1e5)
FRICTION = Rule(0.0, 2.0)
AFFORDANCE = Rule(choices=("push", "pick"))
SPLIT = Rule(choices=("train", "val", "test"))
TURN = Rule(-1.0, 1.0, digits=TURNS)
FROM_ZERO = Rule(0.0, 1.0)

POSE_RULES: Mapping[str, Rule] = {
    **dict.fromkeys("xyz", COORDINATE),
    **{f"quaternion.{axis}": TURN for axis in "xyz"},
    "quaternion.w": Rule(0.0, 1.0, digits=TURNS),
}
POSES = ("pose", "other_pose")
"""Columns of an outcome that hold where the obstacle ends, by either engine."""
OUTCOME_RULES: Mapping[str, Rule] = {
    "action": Rule(choices=OUTCOMES),
    "displacement_m": Rule(0.0, 1e4, digits=METRES),
    "path_steps_after": Rule(1),
    "path_m_after": Rule(0.0, 1e4, digits=METRES),
    "seconds": Rule(0.0, MAX_PUSH_S),
    "reason": Rule(choices=tuple(sorted({*PUSH_REASONS, *PICK_REASONS}))),
    **{f"{pose}.{n}": rule for pose in POSES for n, rule in POSE_RULES.items()},
    "reach_m.element": Rule(0.0, 1e4, digits=METRES),
    "reach_opened": Rule(1, MAX_REACH),
    "swept.element": Rule(0.0, 1e3, digits=2),
    "moved.element.obstacle": ID,
    "moved.element.object_id": ID,
    **{f"moved.element.pose.{n}": rule for n, rule in POSE_RULES.items()},
}
EXPERTS = ("expert", "blind_expert")
EXPERT_RULES = {
    "actions.element": Rule(0, 11),
    "steps": Rule(1, 500),
    "pushes": Rule(0, 500),
    "picks": Rule(0, 500),
    "path_m": Rule(0.0, 125.0, digits=2),
}
EPISODE_RULES: Mapping[str, Rule] = {
    "episode_id": Rule(pattern=r"scene-\d{6,}/\d{4,}"),
    "scene_id": SCENE,
    "split": SPLIT,
    "index": Rule(0),
    "seed": Rule(0),
    "room_count": Rule(1),
    "mode": Rule(choices=("blocked", "lengthened")),
    "rooms_on_path": Rule(1),
    "obstacle_count": Rule(1),
    "shortest_path_m": Rule(0.0, 1e4, digits=METRES),
    "shortest_path_steps": Rule(1),
    "obstructed_path_m": Rule(0.0, 1e4, digits=METRES),
    "obstructed_path_steps": Rule(1),
    "start.yaw_deg": Rule(choices=(0, 90, 180, 270)),
    "start.reachable_nodes": Rule(1),
    **{f"{end}.{axis}": Rule(0) for end in ("start", "goal") for axis in "ij"},
    **{f"{end}.{axis}": Rule(0.0, 1e4, digits=2) for end in ("start", "goal") for axis in "xy"},
    **{f"{end}.room": ID for end in ("start", "goal")},
    "room_paths.element.element": ID,
    "node_paths.element.doors.element": ID,
    **{f"node_paths.element.points.element.{axis}": COORDINATE for axis in "xy"},
    "obstacles.element.asset_id": NAME,
    "obstacles.element.type": NAME,
    **{f"obstacles.element.{name}": rule for name, rule in POSE_RULES.items()},
    "obstacles.element.mass_kg": MASS,
    "obstacles.element.friction": FRICTION,
    "obstacles.element.affordance": AFFORDANCE,
    "obstacles.element.node_path_segment": Rule(0),
    "obstacles.element.settle_s": FROM_ZERO,
    "obstacles.element.settle_penetration_m": FROM_ZERO,
    **{f"obstacles.element.outcomes.element.{n}": rule for n, rule in OUTCOME_RULES.items()},
    **{f"{name}.{part}": rule for name in EXPERTS for part, rule in EXPERT_RULES.items()},
    "physics.engine": NAME,
    "physics.build": WORDS,
    "physics.settle_s": FROM_ZERO,
    "physics.penetration_m": FROM_ZERO,
    "physics.other_engine": NAME,
    "physics.other_build": WORDS,
}
SCENE_RULES: Mapping[str, Rule] = {
    "scene_id": SCENE,
    "scene": Rule(0),
    "seed": Rule(0),
    "split": SPLIT,
    "preset": WORDS,
    **{f"outline.element.{axis}": COORDINATE for axis in "xy"},
    "rooms.element.room_id": ID,
    "rooms.element.type": NAME,
    **{f"rooms.element.polygon.element.{axis}": COORDINATE for axis in "xy"},
    "rooms.element.area_m2": Rule(1e-4, 1e6),
    "rooms.element.ceiling_m": Rule(1.8, 20.0),
    **{f"rooms.element.{surface}_material": WORDS for surface in ("floor", "wall")},
    "doors.element.door_id": ID,
    "doors.element.rooms.element": ID_OR_NONE,
    **{f"doors.element.{axis}": COORDINATE for axis in "xy"},
    "doors.element.width_m": SIZE,
    "doors.element.height_m": SIZE,
    "doors.element.kind": Rule(
        choices=("opening", "doorway", "single", "wide", "double", "entrance")
    ),
    "windows.element.window_id": ID,
    "windows.element.room": ID,
    "windows.element.width_m": SIZE,
    "windows.element.height_m": SIZE,
    "windows.element.sill_m": Rule(0.0, 20.0, digits=METRES),
    **{f"walls.element.{axis}_{end}": COORDINATE for axis in "xyz" for end in ("min", "max")},
    "objects.element.object_id": ID,
    "objects.element.asset_id": NAME,
    "objects.element.room": ID,
    **{f"objects.element.{axis}": COORDINATE for axis in "xyz"},
    **{f"objects.element.quaternion.{axis}": TURN for axis in "xyz"},
    "objects.element.quaternion.w": Rule(0.0, 1.0, digits=TURNS),
    "objects.element.group": ID_OR_NONE,
    "objects.element.support": ID_OR_NONE,
    "objects.element.dynamics.mass_kg": MASS,
    "objects.element.dynamics.friction": FRICTION,
    "objects.element.affordance": AFFORDANCE,
    "materials.element.name": WORDS,
    "materials.element.pattern": Rule(choices=PATTERNS),
    "room_graph.element.element": ID,
    "area_m2": Rule(1e-4, 1e6),
}
ASSET_RULES: Mapping[str, Rule] = {
    "asset_id": NAME,
    "type": NAME,
    **{f"size.{axis}": Rule(0.0, 100.0) for axis in "xyz"},
    "mass_kg": MASS,
    "friction": FRICTION,
    "parts.element.shape": Rule(choices=("box", "cylinder", "sphere", "hull")),
    **{f"parts.element.size.{axis}": Rule(0.0, 100.0) for axis in "xyz"},
    **{f"parts.element.rotation.{axis}": TURN for axis in "xyzw"},
    "parts.element.material": Rule(choices=PART_MATERIALS),
}
MAX_TEXT = 1000
"""Characters of a text."""
RULES = {"episodes": EPISODE_RULES, "scenes": SCENE_RULES, "assets": ASSET_RULES}


def leaves(table: pa.Table) -> Iterator[tuple[str, pa.Array]]:
    """Yield every leaf column: its dotted path and its values, missing ones left out."""
    for name in table.column_names:
        for chunk in table.column(name).chunks:
            yield from _leaves(name, chunk)


def _leaves(path: str, array: pa.Array) -> Iterator[tuple[str, pa.Array]]:
    array = array.drop_null() if array.null_count else array
    if pa.types.is_struct(array.type):
        for field, child in zip(array.type, array.flatten(), strict=True):
            yield from _leaves(f"{path}.{field.name}", child)
    elif pa.types.is_list(array.type):
        yield from _leaves(f"{path}.element", array.flatten())
    else:
        yield path, array


def check_ranges(table: pa.Table, name: str, report: FindingCollector) -> bool:
    """Check every value of a table by the rule of its column.

    Returns
    -------
    bool
        Whether all floats are as they should be: geometry of others may take any time and memory.

    """
    sound = True
    rules = RULES[name]
    turns: dict[str, list[np.ndarray[Any, Any]]] = {}
    for path, array in leaves(table):
        before = report.by_predicate.total()
        if pa.types.is_floating(array.type):
            values = array.to_numpy(zero_copy_only=False)
            _none(report, f"schema.{name}.{path}", "finite numbers", values[~np.isfinite(values)])
            stem, _, last = path.rpartition(".")
            if stem.endswith(("quaternion", "rotation")) and last in "xyzw":
                turns.setdefault(stem, []).append(values)
        if path in rules:
            _check_leaf(array, rules[path], f"schema.{name}.{path}", report)
        if pa.types.is_floating(array.type):
            sound &= before == report.by_predicate.total()
    for stem, parts in turns.items():
        # One chunk gives x, y, z and w in a row.
        for k in range(0, len(parts), 4):
            length = np.sqrt(sum(part * part for part in parts[k : k + 4]))
            wrong = length[np.abs(length - 1.0) > UNIT]
            _none(report, f"schema.{name}.{stem}", "a unit quaternion", wrong)
            sound &= len(wrong) == 0
    return sound


def _check_leaf(array: pa.Array, rule: Rule, predicate: str, report: FindingCollector) -> None:
    if pa.types.is_string(array.type):
        words = array.unique().to_pylist()
        long = [word[:MAX_TEXT] for word in words if len(word) > MAX_TEXT]
        _none(report, predicate, f"at most {MAX_TEXT} characters", long)
        if rule.choices:
            wrong = [word for word in words if word not in rule.choices]
            _none(report, predicate, f"one of {rule.choices}", wrong)
        if rule.pattern:
            wrong = [word for word in words if not re.fullmatch(rule.pattern, word)]
            _none(report, predicate, f"{rule.pattern}", wrong)
        return
    values = array.to_numpy(zero_copy_only=False)
    outside = values[(values < rule.low) | (values > rule.high)]
    _none(report, predicate, f"{rule.low:g} … {rule.high:g}", outside)
    if rule.choices:
        wrong = values[~np.isin(values, rule.choices)]
        _none(report, predicate, f"one of {rule.choices}", wrong)
    if rule.digits is not None:
        # A rounded value is the float nearest to its decimals.
        wrong = values[np.abs(np.round(values, rule.digits) - values) > 1e-9]  # noqa: PLR2004
        _none(report, predicate, f"{rule.digits} decimals", wrong)


def _none(report: FindingCollector, predicate: str, expected: str, wrong: Any) -> None:  # noqa: ANN401 - values of any column
    got = "" if len(wrong) == 0 else f"{wrong[0]} ({len(wrong)} such values)"
    report.expect(len(wrong) == 0, predicate, expected, got)
