"""Kernels compile without a home and in a package that cannot be written."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from internav_data.physics.engines import DEFAULT_ENGINE

COMMAND = "import sys; from internav_cli.main import main; sys.exit(main(sys.argv[1:]))"
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def read_only_package(tmp_path_factory):
    """The package with a file in place of every folder of caches: root writes anywhere else."""
    folder = tmp_path_factory.mktemp("package")
    for package in (ROOT / "internav_data", ROOT / "cli" / "internav_cli"):
        copy = folder / package.name
        shutil.copytree(package, copy, ignore=shutil.ignore_patterns("__pycache__"))
        for place in (copy, *(each for each in copy.rglob("*") if each.is_dir())):
            (place / "__pycache__").touch()
    return folder


def run(package, tmp_path, *words, **changes):
    (tmp_path / "file").touch()
    variables = {
        **os.environ, "PYTHONPATH": str(package), "HOME": str(tmp_path / "file" / "home"),
        "TMPDIR": str(tmp_path),
    }  # fmt: skip
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "INTERNAV_CACHE_DIR"):
        variables.pop(name, None)
    variables = {name: word for name, word in (variables | changes).items() if word is not None}
    return subprocess.run(
        [sys.executable, *words],
        capture_output=True,
        text=True,
        env=variables,
        cwd=tmp_path,
        check=False,
    )


WHERE = (
    "import os, internav_data.records, numba\n"
    "from internav_data.render import rasterise\n"
    "from numba.core.dispatcher import Dispatcher\n"
    "kernel = next(v for v in vars(rasterise).values() if isinstance(v, Dispatcher))\n"
    "print(kernel._cache.cache_path)"
)


@pytest.mark.parametrize("numba_first", [False, True])
def test_kernels_are_kept_in_a_temporary_folder_where_nothing_else_is(
    read_only_package, tmp_path, numba_first
):
    script = f"import numba\n{WHERE}" if numba_first else WHERE
    done = run(read_only_package, tmp_path, "-c", script)
    assert done.returncode == 0, done.stderr
    folder = Path(done.stdout.strip()).parent
    assert folder == tmp_path / f"internav-numba-{os.getuid()}"
    assert folder.stat().st_mode & 0o777 == 0o700
    assert not done.stderr


def test_a_folder_of_somebody_else_is_not_believed(read_only_package, tmp_path):
    planted = tmp_path / f"internav-numba-{os.getuid()}"
    planted.mkdir()
    planted.chmod(0o777)
    done = run(read_only_package, tmp_path, "-c", WHERE)
    assert done.returncode == 0, done.stderr
    folder = Path(done.stdout.strip()).parent
    assert folder.parent == tmp_path
    assert folder != planted


def test_a_home_or_a_package_that_can_be_written_is_left_to_numba(read_only_package, tmp_path):
    (tmp_path / "home").mkdir()
    done = run(read_only_package, tmp_path, "-c", WHERE, HOME=str(tmp_path / "home"))
    assert str(tmp_path / "home" / ".cache" / "numba") in done.stdout
    script = "import os, internav_data; print(os.environ.get('NUMBA_CACHE_DIR'))"
    assert run(ROOT, tmp_path, "-c", script).stdout.strip() == "None"


def test_doctor_says_where_kernels_lie(read_only_package, tmp_path):
    done = run(read_only_package, tmp_path, "-c", COMMAND, "doctor")
    assert "bug" not in done.stdout + done.stderr
    assert "kernels are kept in" in done.stdout, done.stderr


@pytest.mark.slow
def test_everything_runs_without_a_home(read_only_package, tmp_path):
    generate = (
        "generate", "--physics", DEFAULT_ENGINE,
        "--out", "d", "--scenes", "1", "--episodes-per-scene", "1",
    )  # fmt: skip
    for words in ((*generate, "--rooms", "1"), ("show", "d", "--scene", "0", "--out", "h.png")):
        done = run(read_only_package, tmp_path, "-c", COMMAND, *words)
        assert done.returncode == 0, done.stderr
    script = (
        "from internav_data.envs import InterNavEnv; env = InterNavEnv('d', 16)\n"
        "env.reset(seed=0); print(env.step(1)[1])"
    )
    done = run(read_only_package, tmp_path, "-c", script)
    assert done.returncode == 0, done.stderr
