"""The camera against Bullet's TinyRenderer: the same house, the same eyes, in turns.

    python benchmarks/camera.py [--seed 7] [--scene 2] [--views 64] [--out FILE]

Frames a second on one core, colour, depth and ids each: ours at 300x300, 84x84 and 64x64,
TinyRenderer at 300x300 and 64x64 with the same triangles, without shadows or textures. `stages_us`
says where our time goes: Python around a picture, culling and drawing, shading.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from internav_data import generate_house
from internav_data.catalog import asset_mesh
from internav_data.navigation import SPACING_M, Lattice
from internav_data.records.agent import AGENT
from internav_data.render.asset_mesh import LIBRARY
from internav_data.render.camera import Camera, CameraView, StaticScene, camera_axes
from internav_data.render.frame import picture
from internav_data.render.shading import shade

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.records import House

TARGETS = {"times_tiny_renderer_300": 12.0, "frames_per_s_64": 4000.0}


def views_of(house: House, count: int, seed: int) -> list[CameraView]:
    """Free lattice nodes, quarter turns, the agent's horizons."""
    scenery = StaticScene.of(house)
    props = scenery.props()
    rng = np.random.default_rng(seed)
    free = np.argwhere(Lattice.of(house).free)
    out = []
    for _ in range(count):
        i, j = free[int(rng.integers(len(free)))]
        yaw, horizon = 90.0 * int(rng.integers(4)), (30.0, 30.0, 0.0, 60.0)[int(rng.integers(4))]
        out.append(CameraView(scenery, props, SPACING_M * i, SPACING_M * j, yaw, horizon))
    return out


def rate(work: Callable[[], object], frames: int, seconds: float) -> list[float]:
    """Frames a second of each of some runs."""
    rates = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(rates) < 3:
        begin = time.process_time()
        work()
        rates.append(frames / (time.process_time() - begin))
    return rates


def bullet_scene(house: House) -> Any:  # noqa: ANN401 - pybullet is untyped
    """Load a house's walls, floor and things as visual shapes; return the client's module."""
    import pybullet

    pybullet.connect(pybullet.DIRECT)

    for w in house.walls:
        half = [(w.x_max - w.x_min) / 2, (w.y_max - w.y_min) / 2, (w.z_max - w.z_min) / 2]
        shape = pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=half)
        centre = [(w.x_max + w.x_min) / 2, (w.y_max + w.y_min) / 2, (w.z_max + w.z_min) / 2]
        pybullet.createMultiBody(0, -1, shape, centre)
    xs, ys = [p[0] for p in house.outline], [p[1] for p in house.outline]
    half = [(max(xs) - min(xs)) / 2, (max(ys) - min(ys)) / 2, 0.05]
    shape = pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=half)
    for z in (-0.05, max(r.ceiling_m for r in house.rooms) + 0.05):
        centre = [(max(xs) + min(xs)) / 2, (max(ys) + min(ys)) / 2, z]
        pybullet.createMultiBody(0, -1, shape, centre)
    for thing in house.objects:
        mesh = asset_mesh(house.assets[thing.asset_id])
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH, vertices=mesh.vertices.tolist(),
            indices=mesh.faces.ravel().tolist(), rgbaColor=[0.7, 0.6, 0.5, 1.0],
        )  # fmt: skip
        position = [thing.x, thing.y, thing.z]
        pybullet.createMultiBody(0, -1, shape, position, thing.quaternion)
    return pybullet


def tiny(client: Any, view: CameraView, size: int) -> None:  # noqa: ANN401 - pybullet is untyped
    """Draw one view with TinyRenderer: colour, depth and segmentation."""
    yaw, down = math.radians(view.yaw_deg), math.radians(view.horizon_deg)
    eye = [view.x, view.y, AGENT.camera_height_m]
    ahead = [math.cos(yaw) * math.cos(down), math.sin(yaw) * math.cos(down), -math.sin(down)]
    target = [e + a for e, a in zip(eye, ahead, strict=True)]
    look = client.computeViewMatrix(eye, target, [0.0, 0.0, 1.0])
    lens = client.computeProjectionMatrixFOV(90.0, 1.0, 0.05, 30.0)
    client.getCameraImage(size, size, look, lens, renderer=client.ER_TINY_RENDERER, shadow=0)


def stages_of(camera: Camera, view: CameraView) -> dict[str, float]:
    """Microseconds one picture takes in Python, in culling and drawing, and in shading."""
    out = camera.frames(1)
    camera.render([view], out)
    scratch = camera._scratch
    assert scratch is not None
    axes = camera_axes(view.yaw_deg, view.horizon_deg)
    eye = np.array((view.x, view.y, view.z))
    structure, props, middle = view.scene.structure, view.props, camera.size / 2.0
    images = (out.rgb[0], out.depth[0], out.ids[0])
    moved = (props.models, props.poses, props.present)
    portals = True

    def drawing() -> Any:  # noqa: ANN401 - numba's
        return picture(
            structure.mesh, structure.rooms, LIBRARY.mesh, *moved, axes, eye, portals,
            scratch, *images,
        )  # fmt: skip

    def shading() -> None:
        scratch.prepared[:] = 0
        shade(
            structure.mesh, structure.rooms.labels, LIBRARY.mesh, scratch.frames, axes, eye[2],
            middle, middle, scratch.inverse, scratch.shadow, scratch.faces, scratch.drawn,
            scratch.prepared, scratch.records, *images,
        )  # fmt: skip

    whole = best_of(lambda: camera.render([view], out))
    kernel, colour = best_of(drawing), best_of(shading)
    return {
        "python": whole - kernel, "draw": kernel - colour, "shade": colour,
        "faces": float(drawing()),
    }  # fmt: skip


def stages(views: list[CameraView], size: int) -> dict[str, float]:
    """Average the stages of some views."""
    camera = Camera(size)
    each = [stages_of(camera, view) for view in views]
    return {name: round(float(np.mean([e[name] for e in each])), 1) for name in each[0]}


def best_of(work: Callable[[], object]) -> float:
    """Microseconds of processor time, best of seven."""
    times = []
    for _ in range(7):
        begin = time.process_time()
        work()
        times.append(time.process_time() - begin)
    return 1e6 * min(times)


def frame_rates(house: House, views: list[CameraView], seconds: float) -> dict[str, list[float]]:
    """Return frames per second of our camera and of Bullet's renderer, by name and size."""
    client = bullet_scene(house)
    rates: dict[str, list[float]] = {}
    for size in (300, 84, 64):
        camera, whole = Camera(size), Camera(size, portals=False)
        buffers = camera.frames(len(views))
        camera.render(views, buffers)
        # Both in turns, so that a busy machine slows both.
        for _ in range(2):
            rates.setdefault(f"ours_{size}", []).extend(
                rate(lambda c=camera, b=buffers: c.render(views, b), len(views), seconds)
            )
            few = views[:6]
            if size != 84:
                rates.setdefault(f"tiny_{size}", []).extend(
                    rate(lambda s=size, f=few: [tiny(client, v, s) for v in f], len(few), 0.5)
                )
        rates[f"ours_without_portals_{size}"] = rate(
            lambda c=whole, b=buffers: c.render(views, b), len(views), 0.5
        )
    return rates


def main() -> int:
    """Measure, print JSON, return 1 when a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--scene", type=int, default=2)
    parser.add_argument("--views", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=2.0, help="least time a figure takes")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()

    house = generate_house(seed=options.seed, scene=options.scene)
    views = views_of(house, options.views, options.seed)
    triangles = sum(len(asset_mesh(house.assets[t.asset_id]).faces) for t in house.objects)
    result: dict[str, Any] = {
        "scene": {
            "seed": options.seed, "scene": options.scene, "rooms": len(house.rooms),
            "things": len(house.objects), "triangles": triangles + 12 * len(house.walls),
        },
        "views": len(views),
    }  # fmt: skip
    rates = frame_rates(house, views, options.seconds)
    best = {name: max(values) for name, values in rates.items()}
    result["frames_per_s"] = {name: round(value, 1) for name, value in best.items()}
    result["frames_per_s_median"] = {
        name: round(float(np.median(values)), 1) for name, values in rates.items()
    }
    figures = {
        "times_tiny_renderer_300": round(best["ours_300"] / best["tiny_300"], 1),
        "times_tiny_renderer_64": round(best["ours_64"] / best["tiny_64"], 1),
        "frames_per_s_64": round(best["ours_64"], 1),
    }
    missed = [name for name, least in TARGETS.items() if figures[name] < least]
    result["stages_us"] = {size: stages(views[:32], size) for size in (300, 64)}
    result.update(figures=figures, targets=TARGETS, missed=missed)
    text = json.dumps(result, indent=2)
    print(text)
    if options.out is not None:
        options.out.write_text(text + "\n", encoding="utf-8")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
