from __future__ import annotations

import json
import shutil
import struct
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from builders import bounds_of

from internav_data.catalog import catalogue, load_user_assets, split_of_asset, user_assets
from internav_data.generation.run import check_standing
from internav_data.physics.engines.installed import available_engines
from internav_data.records.errors import UsageError

pybullet_data = pytest.importorskip("pybullet_data")
DATA = Path(pybullet_data.getDataPath())


def folder(tmp_path, name="thing.obj", toml="", mesh=None):
    import trimesh

    mesh = trimesh.creation.box((0.4, 0.6, 0.8)) if mesh is None else mesh
    if isinstance(mesh, bytes):
        (tmp_path / name).write_bytes(mesh)
    else:
        mesh.export(tmp_path / name)
    if toml:
        (tmp_path / "assets.toml").write_text(toml)
    return tmp_path


def check(asset):
    low, high = bounds_of(asset)
    w, d, h = asset.size
    np.testing.assert_allclose(low, (-w / 2, -d / 2, 0.0), atol=1e-6)
    np.testing.assert_allclose(high, (w / 2, d / 2, h), atol=1e-6)
    assert all(len(p.corners) <= 32 for p in asset.parts)
    assert all(v == round(v, 4) for p in asset.parts for c in p.corners for v in c)


@pytest.mark.parametrize("suffix", ["obj", "stl", "glb", "ply"])
def test_a_box_is_one_part(tmp_path, suffix):
    toml = '[default]\nmass_kg = 3\nup = "z"\n["thing.%s"]\nfriction = 0.5\npickable = true\n'
    (asset,) = load_user_assets(folder(tmp_path, f"thing.{suffix}", toml % suffix))
    check(asset)
    assert asset.asset_id == "Thing_user_thing"
    assert asset.size == (0.4, 0.6, 0.8)
    assert len(asset.parts) == 1
    assert (asset.mass_kg, asset.friction) == (3.0, 0.5)
    assert (asset.pushable, asset.pickable, asset.spawnable) == (False, True, True)


def test_up_and_scale(tmp_path):
    toml = '[default]\nup = "y"\nscale = 0.5\ntype = "Block"\n'
    (asset,) = load_user_assets(folder(tmp_path, toml=toml))
    assert asset.size == (0.2, 0.4, 0.3)
    assert asset.asset_id == "Block_user_thing"
    assert asset.pushable
    # By the digest of the name: another file in the folder would not change it.
    assert split_of_asset(asset) == "train"


def test_joins_the_catalogue(tmp_path):
    joined = catalogue((folder(tmp_path),))
    assert len(joined.spawnable) == 656
    assert joined.digest != catalogue().digest
    assert "Thing_user_thing" in joined.assets


def test_a_table_is_cut_into_parts_the_same_each_time(tmp_path):
    import trimesh

    pieces = [trimesh.creation.box((1, 0.6, 0.05)).apply_translation((0, 0, 0.7))]
    for x in (-0.45, 0.45):
        for y in (-0.25, 0.25):
            leg = trimesh.creation.box((0.06, 0.06, 0.7)).apply_translation((x, y, 0.34))
            pieces.append(leg)
    mesh = trimesh.util.concatenate(pieces)
    where = folder(tmp_path, mesh=mesh)
    (first,), (second,) = load_user_assets(where), load_user_assets(where)
    assert first == second
    assert len(first.parts) == 5
    check(first)


@pytest.mark.parametrize(
    ("toml", "words"),
    [
        ("[default]\nmas_kg = 2\n", ("mas_kg", "mass_kg")),
        ("[default]\nmass_kg = 0\n", ("mass_kg", "above 0")),
        ("[default]\nmass_kg = nan\n", ("mass_kg",)),
        ("[default]\nmass_kg = true\n", ("mass_kg", "float")),
        ("[default]\nfriction = 3\n", ("friction", "0 to 2")),
        ("[default]\nup = 'x'\n", ("up",)),
        ("[default]\nmax_parts = 0\n", ("max_parts",)),
        ("[default]\npushable = true\npickable = true\n", ("exclude",)),
        ("[default]\ntype = '../x'\n", ("type",)),
        ('["thin.obj"]\nmass_kg = 1\n', ("thin.obj", "thing.obj")),
        ('["../secret.obj"]\nmass_kg = 1\n', ("secret.obj",)),
        ("default = 3\n", ("table",)),
        ("[default\n", ("TOML",)),
        ("[default]\nscale = 1000\n", ("longest side", "scale")),
        ("[default]\nscale = 0.001\n", ("longest side", "scale")),
    ],
)
def test_what_is_wrong_in_the_toml_is_named(tmp_path, toml, words):
    with pytest.raises(UsageError) as caught:
        load_user_assets(folder(tmp_path, toml=toml))
    assert all(word in str(caught.value) for word in words)
    assert str(tmp_path) in str(caught.value)


FLAT = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"
CUT = b"\xff" * 80 + struct.pack("<I", 3) + b"\xff" * 100
HUGE = b"\0" * 80 + struct.pack("<I", 4_000_000_000)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("broken.glb", b"not a mesh at all", "cannot be read"),
        ("empty.obj", b"", "0 bytes"),
        ("points.obj", b"v 0 0 0\nv 1 1 1\n", "cannot be read as a mesh"),
        ("flat.obj", FLAT, "no volume"),
        ("zero.obj", FLAT + b"f 3/1 0/2 1/3\n", "corner 0"),
        ("cut.stl", HUGE, "84 bytes, its header of 4000000000 triangles means 200000000084"),
        ("cut.stl", CUT, "(184 bytes, its header of 3 triangles means 234)"),
        ("short.stl", b"\0\xff", "(2 bytes, a binary STL has 84 at least)"),
        (
            "nan.obj",
            b"v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\n",
            "corners that are not numbers",
        ),
    ],
)
def test_a_broken_file_is_named(tmp_path, name, content, words):
    with pytest.raises(UsageError) as caught:
        load_user_assets(folder(tmp_path, name, mesh=content))
    assert name in str(caught.value)
    assert words in str(caught.value)


CUBE = (DATA / "cube.obj").read_bytes()
NAMED_SOLID = b"solid St\xfcck\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
CUT_SOLID = b"solid".ljust(80) + struct.pack("<I", 3) + b"\xff" * 100


@pytest.mark.parametrize("guesses", [True, False], ids=["library that guesses", "no library"])
@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("latin.obj", b"# St\xfcck\n" + CUBE, "(not UTF-8 text)"),
        ("latin.stl", NAMED_SOLID, "(not UTF-8 text)"),
        ("latin.off", b"OFF # St\xfcck\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "(not UTF-8 text)"),
        ("cut.stl", CUT_SOLID, "(184 bytes, its header of 3 triangles means 234)"),
    ],
)
def test_encodings_are_not_guessed(tmp_path, monkeypatch, name, content, words, guesses):
    """trimesh guesses where `charset_normalizer` is installed, which is no dependency of ours."""
    found = {"encoding": "latin-1", "confidence": 1.0}
    library = SimpleNamespace(detect=lambda _: found) if guesses else None
    monkeypatch.setitem(sys.modules, "charset_normalizer", library)
    with pytest.raises(UsageError) as caught:
        load_user_assets(folder(tmp_path, name, mesh=content))
    assert f"{name}: cannot be read as a mesh {words}" in str(caught.value)


@pytest.mark.parametrize("header", [b"", b"solid thing"])
def test_a_binary_stl_may_say_solid(tmp_path, header):
    import trimesh

    content = trimesh.creation.box((0.2, 0.3, 0.4)).export(file_type="stl")
    (asset,) = load_user_assets(
        folder(tmp_path, "thing.stl", mesh=header.ljust(80, b"\0") + content[80:])
    )
    assert asset.size == (0.2, 0.3, 0.4)


def test_a_large_file_is_refused_before_it_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr(user_assets, "MAX_BYTES", 100)
    with pytest.raises(UsageError, match="fewer triangles"):
        load_user_assets(folder(tmp_path))


def test_links_out_of_the_folder_are_refused(tmp_path):
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "link.obj").symlink_to(folder(tmp_path) / "thing.obj")
    with pytest.raises(UsageError, match="plain file"):
        load_user_assets(inner)


def test_no_folder_and_no_mesh(tmp_path):
    with pytest.raises(UsageError, match="not a folder"):
        load_user_assets(tmp_path / "missing")
    with pytest.raises(UsageError, match="holds no mesh"):
        load_user_assets(tmp_path)


def test_two_files_of_one_name(tmp_path):
    folder(tmp_path)
    with pytest.warns(UserWarning, match=r"thing\.stl: would be named .*rename.*left out"):
        assert len(load_user_assets(folder(tmp_path, "thing.stl"))) == 1


def objects(count):
    found = sorted(DATA.glob("random_urdfs/*/*.obj"))
    return found[:: len(found) // count][:count]


@pytest.mark.parametrize("path", [DATA / "cube.obj", DATA / "duck_vhacd.obj", *objects(2)])
def test_real_meshes(tmp_path, path):
    shutil.copy(path, tmp_path)
    toml = f"[default]\nscale = {0.3 if path.parent == DATA else 0.05}\n"
    (tmp_path / "assets.toml").write_text(toml)
    (asset,) = load_user_assets(tmp_path)
    check(asset)


@pytest.mark.slow
def test_a_hundred_real_meshes(tmp_path):
    for path in objects(100):
        shutil.copy(path, tmp_path)
    (tmp_path / "assets.toml").write_text("[default]\nscale = 0.05\n")
    started = time.perf_counter()
    assets = load_user_assets(tmp_path)
    assert len(assets) == 100
    assert time.perf_counter() - started < 900
    for asset in assets:
        check(asset)


def test_lay_flat_turns_a_mesh_onto_its_broadest_face(tmp_path):
    import trimesh

    slab = trimesh.creation.box((0.6, 0.05, 0.8))
    slab.apply_transform(trimesh.transformations.rotation_matrix(0.5, (1.0, 0.3, 0.0)))
    (asset,) = load_user_assets(folder(tmp_path, toml="[default]\nlay_flat = true\n", mesh=slab))
    check(asset)
    assert asset.size[2] == pytest.approx(0.05, abs=1e-3)


def boxes(*each):
    import trimesh

    return trimesh.util.concatenate(
        [trimesh.creation.box(size).apply_translation(at) for size, at in each]
    )


TABLE = (
    ((1.0, 0.6, 0.05), (0.0, 0.0, 0.725)),
    *(((0.06, 0.06, 0.7), (x, y, 0.35)) for x in (-0.45, 0.45) for y in (-0.25, 0.25)),
)
"""A table of five boxes that touch."""


def test_bodies_that_touch_are_cut_apart_and_weigh_what_they_enclose(tmp_path):
    (asset,) = load_user_assets(folder(tmp_path, mesh=boxes(*TABLE)))
    check(asset)
    assert len(asset.parts) == 5
    volume = sum(np.prod(size) for size, _ in TABLE)
    assert asset.mass_kg == pytest.approx(200.0 * volume, rel=0.01)


def test_parts_of_another_volume_are_named(tmp_path):
    import trimesh

    ring = trimesh.creation.annulus(0.4, 0.5, 0.2)
    with pytest.warns(UserWarning, match=r"thing\.obj: its convex parts have .* times its volume"):
        load_user_assets(folder(tmp_path, mesh=ring, toml="[default]\nmax_parts = 1\n"))


def test_each_mesh_that_cannot_be_used_is_named_and_the_others_are_used(tmp_path):
    folder(tmp_path)
    (tmp_path / "link.obj").symlink_to(tmp_path / "thing.obj")
    (tmp_path / "._thing.obj").write_bytes(b"\0\5\26\7")
    nan = b"v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 2 3 4\n"
    (tmp_path / "nan.obj").write_bytes(nan)
    for name in ("\u0441\u0442\u0443\u043b.obj", "\u0441\u0442\u043e\u043b.obj"):
        shutil.copy(tmp_path / "thing.obj", tmp_path / name)
    with pytest.warns(UserWarning, match="left out") as caught:
        assets = load_user_assets(tmp_path)
    assert [asset.asset_id for asset in assets] == ["Mesh_user_mesh", "Thing_user_thing"]
    told = [str(each.message) for each in caught]
    assert len(told) == 4
    for words in ("macOS", "plain file", "not numbers", "rename"):
        assert sum(words in line for line in told) == 1


def test_byte_order_marks_are_read(tmp_path):
    folder(tmp_path)
    content = (tmp_path / "thing.obj").read_bytes()
    (tmp_path / "thing.obj").write_bytes(b"\xef\xbb\xbf" + content)
    (tmp_path / "assets.toml").write_bytes(b'\xef\xbb\xbf["thing.obj"]\nmass_kg = 3\n')
    (asset,) = load_user_assets(tmp_path)
    assert asset.mass_kg == 3.0


def glb(**scene):
    text = json.dumps({"asset": {"version": "2.0"}, **scene}).encode()
    text += b" " * (-len(text) % 4)
    chunk = struct.pack("<I", len(text)) + b"JSON" + text
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunk)) + chunk


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ({"meshes": [{"primitives": [{}] * 20_000}]}, "20000 primitives, at most 1000"),
        (
            {"meshes": [{"primitives": [{}] * 9}], "nodes": [{"mesh": 0}] * 500},
            "4500 primitives, at most 1000",
        ),
        ({"accessors": [{"count": 10**9}]}, "1000000000 corners"),
        ({"meshes": 3}, "no glTF"),
        ({"meshes": [{"primitives": [{}]}], "nodes": [{"mesh": 7}]}, "no glTF"),
        ({"extras": [[]] * 200_000}, "holds too much"),
    ],
)
def test_a_glb_that_takes_minutes_or_memory_is_refused_at_once(tmp_path, scene, words):
    started = time.process_time()
    with pytest.raises(UsageError, match=words):
        load_user_assets(folder(tmp_path, "thing.glb", mesh=glb(**scene)))
    assert time.process_time() - started < 5


def test_a_glb_with_a_triangle_of_no_corners_is_refused(tmp_path):
    import trimesh

    box = trimesh.creation.box((0.4, 0.6, 0.8))
    faces = box.faces.astype("<u4").tobytes()
    content = box.export(file_type="glb")
    assert content.count(faces) == 1
    broken = content.replace(faces, struct.pack("<I", 8) + faces[4:])
    with pytest.raises(UsageError, match="corners that it does not have"):
        load_user_assets(folder(tmp_path, "thing.glb", mesh=broken))


def test_an_obj_of_many_groups_is_refused(tmp_path):
    many = b"".join(b"\nusemtl m%d" % k for k in range(2000))
    with pytest.raises(UsageError, match="2000 groups, at most 1000"):
        load_user_assets(folder(tmp_path, mesh=many))


@pytest.mark.slow  # 330,000 triangles are cut into convex parts
def test_the_thinnest_and_the_densest_mesh_rest_in_every_engine(tmp_path):
    """MuJoCo refuses what is flat or has 200,000 faces: no part of ours is the one or the other."""
    import trimesh

    sphere = trimesh.creation.icosphere(7, 0.2)
    sphere.apply_scale((1.0, 1.0, 0.4))
    assert len(sphere.faces) > 200_000
    folder(tmp_path, "dense.stl", mesh=sphere)
    folder(tmp_path, "thin.stl", mesh=trimesh.creation.box((0.4, 0.3, 0.0011)))
    with pytest.warns(UserWarning, match="convex parts have"):
        assets = load_user_assets(tmp_path)
    assert len(assets) == 2
    for engine in available_engines():
        check_standing(assets, engine)
