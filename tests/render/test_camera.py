"""Pictures agree with a ray caster, and depend on nothing but their own view."""

import subprocess
import sys
import threading

import numpy as np
import pytest
from camera_oracle import cast, scene

from internav_data import generate_house
from internav_data.catalog import catalogue
from internav_data.geometry import yaw_quaternion
from internav_data.navigation import Lattice
from internav_data.records import Pose
from internav_data.records.errors import UsageError
from internav_data.render import asset_mesh
from internav_data.render.camera import Camera, CameraView, Props, StaticScene

SIZE = 48


@pytest.fixture(scope="module", params=[(7, 2), (7, 4), (3, 5), (11, 7)])
def house(request):
    seed, number = request.param
    return generate_house(seed=seed, scene=number)


def some_views(house, props=None, count=6):
    scenery = StaticScene.of(house)
    props = scenery.props() if props is None else props
    rng = np.random.default_rng(house.scene)
    free = np.argwhere(Lattice.of(house).free)
    out = []
    for k in range(count):
        i, j = free[rng.integers(len(free))]
        horizon = (30.0, 0.0, 60.0, -30.0)[k % 4]
        out.append(
            CameraView(scenery, props, 0.25 * i, 0.25 * j, 90.0 * int(rng.integers(4)), horizon)
        )
    return out


def litter(house, count):
    """Obstacles that lie about, tilted, not all on the floor."""
    rng = np.random.default_rng(house.scene + 1)
    free = np.argwhere(Lattice.of(house).free)
    assets = catalogue().spawnable
    out = []
    for _ in range(count):
        i, j = free[rng.integers(len(free))]
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        pose = Pose(0.25 * i, 0.25 * j, float(rng.uniform(0, 1)), tuple(quaternion.tolist()))
        out.append((assets[int(rng.integers(len(assets)))], pose))
    return out


def objects(house):
    return [(house.assets[t.asset_id], t.pose) for t in house.objects]


def same(a, b):
    return all(np.array_equal(x, y) for x, y in zip(a, b, strict=True))


def test_depth_and_ids_agree_with_a_ray_caster(house):
    obstacles = litter(house, 5)
    instances = [*objects(house), *obstacles]
    views = some_views(house, Props(instances), 5)
    triangles, labels = scene(house, instances)
    frames = Camera(SIZE).render(views)
    wrong = 0
    for k, view in enumerate(views):
        depth, ids = cast(triangles, labels, view, SIZE)
        close = np.abs(frames.depth[k] - depth) < 1e-3 * depth
        wrong += int((~close | (frames.ids[k] != ids)).sum())
    assert wrong <= 0.005 * len(views) * SIZE * SIZE


def test_a_picture_depends_on_its_view_alone(house):
    views = some_views(house)
    camera = Camera(SIZE)
    together = camera.render(views)
    single = [Camera(SIZE).render([view]) for view in views]
    backwards = camera.render(views[::-1])
    for k in range(len(views)):
        picture = [x[k] for x in together]
        assert same(picture, [x[0] for x in single[k]])
        assert same(picture, [x[len(views) - 1 - k] for x in backwards])


def test_leaving_out_rooms_behind_walls_changes_nothing(house):
    views = some_views(house, count=24)
    assert same(Camera(SIZE).render(views), Camera(SIZE, portals=False).render(views))


def test_no_picture_has_a_crack(house):
    frames = Camera(64).render(some_views(house, count=24))
    assert (frames.ids != 0).all()
    assert (frames.depth < 60.0).all()
    assert (frames.depth > 0.05).all()


def seen(frames, number):
    return int((frames.ids == number).sum())


def test_what_is_held_is_gone_and_what_moves_moves(house):
    scenery = StaticScene.of(house)
    asset = catalogue().of_type("Box")[0]
    free = Lattice.of(house).free
    # With room ahead: a wall would hide the box.
    i, j = np.argwhere(free[:-4] & free[1:-3] & free[2:-2] & free[3:-1] & free[4:])[0]
    props = scenery.props([(asset, Pose(0.25 * i, 0.25 * j, 1.2, yaw_quaternion(0.0)))])
    number = len(house.objects) + 1
    view = CameraView(scenery, props, 0.25 * i, 0.25 * j, 0.0, 60.0)
    ahead = Pose(0.25 * i + 0.6, 0.25 * j, 0.9, yaw_quaternion(30.0))
    props.move(len(house.objects), ahead)
    camera = Camera(SIZE)
    with_box = camera.render([view])
    assert seen(with_box, number) > 20
    props.hide(len(house.objects))
    without = camera.render([view])
    assert seen(without, number) == 0
    assert same(
        without, camera.render([CameraView(scenery, scenery.props(), view.x, view.y, 0.0, 60.0)])
    )
    props.show(len(house.objects))
    assert same(with_box, camera.render([view]))
    other = props.copy()
    other.move(len(house.objects), Pose(ahead.x, ahead.y, -5.0, ahead.quaternion))
    assert seen(camera.render([CameraView(scenery, other, view.x, view.y, 0.0, 60.0)]), number) == 0
    assert same(with_box, camera.render([view]))


def test_buffers_are_used_again(house):
    views = some_views(house, count=3)
    camera = Camera(SIZE)
    out = camera.frames(5)
    assert camera.render(views, out) is out
    assert same([x[:3] for x in out], camera.render(views))
    with pytest.raises(UsageError, match=r"Camera\.frames"):
        Camera(SIZE).render(views, Camera(SIZE + 1).frames(3))
    with pytest.raises(UsageError, match="at least 1"):
        Camera(0)


@pytest.mark.slow
def test_other_processes_draw_the_same_bytes():
    code = (
        "import hashlib\n"
        "from test_camera import some_views, generate_house, Camera\n"
        "f = Camera(48).render(some_views(generate_house(seed=7, scene=2)))\n"
        "print(hashlib.sha256(b''.join(x.tobytes() for x in f)).hexdigest())\n"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True,
            env={"PYTHONPATH": __file__.rsplit("/", 1)[0], "NUMBA_NUM_THREADS": n},
        ).stdout
        for n in ("1", "2")
    }  # fmt: skip
    assert len(digests) == 1


def test_an_asset_that_comes_while_the_mesh_is_made_is_in_the_next_one(monkeypatch):
    first, second, *_ = catalogue().assets.values()
    library, join = asset_mesh.Library(), asset_mesh.mesh_of
    comes = threading.Thread(target=lambda: library.number(second))

    def slow(models):
        found = join(models)
        if comes.ident is None:
            comes.start()
            comes.join(0.3)
        return found

    monkeypatch.setattr(asset_mesh, "mesh_of", slow)
    library.number(first)
    assert library.mesh
    comes.join()
    both = join([asset_mesh.model_of(asset) for asset in (first, second)])
    assert len(library.mesh.vertices) == len(both.vertices)
