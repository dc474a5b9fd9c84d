"""Films of pushes on both engines, at 240 and at 960 Hz: a GIF and a sheet of pictures each.

    python benchmarks/engines.py --pushes 500 --out FILE
    python benchmarks/engine_films.py --of FILE --rows unequal --folder FOLDER

For the rows of `engines.py` in which the engines' labels differ (`unequal`), or whose ends lie
farthest apart (`farthest`). The picture is that of the bodies that take part, from above and from
the south where the push goes east: its outline is where the pushed object stood.
"""

from __future__ import annotations

import argparse
import json
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np

sys.path.append(str(Path(__file__).parent))
import engines

from internav_data.geometry import centre_of_mass, multiply, part_corners, rotation_matrix
from internav_data.physics import ENGINES, cache_disabled
from internav_data.physics.engines.protocol import Simulation
from internav_data.physics.solving import solve_push
from internav_data.records import Pose
from internav_data.views.canvas import Canvas
from internav_data.views.sheets import contact_sheet, write_png
from internav_data.views.silhouettes import paint, silhouettes
from internav_data.views.video import write_video

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.core.typing import Image
    from internav_data.physics import PhysicsScene
    from internav_data.physics.engines.protocol import Engine
    from internav_data.records import PushSpec

PICTURES = 6
"""Pictures of each engine on a sheet."""
FPS = 25.0
"""Frames of a film a second, at half speed."""
SIDE_PX = 230
WIDE_M = 3.2
"""Width of the floor that is shown, metres; 0.9 of it before the place where the push begins."""
VIEW = (-np.sin(0.48), 0.0, 0.0, np.cos(0.48))
"""Turn of all by 55 degrees about the east, so that what is seen from above was seen aslant."""
PAPER, GRID, INK = (250, 249, 246), (222, 220, 214), (60, 60, 70)


class Watched(Simulation):
    """A push on an engine: the poses of all bodies after every step."""

    def __init__(self, engine: Engine, scene: PhysicsScene, spec: PushSpec) -> None:
        self.name, self.step_s = engine.name, engine.step_s
        self.poses: list[list[Pose]] = []
        self._engine, self._scene = engine, scene
        solve_push(self, scene, spec)

    @contextmanager
    def load(self, scene: PhysicsScene) -> Iterator[Self]:
        """Load a scene; what is loaded is watched from here."""
        with self._engine.load(scene) as simulation:
            self._simulation = simulation
            self.placement, self.velocity = simulation.placement, simulation.velocity
            self.set_velocity, self.apply_force = simulation.set_velocity, simulation.apply_force
            self._note()
            yield self

    def step(self, count: int = 1) -> None:
        """Advance by a number of time steps."""
        self._simulation.step(count)
        self._note()

    def _note(self) -> None:
        now = []
        for k, body in enumerate(self._scene.bodies):
            pose = body.pose
            if body.moves:
                middle, turn = self._simulation.placement(k)
                x, y, z = middle - rotation_matrix(turn) @ np.array(centre_of_mass(body.asset))
                pose = Pose(float(x), float(y), float(z), turn)
            now.append(pose)
        self.poses.append(now)

    def at(self, seconds: float) -> list[Pose]:
        """Return the poses of all bodies at a time."""
        return self.poses[min(round(seconds / self.step_s), len(self.poses) - 1)]

    @property
    def seconds(self) -> float:
        """Simulated time until rest."""
        return (len(self.poses) - 1) * self.step_s


def aslant(pose: Pose) -> Pose:
    x, y, z = rotation_matrix(VIEW) @ np.array((pose.x, pose.y, pose.z))
    return Pose(float(x), float(y), float(z), multiply(VIEW, pose.quaternion))


def seen(points: np.ndarray) -> np.ndarray:
    return (points @ rotation_matrix(VIEW).T)[:, :2]


def picture(scene: PhysicsScene, poses: list[Pose], text: str) -> Image:
    """Return a picture, (h, w, 3) uint8 RGB, of the bodies of a scene at their poses.

    The floor has lines every half metre; bodies that stay are drawn by their lowest corners.
    """
    low = (-0.28 * WIDE_M, -0.5 * WIDE_M)
    canvas = Canvas(low, (low[0] + WIDE_M, low[1] + WIDE_M), SIDE_PX, PAPER)
    for k in np.arange(-4.0, 4.1, 0.5):
        for ends in (((k, -4.0, 0.0), (k, 4.0, 0.0)), ((-4.0, k, 0.0), (4.0, k, 0.0))):
            canvas.line(seen(np.array(ends)), GRID, 1.0)
    first = silhouettes(scene.bodies[0].asset, aslant(scene.bodies[0].pose))
    shown = []
    for body, pose in zip(scene.bodies, poses, strict=True):
        if body.moves:
            shown += silhouettes(body.asset, aslant(pose))
        else:
            for part in body.asset.parts:
                corners = part_corners(part) @ rotation_matrix(pose.quaternion).T
                on_floor = corners + np.array((pose.x, pose.y, pose.z))
                low_m = on_floor[:, 2].min()
                canvas.line(seen(on_floor[on_floor[:, 2] < low_m + 0.01]), INK, 1.2, closed=True)
    paint(canvas, shown, line_px=0.8, colour=None)
    for part in first:
        canvas.dashes(np.vstack([part.plan, part.plan[:1]]), (196, 36, 112), 1.0, 0.05)
    canvas.text((low[0] + 0.5 * WIDE_M, low[1] + 0.95 * WIDE_M), text, 8.0, INK)
    return canvas.finished()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--of", type=Path, required=True)
    parser.add_argument("--rows", choices=["unequal", "farthest"], default="unequal")
    parser.add_argument("--pushes", type=int, default=500)
    parser.add_argument("--push-model", default="force")
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--folder", type=Path, required=True)
    args = parser.parse_args()
    rows = json.loads(args.of.read_text(encoding="utf-8"))[args.rows]
    wanted = [(r["episode"], r["asset"], r["heading"]) for r in rows]
    fine = engines.fine_engines()
    made = [ENGINES[name]() for name in engines.NAMES] + list(fine.values())
    ENGINES.update({name: lambda engine=engine: engine for name, engine in fine.items()})
    for case in engines.cases(args.pushes, args.seed, args.push_model):
        key = (case.episode_id, case.world.items[case.index].asset.asset_id, case.heading)
        if key in wanted:
            film(case, made, args.folder / f"{wanted.index(key):02d}-{key[1]}")


def film(case: engines.Case, made: list[Engine], path: Path) -> None:
    """Write a GIF and a sheet of one push."""
    runs = []
    for engine in made:
        with cache_disabled(), engines.SolvedScenes((engine.name,)) as solved:
            case.result(engine.name)
        scene, spec = list(solved.scenes.items())[-1]
        runs.append((scene, Watched(engine, scene, spec)))
    last = max(run.seconds for _, run in runs)
    sheet, labels = [], []
    for scene, run in runs:
        for share in np.linspace(0.0, 1.0, PICTURES) ** 1.5:
            sheet.append(picture(scene, run.at(share * last), run.name))
            end = run.at(share * last)[0]
            labels.append(f"{share * last:.2f} s: x {end.x:.3f} y {end.y:.3f} z {end.z:.3f}")
    write_png(path.with_suffix(".png"), contact_sheet(sheet, PICTURES, labels))
    frames = (
        contact_sheet([picture(scene, run.at(at), run.name) for scene, run in runs], 2)
        for at in np.arange(0.0, last + 0.5, 0.5 / FPS)
    )
    write_video(path.with_suffix(".gif"), frames, FPS)


if __name__ == "__main__":
    main()
