"""Solutions of settles and pushes: the rule of rest and the pusher, on any engine.

An engine knows nothing of either: it steps scenes, and is read after every step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from internav_data.geometry import centre_of_mass, multiply, rotation_matrix
from internav_data.physics.scene import PushSolution, SettleSolution
from internav_data.physics.sweep import bounding_radius_m, sweep_recorder
from internav_data.records import Pose

if TYPE_CHECKING:
    from internav_data.physics.engines.protocol import Engine, Simulation
    from internav_data.physics.scene import Body, PhysicsScene
    from internav_data.physics.sweep import SweepRecorder
    from internav_data.records import PushSpec, Quaternion, Vec3

RULES: Final = 4
"""Number of the rules by which scenes are built and solved, whatever the engine. Raised with every
change of results: a dataset of other rules is not taken for a wrong one."""
REST_SPEED: Final = 0.001
"""Speed below which a body counts as slow, m/s."""
REST_SPIN: Final = 0.01
"""Angular speed below which a body counts as slow, rad/s."""
REST_STEPS: Final = 10
"""Number of successive slow steps after which a body is at rest."""
SETTLE_LIMIT_S: Final = 1.0
"""Time limit of a settle, simulated seconds."""
CREEP_STEPS: Final = 24
"""Interval at which trembling bodies are looked at, steps."""
PUSH_LIMIT_S: Final = 5.0
"""Time limit of a push after the release, simulated seconds; a body still rolling is left there."""


def solve_settle(engine: Engine, scene: PhysicsScene) -> SettleSolution:
    """Let the first body of a scene fall until it is at rest, for one second at most."""
    body = scene.bodies[0]
    radius = bounding_radius_m(body.asset)
    reach, calm, steps = 0.0, 0, 0
    limit = round(SETTLE_LIMIT_S / engine.step_s)
    with engine.load(scene) as simulation:
        start, start_turn = simulation.placement(0)
        while steps < limit and calm < REST_STEPS:
            simulation.step()
            steps += 1
            calm = calm + 1 if _is_slow(simulation, 0) else 0
            now, turn = simulation.placement(0)
            shift = math.hypot(now[0] - start[0], now[1] - start[1])
            # A bound for all corners: the shift of the centre of mass plus the arc of the farthest.
            reach = max(reach, shift + radius * _angle(start_turn, turn))
        return SettleSolution(
            pose=_pose(simulation, 0, body),
            seconds=steps * engine.step_s,
            at_rest=calm >= REST_STEPS,
            penetration_m=simulation.penetration_m(0),
            reach_m=reach,
        )


def solve_push(engine: Engine, scene: PhysicsScene, spec: PushSpec) -> PushSolution:
    """Push the first body of a scene along +x, release it, and step until all bodies are at rest.

    Bodies that move take part, the others stay.
    """
    moving = [k for k, body in enumerate(scene.bodies) if body.moves]
    pusher = _Pusher(spec, scene.bodies[0].dynamics.mass_kg, engine.step_s)
    limit = pusher.steps_left + round(PUSH_LIMIT_S / engine.step_s)
    recorders = [sweep_recorder(scene.bodies[k].asset, limit) for k in moving]
    movers = list(zip(moving, recorders, strict=True))
    rest = _RestRule(recorders, engine.step_s)
    steps = 0
    with engine.load(scene) as simulation:
        pusher.begin(simulation.placement(0)[0])
        for k, recorder in movers:
            recorder.follow(*simulation.placement(k))
        while steps < limit and not rest.holds:
            pusher.act(simulation)
            simulation.step()
            steps += 1
            slow = not pusher.steps_left
            for k, recorder in movers:
                shift = recorder.follow(*simulation.placement(k))
                # Asking for a speed costs time.
                slow = slow and shift < rest.slow_m and _is_slow(simulation, k)
            rest.note(slow=slow)
        return PushSolution(
            poses=tuple(_pose(simulation, k, scene.bodies[k]) for k in moving),
            sweeps=tuple(recorder.dop8 for recorder in recorders),
            paths=tuple(recorder.path for recorder in recorders),
            seconds=steps * engine.step_s,
            at_rest=rest.holds,
        )


class _Pusher:
    """The agent's hand on the first body, as a `PushSpec` moves it along +x."""

    def __init__(self, spec: PushSpec, mass_kg: float, step_s: float) -> None:
        self._spec = spec
        self._full = spec.force_n / mass_kg * step_s
        """Speed gained in one step of the full force, m/s; inf for a kick."""
        self._goal = math.inf
        """Where along x it lets go of a body that it holds at a speed, metres."""
        self.steps_left = round(spec.seconds / step_s)
        """Number of steps until the body is let go at the latest; 0 once it is."""

    def begin(self, middle: Vec3) -> None:
        """Take hold of the body, whose centre of mass is here."""
        if self._spec.distance_m:
            self._goal = middle[0] + self._spec.distance_m

    def act(self, simulation: Simulation) -> None:
        """Push for one step, or let go."""
        if not self.steps_left:
            return
        spec = self._spec
        speed, spin = simulation.velocity(0)
        if self._goal < math.inf and simulation.placement(0)[0][0] >= self._goal:
            self.steps_left = 0
            return
        self.steps_left -= 1
        missing = spec.speed_m_s - speed[0]
        if missing > self._full:
            simulation.apply_force(0, (spec.force_n, 0.0, 0.0))
        elif self._goal < math.inf:
            part = max(0.0, missing / self._full)
            simulation.apply_force(0, (part * spec.force_n, 0.0, 0.0))
        else:
            # The last impulse is scaled: it gives just the speed that is missing.
            simulation.set_velocity(0, (spec.speed_m_s, speed[1], speed[2]), spin)
            self.steps_left = 0


@dataclass(slots=True)
class _RestRule:
    """Rule by which all bodies of a push are at rest: slow for a while, or trembling in place."""

    recorders: list[SweepRecorder]
    step_s: float
    calm: int = 0
    """Number of slow steps in a row."""
    steps: int = 0
    holds: bool = False
    """Whether all bodies are at rest."""

    @property
    def slow_m(self) -> float:
        """Distance in one step above which a body cannot be slow, metres."""
        return 10.0 * REST_SPEED * self.step_s

    def note(self, *, slow: bool) -> None:
        """Take notice of a step: whether all bodies were slow in it."""
        self.steps += 1
        self.calm = self.calm + 1 if slow else 0
        self.holds = self.calm >= REST_STEPS
        if self.steps % CREEP_STEPS == 0:
            # Trembling counts as rest; a body that has not yielded to a constant push by now
            # never will.
            seconds = CREEP_STEPS * self.step_s
            far_m, far_rad = REST_SPEED * seconds, REST_SPIN * seconds
            crept = [recorder.crept(far_m, far_rad) for recorder in self.recorders]
            self.holds = self.holds or not any(crept)


def _is_slow(simulation: Simulation, body: int) -> bool:
    """Return whether a body's linear and angular speeds are those of a body at rest."""
    speed, spin = simulation.velocity(body)
    return math.hypot(*speed) < REST_SPEED and math.hypot(*spin) < REST_SPIN


def _pose(simulation: Simulation, number: int, body: Body) -> Pose:
    """Return the pose of the asset's frame from the placement of its centre of mass."""
    middle, turn = simulation.placement(number)
    offset = rotation_matrix(turn) @ centre_of_mass(body.asset)
    x, y, z = (float(p - o) for p, o in zip(middle, offset, strict=True))
    return Pose(x, y, z, (turn[0], turn[1], turn[2], turn[3]))


def _angle(first: Quaternion, second: Quaternion) -> float:
    """Return the angle between two orientations, radians."""
    inverse = (-first[0], -first[1], -first[2], first[3])
    x, y, z, w = multiply(inverse, second)
    return 2.0 * math.atan2(math.sqrt(x * x + y * y + z * z), abs(w))
