"""Wheels of what is installed, asked of the package index: nothing is compiled on any machine.

On request: `make wheels`. It downloads 5 GB and keeps nothing.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
PLATFORMS = {
    "Linux x86-64": ["manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux2014_x86_64"],
    "Linux ARM64": ["manylinux_2_28_aarch64", "manylinux_2_27_aarch64", "manylinux2014_aarch64"],
    "macOS ARM64": ["macosx_14_0_arm64"],
    "Windows x86-64": ["win_amd64"],
}
"""Tags of wheels by the names of the README's table."""
COMPILED = (
    "numpy", "pyarrow", "numba", "llvmlite", "scipy", "shapely", "opencv-python-headless",
    "mujoco-core", "coacd", "rtree", "safetensors", "torch",
)  # fmt: skip
"""Packages of the extra `all` that are not plain Python."""


def pinned(package):
    found = re.search(rf"^{package}==(\S+)$", (ROOT / "constraints.txt").read_text(), re.MULTILINE)
    return found[1]


def download(folder, packages, python=None, tags=()):
    """Download the pinned wheels of packages for a machine; return the line that says what failed.

    `pip index versions` would cost less, but lists what would have to be compiled too.
    """
    target = [word for tag in tags for word in ("--platform", tag)]
    target += ["--implementation", "cp", "--python-version", python] if python else []
    words = ["download", "--no-deps", "--no-cache-dir", "--only-binary=:all:", "--dest", folder]
    words += [*target, *(f"{package}=={pinned(package)}" for package in packages)]
    done = subprocess.run(
        [sys.executable, "-m", "pip", *map(str, words)], capture_output=True, text=True, check=False
    )
    shutil.rmtree(folder)
    failed = [line for line in done.stderr.splitlines() if line.startswith("ERROR: No matching")]
    return "" if done.returncode == 0 else " ".join(failed) or done.stderr


@pytest.fixture(scope="module", autouse=True)
def _index(tmp_path_factory):
    if download(tmp_path_factory.mktemp("index"), ["networkx"]):
        pytest.skip("the package index does not answer")


@pytest.mark.parametrize("python", PYTHONS)
@pytest.mark.parametrize("platform", PLATFORMS)
def test_every_compiled_package_has_a_wheel(platform, python, tmp_path):
    assert download(tmp_path / "all", COMPILED, python, PLATFORMS[platform]) == ""
    failed = download(tmp_path / "bullet", ["pybullet"], python, PLATFORMS[platform])
    if (platform, python) == ("Linux x86-64", "3.11"):
        assert failed == ""
    else:  # as its marker in pyproject.toml says
        assert failed == f"ERROR: No matching distribution found for pybullet=={pinned('pybullet')}"
