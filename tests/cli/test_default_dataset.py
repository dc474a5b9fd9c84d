"""Every command without a directory takes the same dataset and says so."""

import json
from pathlib import Path

import pytest
from stderr_lines import beside_the_dataset

from internav_data import load_dataset
from internav_data.dataset import dataset_folder

SMALL = ("--scenes", 3, "--episodes-per-scene", 2, "--rooms", 1, "--workers", 1)


@pytest.fixture(autouse=True)
def unset(monkeypatch):
    monkeypatch.delenv("INTERNAV_DATASET", raising=False)


READING = [
    ("internav-gen", "validate", "--level", "files"),
    ("internav-gen", "stats"),
    ("internav-gen", "show", "--scene", 2),
    ("internav-gen", "show", "--scene", 2, "--episode", 1),
    ("internav-gen", "replay", "2/1", "--format", "gif", "--size", 160),
    ("camp-eval", "random", "--split", "all", "--limit", 1, "--max-steps", 2),
    ("camp-train", "--device", "cpu", "--method", "ppo", "--preset", "small", "--dry-run",
     "--set", "network.image_size=16", "--set", "network.hidden=8"),
]  # fmt: skip


@pytest.mark.parametrize("variable", [None, "elsewhere/houses"])
def test_one_folder_for_all_commands(call_program, tmp_path, monkeypatch, three_houses, variable):
    name = variable or "internav-dataset"
    if variable:
        monkeypatch.setenv("INTERNAV_DATASET", variable)
    code, out, err = call_program("internav-gen", "generate", *SMALL)
    assert (code, out) == (0, ""), err
    assert err.splitlines()[0].startswith(f"dataset: {name} (")
    assert (tmp_path / name / "manifest.json").is_file()
    assert len(load_dataset()) == 5
    for program, *words in READING if variable is None else READING[:2]:
        code, _, err = call_program(program, *words)
        assert code == 0, err
        assert err.splitlines()[0].startswith(f"dataset: {name} ("), words
        assert "INTERNAV_DATASET" in err.splitlines()[0]
        assert not any(line.startswith("dataset: ") for line in beside_the_dataset(err))
    pictures = {"scene-000002.png", "scene-000002-0001.png", "scene-000002-0001.gif"}
    assert {path.name for path in tmp_path.glob("scene-*")} == (set() if variable else pictures)
    # An argument wins.
    code, out, err = call_program("internav-gen", "stats", three_houses, "--json")
    assert json.loads(out)["episodes"] == len(load_dataset(three_houses))
    assert err.splitlines() == [f"dataset: {three_houses}"]


@pytest.mark.parametrize("words", READING, ids=lambda words: words[1])
def test_nothing_there_is_one_line_with_the_command_that_makes_one(call_program, tmp_path, words):
    code, out, err = call_program(*words)
    assert (code, out) == (5, "")
    (line,) = err.splitlines()
    assert "internav-dataset: no dataset here" in line
    assert "`internav-gen generate --scenes 120` makes one, `mini` names the one that ships" in line
    assert not list(tmp_path.iterdir())


def test_the_command_names_the_folder_that_was_named(call_program):
    _, _, err = call_program("internav-gen", "stats", "my houses")
    assert "`internav-gen generate --scenes 120 --out 'my houses'` makes one" in err


def test_an_empty_variable_names_nothing(monkeypatch):
    monkeypatch.setenv("INTERNAV_DATASET", "")
    assert dataset_folder() == Path("internav-dataset")
    assert dataset_folder("there") == Path("there")


def test_settings_draw_a_fresh_house_beside_any_dataset(call_program, tmp_path):
    code, _, err = call_program("internav-gen", "show", "--seed", 0, "--rooms", 1)
    assert code == 0, err
    assert "dataset" not in err
    assert (tmp_path / "scene-000000.png").is_file()
