"""Commands and the physics engine: the first line names it, and one line says what to install."""

import shutil

import pytest
from stderr_lines import beside_the_dataset

from internav_data.physics.engines import DEFAULT_ENGINE, ENGINES, MODULES, second_engine
from internav_data.records.errors import MissingEngineError

OWN, OTHER = DEFAULT_ENGINE, second_engine(DEFAULT_ENGINE)


@pytest.fixture
def mine(three_houses, tmp_path):
    """A copy of a dataset, which nothing may change."""
    return shutil.copytree(three_houses, tmp_path / "mine")


SAME = ("--rooms", 1, "--episodes-per-scene", 4, "--workers", 1)
SOLVING = [
    ("internav-gen", "validate", "mine", "--level", "physics"),
    ("internav-gen", "replay", "mine", "2/1"),
    ("camp-eval", "random", "mine", "--split", "all"),
    ("camp-train", "mine", "--preset", "small", "--dry-run", "--device", "cpu"),
]


@pytest.mark.parametrize("words", SOLVING, ids=lambda words: words[1])
def test_a_dataset_whose_engine_is_missing_is_one_line(call_program, mine, monkeypatch, words):
    monkeypatch.setitem(MODULES, OWN, "nowhere_to_be_found")
    monkeypatch.setitem(ENGINES, OTHER, object)
    monkeypatch.setitem(MODULES, OTHER, "json")
    code, out, err = call_program(*words)
    assert (code, out) == (1, "")
    first, line = err.splitlines()
    assert first == f"dataset: mine; physics: {OWN}"
    assert f"mine: the physics engine {OWN} is not installed: pip install nowhere" in line
    assert "--physics" not in line, "the dataset is of this engine"


def test_what_solves_nothing_needs_no_engine(call_program, mine, monkeypatch):
    monkeypatch.setitem(MODULES, OWN, "nowhere_to_be_found")
    for words in (("validate", "mine"), ("stats", "mine"), ("show", "mine", "--scene", 2)):
        code, _, err = call_program("internav-gen", *words)
        assert (code, err.splitlines()[0]) == (0, "dataset: mine"), err


def test_environments_name_what_to_install(mine, monkeypatch):
    from internav_data.envs import InterNavVectorEnv

    monkeypatch.setitem(MODULES, OWN, "nowhere_to_be_found")
    with pytest.raises(MissingEngineError, match=r"mine: .*: pip install nowhere"):
        InterNavVectorEnv(1, mine)


def test_generate_names_the_engine_first_and_keeps_that_of_the_dataset(
    call_program, mine, monkeypatch
):
    monkeypatch.setitem(ENGINES, OTHER, object)
    monkeypatch.setitem(MODULES, OTHER, "json")
    code, _, err = call_program("internav-gen", "generate", "--out", "mine", "--scenes", 3, *SAME)
    assert code == 0, err
    assert err.splitlines()[0] == f"dataset: mine; physics: {OWN}"
    assert "holds 3 scenes" in err
    before = (mine / "manifest.json").read_bytes()
    for named in (("--physics", OTHER), ("--set", f"physics.engine={OTHER}")):
        words = ("--out", "mine", "--scenes", 3, *SAME, *named)
        code, _, err = call_program("internav-gen", "generate", *words)
        (line,) = beside_the_dataset(err)
        assert code == 2
        assert f"physics.engine: there '{OWN}', asked for '{OTHER}'" in line
    assert (mine / "manifest.json").read_bytes() == before


def test_generate_says_what_to_install_and_which_engine_would_run(
    call_program, monkeypatch, tmp_path
):
    monkeypatch.setitem(ENGINES, OTHER, object)
    monkeypatch.setitem(MODULES, OTHER, "nowhere_to_be_found")
    words = ("--out", "new", "--scenes", 1, *SAME, "--physics", OTHER)
    for more in ((), ("--dry-run",)):
        code, _, err = call_program("internav-gen", "generate", *words, *more)
        (line,) = beside_the_dataset(err)
        assert code == 1
        assert f"the physics engine {OTHER} is not installed: pip install nowhere" in line
        assert f"--physics {OWN} is installed here" in line
    monkeypatch.setitem(MODULES, OWN, "nowhere_to_be_found")
    code, _, err = call_program("internav-gen", "generate", *words)
    (line,) = beside_the_dataset(err)
    assert (code, "no physics engine is installed" in line) == (1, True)
    assert not list(tmp_path.iterdir())
