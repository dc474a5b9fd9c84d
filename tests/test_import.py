"""Cost of imports: the package needs nothing, the loader numpy and pyarrow."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

HEAVY = {
    "pybullet",
    "mujoco",
    "torch",
    "numba",
    "cv2",
    "shapely",
    "networkx",
    "scipy",
    "trimesh",
    "coacd",
}
HEAVY |= {"pandas", "matplotlib", "click", "duckdb", "polars", "gymnasium"}


def modules_after(code: str) -> set[str]:
    script = f"import sys\n{code}\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=300
    )
    return {name.split(".")[0] for name in done.stdout.splitlines()[-1].split()}


def test_import_needs_the_standard_library_alone():
    before = modules_after("import typing, importlib")
    new = modules_after("import internav_data") - before
    assert new - sys.stdlib_module_names == {"internav_data"}


def test_loader_needs_numpy_and_pyarrow_alone():
    before = modules_after("import typing, importlib, numpy, pyarrow, pyarrow.parquet")
    new = modules_after("from internav_data import load_dataset") - before
    assert not new & HEAVY
    third_party = {name for name in new - sys.stdlib_module_names if name[0] != "_"}
    assert third_party == {"internav_data"}


def test_reading_imports_nothing_heavy(tmp_path, hand_house, hand_episode):
    from internav_data.dataset import (
        Identity,
        assemble,
        open_staging,
        stage_quarantine,
        stage_scene,
    )

    out = tmp_path / "d"
    identity = Identity("test", "1", 0, 1, "0", {})
    staging = open_staging(out, identity)
    stage_scene(staging, 3, hand_house, [hand_episode])
    for scene in range(3):
        stage_quarantine(staging, scene, "none", split="train", attempts=1)
    assemble(out, identity, tuple(hand_house.assets.values()), 4)
    code = f"""
from internav_data import load_dataset
ds = load_dataset({str(out)!r}, filters=[("index", ">=", 0)])
assert list(ds) == list(ds.iterable()) == [ds[0]]
assert ds.scene(ds[0].scene_id).assets
assert len(ds.to_table()) == 1
"""
    # pyarrow imports pandas by itself where that is installed.
    assert not modules_after(code) & (HEAVY - {"pandas"})


@pytest.mark.parametrize("package", ["camp", "evaluation", "physics"])
def test_public_names_of_a_room_are_lazy(package):
    """Each can be imported from the room, and importing the room alone imports nothing heavy."""
    if package == "camp":
        pytest.importorskip("torch")
    module = importlib.import_module(f"internav_data.{package}")
    for name in module.__all__:
        assert getattr(module, name) is not None
    assert set(module.__all__) <= set(dir(module))
    before = modules_after("import typing, importlib")
    new = modules_after(f"import internav_data.{package}") - before
    assert new - sys.stdlib_module_names == {"internav_data"}


def test_evaluation_needs_no_torch():
    assert "torch" not in modules_after("from internav_data import evaluate")


def test_facade_names_what_it_has():
    import internav_data

    assert set(internav_data.__all__) <= set(dir(internav_data))
    with pytest.raises(AttributeError, match="no_such_name"):
        internav_data.no_such_name  # noqa: B018 - the access is the test


def test_actions_and_names_of_engines_need_nothing_heavy():
    code = """
from internav_data.episodes import EpisodeConfig
from internav_data.physics import ENGINES
from internav_data.physics.config import PhysicsConfig
from internav_data.world import ACTIONS, Action, StepResult
EpisodeConfig().check()
PhysicsConfig().check()
"""
    assert not modules_after(code) & HEAVY


@pytest.mark.parametrize(
    "package",
    ["internav_data"]
    + [
        f"internav_data.{room}"
        for room in (
            *("camp", "dataset", "envs", "episodes", "evaluation", "generation", "houses"),
            *("interop", "physics", "verification", "viewer", "views", "world"),
        )
    ],
)
def test_every_public_name_is_there(package):
    pytest.importorskip("torch")
    module = importlib.import_module(package)
    for name in module.__all__:
        assert getattr(module, name) is not None, name


def test_push_and_settle_are_functions_whatever_was_imported_before():
    """A module that were called like one of them would hide it once it is imported."""
    import internav_data.physics.pushing
    import internav_data.physics.settling
    from internav_data.physics import push, settle

    assert push is internav_data.physics.pushing.push
    assert settle is internav_data.physics.settling.settle


def test_the_lowest_versions_are_those_that_the_package_states():
    root = Path(__file__).parents[1]
    project = tomllib.loads((root / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    stated = [*project["dependencies"], *extras["generate"], *extras["meshes"], *extras["train"]]
    lines = (root / "constraints-lowest.txt").read_text().splitlines()
    lowest = dict(line.split("==") for line in lines if not line.startswith("#"))
    bounds = dict(re.match(r"([\w-]+)>=([\d.]+)", each).groups() for each in stated)
    assert bounds["pybullet"] == re.match(r"pybullet>=([\d.]+)", *extras["bullet"])[1]
    assert lowest.keys() == bounds.keys()
    del lowest["torch"]  # the page says why
    for name, version in lowest.items():
        assert f"{version}.".startswith(f"{bounds[name]}."), name
        assert not version.removeprefix(bounds[name]).strip(".0") or name.startswith("opencv")
