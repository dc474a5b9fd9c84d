"""Motions whose end a formula knows, on both engines: JSON on stdout.

    python benchmarks/closed_forms.py [--out FILE]

Lengths are in metres; errors are shares of the formula's value. `test_closed_forms.py` and
`test_push.py` in `tests/physics` hold the same motions within bounds.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data.physics import ENGINES, Body, PhysicsScene
from internav_data.physics.displacement import tilt_deg
from internav_data.physics.solving import solve_push
from internav_data.records import PUSH_SPECS, Asset, Part, Pose

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.physics.scene import PushSolution
    from internav_data.records import PushSpec, Vec3

NAMES = ("bullet", "mujoco")
GRAVITY = 9.81
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
STANDING = Pose(0.0, 0.0, 0.001, UPRIGHT)
KICK, FORCE = PUSH_SPECS["kick"], PUSH_SPECS["force"]
KICK_M_S = 2.0
LOW = (0.6, 0.5, 0.1)
"""Size of a crate that does not tip."""
TOPPLED_DEG = 45.0


def thing(size: Vec3, mass_kg: float, friction: float, shape: str = "box") -> Asset:
    """Return an asset of one part that stands on the floor."""
    part = Part(shape, (0.0, 0.0, size[2] / 2.0), size, UPRIGHT, (), (120, 90, 60), "wood")
    return Asset(
        asset_id="Thing_0",
        type="Thing",
        size=size,
        mass_kg=mass_kg,
        friction=friction,
        pushable=True,
        pickable=False,
        spawnable=True,
        blocks=True,
        parts=(part,),
    )


def solved(engine: str, spec: PushSpec, *bodies: Body) -> PushSolution:
    return solve_push(ENGINES[engine](), PhysicsScene(bodies), spec)


def pushed(engine: str, spec: PushSpec, asset: Asset) -> Pose:
    return solved(engine, spec, Body.of(asset, STANDING)).poses[0]


def kicks(engine: str) -> list[float]:
    """Return errors of slides of a kicked crate, of three frictions."""
    found = []
    for friction in (0.4, 0.6, 0.8):
        known = KICK_M_S**2 / (2.0 * friction * GRAVITY)
        found.append(pushed(engine, KICK, thing(LOW, 10.0, friction)).x / known - 1.0)
    return found


def forces(engine: str) -> list[float]:
    """Return errors of slides of crates that are pushed by a force, of 2 to 20 kg."""
    found = []
    for mass_kg in (2.0, 12.0, 20.0):
        for friction in (0.4, 0.6, 0.8):
            speedup = FORCE.force_n / mass_kg - friction * GRAVITY
            speed = min(FORCE.speed_m_s, speedup * FORCE.seconds)
            known = speed**2 / (2.0 * speedup) + speed**2 / (2.0 * friction * GRAVITY)
            found.append(pushed(engine, FORCE, thing(LOW, mass_kg, friction)).x / known - 1.0)
    return found


def too_heavy(engine: str) -> float:
    """Return the farthest that a crate moves which is 1 % too heavy, metres."""
    masses = [(f, 1.01 * FORCE.force_n / (f * GRAVITY)) for f in (0.4, 0.6, 0.8)]
    return max(abs(pushed(engine, FORCE, thing(LOW, mass, f)).x) for f, mass in masses)


def first(low: float, high: float, holds: Callable[[float], bool]) -> float:
    """Return the value between two from which on something holds, within half a per cent."""
    while high - low > 0.005:
        middle = (low + high) / 2.0
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high


def tips(engine: str) -> float:
    """Return the share of F h = m g b from which a box that friction holds tips 2 degrees."""
    side_m, mass_kg = 0.3, 30.0
    known_m = side_m * mass_kg * GRAVITY / FORCE.force_n

    def tilts(share: float) -> bool:
        box = thing((side_m, side_m, share * known_m), mass_kg, 0.8)
        body = Body.of(box, STANDING)
        simulation = PhysicsScene((body,))
        with ENGINES[engine]().load(simulation) as motion:
            for _ in range(round(FORCE.seconds / ENGINES[engine]().step_s)):
                motion.apply_force(0, (FORCE.force_n, 0.0, 0.0))
                motion.step()
                if tilt_deg(UPRIGHT, motion.placement(0)[1]) > 2.0:
                    return True
        return False

    return first(0.8, 2.0, tilts)


def topples(engine: str) -> list[float]:
    """Return the shares of µ = b / h from which what slides topples, two depths."""

    def falls(depth_m: float, share: float) -> bool:
        box = thing((depth_m, 0.5, share * depth_m / 0.6), 6.0, 0.6)
        return tilt_deg(UPRIGHT, pushed(engine, FORCE, box).quaternion) > TOPPLED_DEG

    return [first(0.8, 2.0, lambda share, d=depth: falls(d, share)) for depth in (0.24, 0.36)]


def rolled(engine: str) -> float:
    """Return how far a kicked ball goes beyond its slide, metres."""
    ball = thing((0.24, 0.24, 0.24), 0.6, 0.6, "sphere")
    path = np.frombuffer(solved(engine, KICK, Body.of(ball, STANDING)).paths[0], np.float32)
    return float(path.reshape(-1, 7)[-1, 0]) - KICK_M_S**2 / (2.0 * 0.6 * GRAVITY)


def collisions(engine: str) -> tuple[list[float], list[float]]:
    """Return errors of momentum, and restitutions, of three pairs of masses and four gaps."""
    momenta, restitutions = [], []
    for masses in ((2.0, 2.0), (10.0, 2.0), (2.0, 10.0)):
        for gap_m in (0.1, 0.102, 0.104, 0.106):
            one, other = (thing((0.3, 0.3, 0.3), mass, 0.0) for mass in masses)
            there = Body.of(other, Pose(0.3 + gap_m, 0.0, 0.001, UPRIGHT))
            with ENGINES[engine]().load(PhysicsScene((Body.of(one, STANDING), there))) as motion:
                motion.set_velocity(0, (1.5, 0.0, 0.0), (0.0, 0.0, 0.0))
                motion.step(48)
                speeds = [motion.velocity(k)[0][0] for k in (0, 1)]
            whole = masses[0] * speeds[0] + masses[1] * speeds[1]
            momenta.append(whole / (1.5 * masses[0]) - 1.0)
            restitutions.append((speeds[1] - speeds[0]) / 1.5)
    return momenta, restitutions


def on_another(engine: str) -> list[float]:
    """Return errors of the slide of a box on a slab, heavy or fixed: v² / 2 µ₁ µ₂ g."""
    slab, box = thing((3.0, 1.0, 0.2), 2000.0, 0.7), thing((0.4, 0.4, 0.1), 3.0, 0.8)
    known = KICK_M_S**2 / (2.0 * 0.7 * 0.8 * GRAVITY)
    found = []
    for moves in (True, False):
        below = Body.of(slab, Pose(1.0, 0.0, 0.001, UPRIGHT), moves=moves)
        above = Body.of(box, Pose(0.0, 0.0, 0.203, UPRIGHT))
        found.append(solved(engine, KICK, above, below).poses[0].x / known - 1.0)
    return found


def glances(engine: str) -> float:
    """Return the impulse along a wall by the one across it, of a disc with µ₁ µ₂ = 0.3."""
    wall = Body.of(thing((0.2, 4.0, 1.0), 10.0, 0.6), Pose(0.35, 0.0, 0.001, UPRIGHT), moves=False)
    disc = Body.of(thing((0.4, 0.4, 0.1), 2.0, 0.5, "cylinder"), Pose(0.0, 0.0, 0.5, UPRIGHT))
    with ENGINES[engine]().load(PhysicsScene((disc, wall))) as motion:
        motion.set_velocity(0, (1.0, 1.0, 0.0), (0.0, 0.0, 0.0))
        motion.step(30)
        (across, along, _), _ = motion.velocity(0)
    return (1.0 - along) / (1.0 - across)


def figures(engine: str) -> dict[str, Any]:
    """Return all figures of an engine."""
    momenta, restitutions = collisions(engine)
    found = {
        "kicked_slide_error": kicks(engine),
        "forced_slide_error": [min(errors := forces(engine)), max(errors)],
        "too_heavy_moves_m": too_heavy(engine),
        "held_box_tips_from": tips(engine),
        "sliding_box_topples_from": topples(engine),
        "ball_rolls_on_m": rolled(engine),
        "momentum_error": max(map(abs, momenta)),
        "restitution": [min(restitutions), max(restitutions)],
        "slide_on_another_error": on_another(engine),
        "glancing_impulse": glances(engine),
    }
    return {
        name: [round(v, 4) for v in value] if isinstance(value, list) else round(value, 4)
        for name, value in found.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    text = json.dumps({name: figures(name) for name in NAMES}, indent=1)
    if args.out:
        args.out.write_text(text + "\n", encoding="utf-8")
    sys.stdout.write(text + "\n")


if __name__ == "__main__":
    main()
