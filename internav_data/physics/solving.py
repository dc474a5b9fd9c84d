"""Solutions of settles and pushes: the rule of rest and the pusher, on any engine.

An engine knows nothing of either: it steps scenes, and is read after every step.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from internav_data.geometry import centre_of_mass, multiply, rotation_matrix
from internav_data.physics.scene import PushSolution, SettleSolution
from internav_data.physics.sweep import bounding_radius_m, sweep_of
from internav_data.records import Pose

if TYPE_CHECKING:
    from internav_data.core.typing import Floats
    from internav_data.physics.engines.protocol import Engine, Simulation
    from internav_data.physics.scene import Body, PhysicsScene
    from internav_data.records import PushSpec, Quaternion, Vec3

    _Placement = tuple[Vec3, Quaternion]
    """Centre of mass and orientation of a body."""

RULES: Final = 5
"""Number of the rules by which scenes are built and solved, whatever the engine. Raised with every
change of results: a dataset of other rules is not taken for a wrong one."""
REST_SPEED: Final = 0.0003
"""Speed below which a body counts as slow, m/s."""
REST_SPIN: Final = 0.003
"""Angular speed below which a body counts as slow, rad/s."""
REST_S: Final = 0.04
"""Time for which a body must stay slow to be at rest, seconds."""
STEADY: Final = 0.8
"""Share of `REST_SPEED` and of `REST_SPIN` by which a velocity may change meanwhile: at most
6 mm/s² of acceleration. A swing turns slowly, too, and does not stay."""
WINDOW_S: Final = 0.1
"""Length of the windows in which bodies that are never calm are looked at, seconds."""
STILL_WINDOWS: Final = 2
"""Number of successive windows after which bodies are at rest that tremble in place: they drift no
faster than `REST_SPEED` and `REST_SPIN`. In one window alone a swing may turn."""
CREEP_WINDOWS: Final = 20
"""Number of windows (2 s) after which bodies are at rest that stay close to one pose. Jammed ones
creep for ever; one that creeps over an edge has fallen by then."""
CREEP_M: Final = 0.001
"""Distance of a pose that is close to another, metres."""
CREEP_RAD: Final = 0.005
"""Angle of a pose that is close to another, radians."""
SETTLE_LIMIT_S: Final = 1.0
"""Time limit of a settle, simulated seconds."""
PUSH_LIMIT_S: Final = 10.0
"""Time limit of a push after the release, simulated seconds; a body still rolling is left there."""


def solve_settle(engine: Engine, scene: PhysicsScene) -> SettleSolution:
    """Let the first body of a scene fall until it is at rest, for one second at most."""
    body = scene.bodies[0]
    radius = bounding_radius_m(body.asset)
    reach, steps, limit = 0.0, 0, round(SETTLE_LIMIT_S / engine.step_s)
    rest = _RestRule([0], engine.step_s)
    with engine.load(scene) as simulation:
        start, start_turn = simulation.placement(0)
        while steps < limit and not rest.holds:
            simulation.step()
            steps += 1
            rest.note(simulation, slow=_is_slow(simulation, 0), held=False)
            now, turn = simulation.placement(0)
            shift = math.hypot(now[0] - start[0], now[1] - start[1])
            # A bound for all corners: the shift of the centre of mass plus the arc of the farthest.
            reach = max(reach, shift + radius * _angle(start_turn, turn))
        return SettleSolution(
            pose=_pose(simulation, 0, body),
            seconds=steps * engine.step_s,
            at_rest=rest.holds,
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
    rest = _RestRule(moving, engine.step_s)
    steps = 0
    with engine.load(scene) as simulation:
        pusher.begin(simulation.placement(0)[0])
        rows = [simulation.row(moving)]
        while steps < limit and not rest.holds:
            pusher.act(simulation)
            count = 1 if pusher.holds else min(rest.steps_left, limit - steps)
            simulation.advance(moving, rows, count, rest.slow_m, REST_SPIN)
            done, steps = len(rows) - 1 - steps, len(rows) - 1
            slow = (
                not pusher.holds
                and all(_is_slow(simulation, k) for k in moving)
                and max(_shifts(simulation.placements(rows[-2:]))) < rest.slow_m
            )
            if rest.note(simulation, slow=slow, held=pusher.holds, steps=done):
                pusher.let_go()
        placements = simulation.placements(rows)
        sweeps, paths = zip(
            *(sweep_of(scene.bodies[k].asset, placements[:, n]) for n, k in enumerate(moving)),
            strict=True,
        )
        return PushSolution(
            poses=tuple(_pose(simulation, k, scene.bodies[k]) for k in moving),
            sweeps=sweeps,
            paths=paths,
            seconds=steps * engine.step_s,
            at_rest=rest.holds,
        )


def _shifts(placements: Floats) -> list[float]:
    """Return how far each body moved between two placements, (2, bodies, 7), metres."""
    before, after = placements[..., :3].tolist()
    return [math.dist(here, there) for here, there in zip(after, before, strict=True)]


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

    @property
    def holds(self) -> bool:
        """Whether the body is not let go yet."""
        return self.steps_left > 0

    def let_go(self) -> None:
        """Let go of the body."""
        self.steps_left = 0

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
            self.let_go()
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
            self.let_go()


class _Calm:
    """Rule by which bodies are calm: all slow for a while, without speeding up or slowing down."""

    def __init__(self, bodies: list[int], step_s: float) -> None:
        self._bodies, self._enough = bodies, round(REST_S / step_s)
        self._steps = 0
        """Number of slow steps in a row."""
        self._velocities: list[tuple[Vec3, Vec3]] = []
        """Velocities of the bodies after the first of these."""

    def note(self, simulation: Simulation, *, slow: bool) -> bool:
        """Take notice of whether all bodies were slow in a step; return whether they are calm."""
        if not slow:
            self._steps = 0
            return False
        self._steps += 1
        if self._steps in {1, self._enough}:
            before = self._velocities
            self._velocities = [simulation.velocity(k) for k in self._bodies]
            if self._steps > 1 and not all(map(_steady, before, self._velocities)):
                self._steps = 1
        return self._steps >= self._enough


class _RestRule:
    """Rule by which all bodies that move are at rest.

    A pushed one is let go, and all are calm, or have stayed in place for some windows of time.
    """

    def __init__(self, bodies: list[int], step_s: float) -> None:
        self._bodies = bodies
        self._calm = _Calm(bodies, step_s)
        self.slow_m = 10.0 * REST_SPEED * step_s
        """Distance in one step above which a body cannot be slow, metres."""
        self._window = round(WINDOW_S / step_s)
        self._steps, self._still, self._close, self._held = 0, 0, 0, True
        self._latest: list[_Placement] = []
        """Placements at the end of the latest window."""
        self._first: list[_Placement] = []
        """Placements to which the bodies have stayed close for `_close` windows."""
        self.holds = False
        """Whether all bodies are at rest."""

    @property
    def steps_left(self) -> int:
        """Number of steps after which they are looked at next."""
        return 1 if self._held else self._window - self._steps % self._window

    def note(self, simulation: Simulation, *, slow: bool, held: bool, steps: int = 1) -> bool:
        """Take notice of steps: whether all were slow in the last, and the first is still held.

        Parameters
        ----------
        simulation
            Scene in motion.
        slow
            Whether all bodies were slow in the last step. In the others of these some was not.
        held
            Whether the first body is still held.
        steps
            Number of steps since the last call, `steps_left` at most.

        Returns
        -------
        bool
            Whether the held body stays where it is: one that has not yielded by now never will.

        """
        if self._held and not held:
            self._look(simulation)
            self._steps, self._still, self._close, self._first = 0, 0, 0, self._latest
        self._held = held
        self._steps += steps
        if steps > 1:
            self._calm.note(simulation, slow=False)
        calm = self._calm.note(simulation, slow=slow)
        if self._steps % self._window == 0:
            self._look(simulation)
        if held:
            return self._still > 0
        stay = self._still >= STILL_WINDOWS or self._close >= CREEP_WINDOWS
        self.holds = calm or stay
        return False

    def _look(self, simulation: Simulation) -> None:
        """Look at how far the bodies have drifted since earlier windows."""
        now = [simulation.placement(k) for k in self._bodies]
        still = _close(self._latest, now, REST_SPEED * WINDOW_S, REST_SPIN * WINDOW_S)
        self._still = self._still + 1 if still else 0
        self._latest = now
        if _close(self._first, now, CREEP_M, CREEP_RAD):
            self._close += 1
        else:
            self._first, self._close = now, 0


def _close(before: list[_Placement], after: list[_Placement], far_m: float, far_rad: float) -> bool:
    """Return whether all placements differ by less than a distance and an angle; False for none."""
    return bool(before) and all(
        math.dist(here, there) < far_m and _angle(turn, turned) < far_rad
        for (here, turn), (there, turned) in zip(before, after, strict=True)
    )


def _steady(before: tuple[Vec3, Vec3], after: tuple[Vec3, Vec3]) -> bool:
    """Return whether a body's velocity and spin hardly changed."""
    return (
        math.dist(before[0], after[0]) < STEADY * REST_SPEED
        and math.dist(before[1], after[1]) < STEADY * REST_SPIN
    )


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
