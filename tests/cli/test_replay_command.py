import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
from stderr_lines import beside_the_dataset

GEN = Path(sys.executable).with_name("internav-gen")


def run(*words, cwd=None):
    process = subprocess.run(
        [GEN, *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        cwd=cwd,
        env=os.environ,
        timeout=300,
    )
    assert "Traceback" not in process.stderr
    return process


def refused(process, code, *words):
    assert process.returncode == code, process.stderr
    assert process.stdout == ""
    (line,) = beside_the_dataset(process.stderr)
    for word in words:
        assert word in line


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    """Three scenes of one room: val, test and train."""
    out = tmp_path_factory.mktemp("replay") / "data"
    words = ("--scenes", 3, "--episodes-per-scene", 2, "--rooms", 1, "--workers", 1)
    made = run("generate", "--out", out, *words)
    assert made.returncode == 0, made.stderr
    return out


def test_an_expert_is_filmed_as_mp4_and_gif_and_no_file_is_overwritten(dataset, tmp_path):
    name = tmp_path / "there" / "film"
    words = ("replay", dataset, "scene-000002/0001", "--size", 160, "--fps", 4)
    result = run(*words, "--out", f"{name}.mp4", "--out", f"{name}.gif")
    assert result.returncode == 0, result.stderr
    assert result.stdout == ""
    assert result.stderr.count("reaches the goal") == 2
    for kind in ("mp4", "gif"):
        good, frame = cv2.VideoCapture(f"{name}.{kind}").read()
        assert good
        assert frame.shape[0] == 160 + 2 * round(15 * 0.4) + 2 * round(38 * 0.4)
    before = Path(f"{name}.gif").read_bytes()
    refused(run(*words, "--out", f"{name}.gif"), 2, "film.gif", "--force")
    again = run("replay", dataset, "--scene", 2, "--episode", 1, *words[3:], cwd=tmp_path)
    refused(run(*words, "--out", f"{name}.gif", "--format", "gif"), 2, "--format")
    assert again.returncode == 0, again.stderr
    assert (tmp_path / "scene-000002-0001.mp4").exists()
    assert run(*words, "--out", f"{name}.gif", "--force").returncode == 0
    assert Path(f"{name}.gif").read_bytes() == before
    assert len(list(name.parent.iterdir())) == 2


def test_actions_of_a_file_are_filmed(dataset, tmp_path):
    mine = tmp_path / "mine.json"
    mine.write_text(
        json.dumps({"episode_id": "scene-000002/0001", "actions": ["LookDown", "Done"]})
    )
    words = ("--size", 160, "--fps", 4, "--format", "gif")
    result = run("replay", dataset, "--actions", mine, *words, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert "2 actions, does not end at the goal" in result.stderr
    assert (tmp_path / "scene-000002-0001.gif").read_bytes().startswith(b"GIF89a")
    refused(run("replay", dataset, "0/0", "--actions", mine, *words), 2, "mine.json", "not for")
    mine.write_text('["Jump"]')
    refused(run("replay", dataset, "0/0", "--actions", mine, *words), 2, "mine.json", "Jump")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("99/0",), ["scene-000099/0000", "stats"]),
        (("2/9",), ["scene-000002/0009"]),
        (("two",), ["'two'", "17/3"]),
        (("2/0", "--scene", "2"), ["once"]),
        (("--scene", "-1"), ["from 0"]),
        (("2/0", "--out", "film.avi"), [".avi", ".mp4"]),
        (("2/0", "--size", "0"), ["1 or more"]),
        (("2/0", "--size", "20"), ["160 to 1080"]),
        (("2/0", "--fps", "0"), ["1 to 60"]),
        (("2/0", "--actions", "none.json"), ["none.json"]),
    ],
)
def test_errors_of_replay_are_one_line(dataset, tmp_path, monkeypatch, capsys, words, expected):
    from internav_cli.main import main

    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["replay", str(dataset), *words])
    result = capsys.readouterr()
    assert ended.value.code == 2
    assert result.out == ""
    (line,) = beside_the_dataset(result.err)
    for word in expected:
        assert word in line
    assert not list(tmp_path.iterdir()), "nothing is written"


def test_an_episode_without_an_expert_gives_advice(dataset, tmp_path):
    from internav_cli import replay

    from internav_data.dataset import Identity, assemble, load_dataset, open_staging, stage_scene
    from internav_data.records.errors import UsageError

    data = load_dataset(dataset, filters=[("scene_id", "=", "scene-000000")])
    none = [dataclasses.replace(episode, expert=None) for episode in data]
    identity = Identity("internav-gen", "0", 0, 1, "0" * 64, data.manifest.config)
    stage_scene(open_staging(tmp_path, identity), 0, data.scene("scene-000000"), none)
    assemble(tmp_path, identity, list(data.assets.values()), 1)
    with pytest.raises(UsageError, match=r"scene-000000/0000 has no expert.*--actions FILE"):
        replay.command.main([str(tmp_path), "0/0"], standalone_mode=False)
