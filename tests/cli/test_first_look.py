"""`internav-data`: the demo, the check of the machine, and half installations."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from internav_data.dataset.location import MINI_FOLDER
from internav_data.physics.engines import DEFAULT_ENGINE

PROGRAM = [sys.executable, "-c", "from internav_cli.data import main; main()"]


def run(*words, **env):
    return subprocess.run(
        [*PROGRAM, *map(str, words)], capture_output=True, text=True, check=False, timeout=600,
        env=os.environ | env,
    )  # fmt: skip


def test_its_commands_have_examples():
    from internav_cli.data import cli

    assert set(cli.commands) == {"demo", "doctor"}
    assert all("Examples:" in command.epilog for command in cli.commands.values())


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from internav_cli.data import main\n"
        "try: main(['demo', '--help'])\n"
        "except SystemExit: pass\n"
        "print(sorted({'numpy', 'pyarrow', 'numba', 'pybullet', 'cv2'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_doctor_names_engines_and_the_version():
    done = run("doctor")
    assert done.returncode == 0, done.stderr
    assert "ok   internav-data: " in done.stdout
    assert f"ok   engine {DEFAULT_ENGINE} (the default): " in done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete_it(shell):
    done = run(_INTERNAV_DATA_COMPLETE=f"{shell}_source")
    assert "_internav_data_completion" in done.stdout


def test_the_demo_goes_through_its_commands(tmp_path, monkeypatch):
    """Each is one of `internav-gen`, with its options; the shipped dataset stands for a new one."""
    from internav_cli import data, main
    from internav_cli.data import cli

    monkeypatch.setattr(data, "SHEET_HOUSES", 1)

    called = []

    def stand_in(words, **_):
        context = main.cli.get_command(None, words[0]).make_context(words[0], list(words[1:]))
        called.append(context.info_name)
        if context.info_name == "generate":
            shutil.copytree(MINI_FOLDER, context.params["out"])

    monkeypatch.setattr(main.cli, "main", stand_in)
    done = CliRunner().invoke(cli, ["demo", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert called == ["generate", "validate", "stats", "show", "show", "show", "replay", "view"]
    assert (tmp_path / "houses.png").stat().st_size > 10_000
    assert f"$ internav-gen validate {tmp_path}/dataset" in done.output


@pytest.mark.parametrize("others", [("mujoco",), ()])
def test_the_demo_takes_another_engine_where_the_default_one_is_missing(
    tmp_path, monkeypatch, others
):
    from internav_cli import main
    from internav_cli.data import cli

    called = []
    monkeypatch.setattr("internav_data.physics.engines.DEFAULT_ENGINE", "bullet")
    monkeypatch.setattr("internav_data.physics.engines.installed.available_engines", lambda: others)
    monkeypatch.setattr(main.cli, "main", lambda words, **_: called.append(words) or 1)
    done = CliRunner().invoke(cli, ["demo", "--out", str(tmp_path)])
    (words,) = called
    # Without any engine, `generate` says in a line what to install.
    assert words[-2:] == (("--physics", *others) if others else ("--episodes-per-scene", "5"))
    assert ("bullet, is not installed: mujoco takes its place" in done.output) == bool(others)


def test_the_demo_ends_where_a_command_fails(tmp_path, monkeypatch):
    from internav_cli import main
    from internav_cli.data import cli

    monkeypatch.setattr(main.cli, "main", lambda words, **_: 3 * (words[0] == "validate"))
    done = CliRunner().invoke(cli, ["demo", "--out", str(tmp_path)], standalone_mode=False)
    assert done.return_value == 3
    assert "stats" not in done.output


def test_commands_read_the_dataset_that_ships(tmp_path):
    code = "from internav_cli.main import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "stats", "mini"], capture_output=True, text=True, check=False,
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0
    assert done.stderr == f"dataset: {MINI_FOLDER} (ships with internav-data)\n"


@pytest.mark.slow
def test_the_demo_makes_pictures_and_films(tmp_path):
    done = run("demo", "--out", tmp_path, "--scenes", 10)
    assert done.returncode == 0, done.stderr
    made = {path.name for path in Path(tmp_path).iterdir()}
    pictures = {"house.png", "blocked.png", "lengthened.png", "houses.png"}
    assert made == {"dataset", "page.html", "replay.gif", "replay.mp4", *pictures}


def test_a_dataset_that_is_not_finished_is_named_so(tmp_path):
    from internav_cli.main import cli

    folder = shutil.copytree(MINI_FOLDER, tmp_path / "d")
    words = ["stats", str(folder), "--json"]
    assert CliRunner().invoke(cli, words).stderr == f"dataset: {folder}\n"
    (folder / ".work").mkdir()
    (folder / ".work" / "merging.json").write_text("{}")
    said = CliRunner().invoke(cli, words).stderr
    assert (
        said == f"dataset: {folder}; unfinished: its first scenes, until what makes it has ended\n"
    )
