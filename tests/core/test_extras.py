"""Half installations: what is missing is named with the extra that brings it."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from internav_data.core.extras import DISTRIBUTIONS, EXTRAS, install_command, require

ROOT = Path(__file__).parents[2]
BLOCK = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in BLOCKED:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
import importlib.util
found = importlib.util.find_spec
importlib.util.find_spec = lambda name, *a: None if name in BLOCKED else found(name, *a)
sys.meta_path.insert(0, Missing())
"""
"""Takes modules away from a process, as if they were not installed."""
DOORS = {
    "numba": "import internav_data as i; i.generate_house()",
    "scipy": "from internav_data.verification import validate",
    "pybullet": "import internav_data as i; i.generate_episodes(i.generate_house())",
    "platformdirs": "import internav_data as i; i.generate_episodes(i.generate_house())",
    "shapely": "from internav_data.verification import validate",
    "networkx": "from internav_data.verification import validate",
    "cv2": "from internav_data.views import draw_house",
    "torch": "from internav_data import load_agent",
    "safetensors": "from internav_data import export_agent",
    "gymnasium": "import internav_data.envs",
    "trimesh": "from internav_data.catalog import *; asset_mesh(catalogue().spawnable[0])",
}
"""What a user does in Python, by a module that it needs."""
COMMANDS = {
    "numba": ("generate", "--scenes", "1", "--rooms", "1", "--workers", "1"),
    "scipy": ("assets", "--sheet", "sheet.png"),
    "pybullet": ("generate", "--scenes", "1", "--rooms", "1", "--workers", "1"),
    "platformdirs": ("generate", "--scenes", "1", "--rooms", "1", "--workers", "1"),
    "shapely": ("validate", "nothing"),
    "networkx": ("validate", "nothing"),
    "cv2": ("show", "--rooms", "1"),
}


def without(tmp_path, module, code, *arguments):
    """Run code in a process that lacks a module, and that has the others of its extra."""
    for other in (name for name, extra in EXTRAS.items() if extra == EXTRAS.get(module)):
        pytest.importorskip(other)
    (tmp_path / "sitecustomize.py").write_text(f"BLOCKED = {{{module!r}}}{BLOCK}")
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False,
        timeout=300, cwd=tmp_path, env=os.environ | {"PYTHONPATH": path},
    )  # fmt: skip


def missing_line(module):
    """Return what the error of a missing module says; one of an engine names the engine."""
    if module == "pybullet":
        return f": {install_command(module)}"
    return f"{module} is missing: {install_command(module)}"


def requirements(extra):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = project["optional-dependencies"][extra] if extra else project["dependencies"]
    return [Requirement(line) for line in lines]


def packages_of(extra):
    """Names of what an extra installs on every machine."""
    return {each.name for each in requirements(extra) if each.marker is None}


MACHINES = [
    (python, system, machine)
    for python in ("3.11", "3.12", "3.13", "3.14")
    for system, machine in (
        ("linux", "x86_64"),
        ("linux", "aarch64"),
        ("darwin", "arm64"),
        ("win32", "AMD64"),
    )
]


@pytest.mark.parametrize("machine", MACHINES, ids="-".join)
def test_bullet_is_installed_where_it_has_a_wheel_and_nowhere_else(machine):
    """pybullet 3.2.7 has wheels up to CPython 3.11, for manylinux2014 on x86-64 alone."""
    names = dict(
        zip(("python_version", "sys_platform", "platform_machine"), machine, strict=True),
        platform_python_implementation="CPython",
    )
    (bullet,) = [each for each in requirements("generate") if each.name == "pybullet"]
    assert bullet.marker.evaluate(names) == (machine == ("3.11", "linux", "x86_64"))
    assert not bullet.marker.evaluate({**names, "platform_python_implementation": "PyPy"})
    (asked,) = requirements("bullet")
    assert (asked.name, asked.specifier, asked.marker) == ("pybullet", bullet.specifier, None)


@pytest.mark.parametrize("extra", sorted(set(EXTRAS.values())))
def test_extras_are_those_of_the_project(extra):
    named = {DISTRIBUTIONS.get(module, module) for module, e in EXTRAS.items() if e == extra}
    assert named == packages_of(extra)


def test_every_third_party_import_is_in_the_table():
    known = {*sys.stdlib_module_names, *EXTRAS, "internav_data", "internav_cli"}
    known |= {
        "_typeshed",
        "llvmlite",
        "pandas",
    }  # of type checkers, part of numba, asked for by users
    for path in [*(ROOT / "internav_data").rglob("*.py"), *(ROOT / "cli").rglob("*.py")]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module]
            assert {name.partition(".")[0] for name in names} <= known, path


def test_require_names_the_extra():
    require("numpy", "pyarrow")
    asked = {
        "torch": "[train]",
        "nowhere_to_be_found": "nowhere_to_be_found",
        "numpy": "internav-data",
    }
    for module, extra in asked.items():
        assert extra in install_command(module)
    with pytest.raises(ModuleNotFoundError, match=r"nowhere_to_be_found is missing: pip install"):
        require("nowhere_to_be_found")


@pytest.mark.parametrize(
    "module",
    [
        "torch",
        "gymnasium",
        *(
            pytest.param(module, marks=pytest.mark.slow)
            for module in DOORS.keys() - {"torch", "gymnasium"}
        ),
    ],
)
def test_python_names_the_missing_extra(tmp_path, module):
    done = without(tmp_path, module, DOORS[module])
    last = done.stderr.strip().splitlines()[-1]
    assert last.partition(":")[0].endswith("Error")
    assert missing_line(module) in last, done.stderr


@pytest.mark.parametrize(
    "module",
    [pytest.param(module, marks=pytest.mark.slow) for module in COMMANDS if module != "cv2"]
    + ["cv2"],
)
def test_commands_name_the_missing_extra_in_a_line(tmp_path, module):
    done = without(
        tmp_path, module, "from internav_cli.main import main; main()", *COMMANDS[module]
    )
    assert done.returncode == 1
    lines = [line for line in done.stderr.splitlines() if not line.startswith("dataset: ")]
    assert len(lines) == 1, done.stderr
    assert missing_line(module) in lines[0]


def test_commands_without_click_say_so_in_a_line(tmp_path):
    done = without(tmp_path, "click", "from internav_cli.main import main; main()", "--help")
    assert done.returncode == 1
    assert done.stderr == f"the commands need click: {install_command('click')}\n"


@pytest.mark.parametrize(
    ("module", "command", "words"),
    [
        ("torch", "camp_train", ("nothing", "--preset", "small")),
        ("safetensors", "camp_train", ("nothing", "--preset", "small")),
        ("cv2", "camp_eval", ("random", "nothing")),
    ],
)
def test_the_trainer_names_the_missing_extra_in_a_line(tmp_path, module, command, words):
    done = without(tmp_path, module, f"from internav_cli.{command} import main; main()", *words)
    lines = done.stderr.strip().splitlines()
    assert (done.returncode, len(lines)) == (1, 1), done.stderr
    assert f"{module} is missing: {install_command(module)}" in lines[0]
