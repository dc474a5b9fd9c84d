"""Truth of the physics engines, by pushes of generated houses: JSON on stdout.

    python benchmarks/engines.py --pushes 500 --out FILE

Each push is made on every engine: as it is, at 960 Hz, with its object's start moved by 1 mm, and
with its object's friction 5 % higher. The figures say how often a label (success, opened, reason)
is another one; how far ends lie apart; and what a step, a push and the build of a scene cost, where
its shapes are new and where they are known.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import time
from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

sys.path.append(str(Path(__file__).parent))
import holds

from internav_data.physics import ENGINES, cache, cache_disabled, push
from internav_data.physics.displacement import tilt_deg
from internav_data.physics.engines.bullet import Bullet
from internav_data.physics.engines.bullet_scene import Builder, pybullet
from internav_data.physics.engines.mujoco import MuJoCo
from internav_data.physics.engines.mujoco_scene import ModelBuilder
from internav_data.physics.solving import solve_push
from internav_data.world import WorldConfig

if TYPE_CHECKING:
    from internav_data.physics import Body, PhysicsScene, PushResult
    from internav_data.physics.engines.protocol import Engine
    from internav_data.physics.scene import PushSolution
    from internav_data.records import PushSpec
    from internav_data.world import World

NAMES = ("bullet", "mujoco")
FINE_HZ = 960
SHIFT_M = 0.001
ROUGHER = 1.05
LABELS = ("success", "opened", "reason")


def fine_engines() -> dict[str, Engine]:
    """Return engines with a fourth of the time step, by their names."""
    folder, step_s = Path(tempfile.mkdtemp(prefix="internav-engines-")), 1.0 / FINE_HZ
    builder = Builder(pybullet.connect(pybullet.DIRECT), folder, step_s=step_s)
    return {
        f"bullet {FINE_HZ}": Bullet(builder, name=f"bullet {FINE_HZ}"),
        f"mujoco {FINE_HZ}": MuJoCo(ModelBuilder(step_s=step_s), name=f"mujoco {FINE_HZ}"),
    }


@dataclass(frozen=True)
class Case:
    """A push of an object of a generated house."""

    world: World
    episode_id: str
    index: int
    heading: int

    def result(self, engine: str, change: str = "") -> PushResult:
        """Return the push on an engine: as it is, or with one value changed."""
        body = changed(self.world.body(self.index), change)
        return push(
            body,
            self.heading,
            lambda dop8: self.world.near(dop8, self.index),
            self.world.push_spec,
            engine=engine,
        )

    def label(self, pushed: PushResult, blocked: bool) -> dict[str, Any]:
        """Return what a dataset would store of a push: success, whether it opened, the reason."""
        opened = False
        if pushed.success and blocked:
            there = self.world.copy()
            there.put([(self.index, pushed.pose), *pushed.moved])
            opened = there.path_steps() is not None
        return {"success": pushed.success, "opened": opened, "reason": pushed.reason}


def changed(body: Body, change: str) -> Body:
    if change == "shift":
        return replace(body, pose=replace(body.pose, x=body.pose.x + SHIFT_M))
    if change == "friction":
        rougher = replace(body.dynamics, friction=ROUGHER * body.dynamics.friction)
        return replace(body, dynamics=rougher)
    return body


def cases(count: int, seed: int, push_model: str) -> list[Case]:
    """Gather pushes of obstacles: one of each, along a heading that alternates."""
    found: list[Case] = []
    for world, episode in holds.made(seed, WorldConfig(push_model=push_model)):
        for index in world.obstacles:
            if world.items[index].dynamics.pushable:
                found.append(Case(world, episode.episode_id, index, len(found) % 4))
                if len(found) == count:
                    return found
    return found


def apart_m(one: PushResult, other: PushResult) -> float:
    return math.dist((one.pose.x, one.pose.y), (other.pose.x, other.pose.y))


def asked(case: Case) -> dict[str, Any]:
    """Return all that is compared of one push."""
    blocked = case.world.path_steps() is None
    row: dict[str, Any] = {
        "episode": case.episode_id,
        "asset": case.world.items[case.index].asset.asset_id,
        "type": case.world.items[case.index].asset.type,
        "heading": case.heading,
        "blocked": blocked,
    }
    base: dict[str, PushResult] = {}
    for name in NAMES:
        results = {"": case.result(name)}
        results["fine"] = case.result(f"{name} {FINE_HZ}")
        results |= {change: case.result(name, change) for change in ("shift", "friction")}
        base[name] = results[""]
        row[name] = {
            change: case.label(pushed, blocked)
            | {
                "displacement_m": pushed.displacement_m,
                "seconds": pushed.seconds,
                "at_rest": pushed.at_rest,
                "toppled": pushed.toppled,
                "tilt_deg": tilt_deg(
                    case.world.items[case.index].pose.quaternion, pushed.pose.quaternion
                ),
                "moved": len(pushed.moved),
                "from_base_m": apart_m(pushed, results[""]),
                "end": (round(pushed.pose.x, 4), round(pushed.pose.y, 4)),
            }
            for change, pushed in results.items()
        }
    alone = push(
        case.world.body(case.index),
        case.heading,
        lambda _: (),
        case.world.push_spec,
        engine="bullet",
    )
    row["lone"] = alone.pose == base["bullet"].pose and not base["bullet"].moved
    row["apart_m"] = apart_m(base["bullet"], base["mujoco"])
    return row


def agreement(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return how often the engines' labels are the same, and how far their ends lie apart."""
    distances = [row["apart_m"] for row in rows]
    found: dict[str, Any] = {"pushes": len(rows)}
    for label in LABELS:
        some = [row for row in rows if label != "opened" or row["blocked"]]
        same = sum(row["bullet"][""][label] == row["mujoco"][""][label] for row in some)
        found[f"{label}_agrees"] = round(same / len(some), 4) if some else None
    for name in NAMES:
        far = [row[name][""]["displacement_m"] for row in rows]
        found[f"{name}_displacement_m"] = quantiles(far)
        found[f"{name}_success"] = round(float(np.mean([r[name][""]["success"] for r in rows])), 4)
        found[f"{name}_at_rest"] = round(float(np.mean([r[name][""]["at_rest"] for r in rows])), 4)
        found[f"{name}_toppled"] = round(float(np.mean([r[name][""]["toppled"] for r in rows])), 4)
    return found | {"apart_m": quantiles(distances)}


def quantiles(values: list[float]) -> dict[str, float]:
    cuts = {"10": 0.1, "50": 0.5, "90": 0.9}
    return {name: round(float(np.quantile(values, cut)), 4) for name, cut in cuts.items()}


def flips(rows: list[dict[str, Any]], name: str, change: str) -> dict[str, Any]:
    """Return how many labels of an engine another time step, start or friction makes others."""
    found: dict[str, Any] = {
        label: sum(row[name][""][label] != row[name][change][label] for row in rows)
        for label in LABELS
    }
    return found | {"apart_m": quantiles([row[name][change]["from_base_m"] for row in rows])}


class SolvedScenes:
    """Scenes that are solved inside by some engines, with what they are solved for."""

    def __init__(self, names: tuple[str, ...] = NAMES) -> None:
        self.names = names
        self.scenes: dict[PhysicsScene, PushSpec] = {}
        self._solve = cache.solve_push

    def __enter__(self) -> Self:
        def watched(engine: Engine, scene: PhysicsScene, spec: PushSpec) -> PushSolution:
            if engine.name in self.names:
                self.scenes[scene] = spec
            return self._solve(engine, scene, spec)

        cache.solve_push = watched
        return self

    def __exit__(self, *_: object) -> None:
        cache.solve_push = self._solve


def rates(scenes: dict[PhysicsScene, PushSpec], limit: int) -> dict[str, Any]:
    """Return what steps, pushes and builds cost each engine: processor time, this process."""
    found: dict[str, Any] = defaultdict(dict)
    lone = [scene for scene in scenes if len(scene.bodies) == 1][:limit]
    crowded = [scene for scene in scenes if len(scene.bodies) > 1][:limit]
    for kind, some in (("lone", lone), ("crowded", crowded)):
        for name in NAMES:
            engine = ENGINES[name]()
            for shapes in ("new_shapes", "known_shapes"):
                if shapes == "new_shapes" and isinstance(engine, MuJoCo):
                    engine.builder.models.clear()
                began, steps = time.process_time(), 0.0
                for scene in some:
                    steps += solve_push(engine, scene, scenes[scene]).seconds / engine.step_s
                used = time.process_time() - began
                built = build_ms(engine, some, known=shapes == "known_shapes")
                found[kind] |= {
                    f"{name}_{shapes}": {
                        "scenes": len(some),
                        "push_ms": round(1e3 * used / len(some), 3),
                        "build_ms": round(built, 3),
                        "steps": round(steps / len(some), 1),
                        "step_us": round(
                            (1e6 * used / len(some) - 1e3 * built) * len(some) / steps, 2
                        ),
                    }
                }
    return dict(found)


def build_ms(engine: Engine, scenes: list[PhysicsScene], *, known: bool) -> float:
    if not known and isinstance(engine, MuJoCo):
        engine.builder.models.clear()
    total = 0.0
    for scene in scenes:
        if known:
            with engine.load(scene):
                pass
        began = time.process_time()
        with engine.load(scene):
            pass
        total += time.process_time() - began
    return 1e3 * total / len(scenes)


def by_type(rows: list[dict[str, Any]]) -> dict[str, Any]:
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["type"]].append(row)
    return {kind: agreement(groups[kind]) for kind in sorted(groups)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pushes", type=int, default=100)
    parser.add_argument("--push-model", default="force")
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--timed", type=int, default=150, help="scenes of each kind that are timed")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()

    made = cases(args.pushes, args.seed, args.push_model)
    ENGINES.update({name: lambda engine=engine: engine for name, engine in fine_engines().items()})
    with cache_disabled(), SolvedScenes() as solved:
        rows = [asked(case) for case in made]
    groups = {
        kind: [r for r in rows if r["lone"] == (kind == "lone")] for kind in ("lone", "crowded")
    }
    unequal = [r for r in rows if any(r["bullet"][""][k] != r["mujoco"][""][k] for k in LABELS)]
    far = sorted((r for r in rows if r not in unequal), key=lambda r: -r["apart_m"])[:20]
    result = {
        "pushes": len(rows),
        "push_model": args.push_model,
        "all": agreement(rows),
        **{kind: agreement(some) for kind, some in groups.items() if some},
        "types": by_type(rows),
        "flips": {
            name: {change: flips(rows, name, change) for change in ("fine", "shift", "friction")}
            for name in NAMES
        },
        "fine_agrees": {
            label: sum(r["bullet"]["fine"][label] == r["mujoco"]["fine"][label] for r in rows)
            for label in LABELS
        },
        "reasons": Counter(
            f"{r['bullet']['']['reason'] or 'success'} / {r['mujoco']['']['reason'] or 'success'}"
            for r in unequal
        ),
        "rates": rates(solved.scenes, args.timed),
        "unequal": unequal,
        "farthest": far,
    }
    text = json.dumps(result, indent=1)
    if args.out:
        args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
