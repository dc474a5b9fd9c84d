"""Three small houses, and command lines called in this process."""

import pytest


@pytest.fixture(scope="session")
def three_houses(tmp_path_factory):
    """Three scenes of one room: val, test and train."""
    from internav_data.generation import generate, load_config

    out = tmp_path_factory.mktemp("houses") / "data"
    generate(out, load_config(overrides=["episodes_per_scene=4", "house.rooms=1"]), 3, workers=1)
    return out


@pytest.fixture
def calling(capsys, monkeypatch, tmp_path):
    """Return a command that runs in an empty folder and returns code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def command(main):
        def run(*words):
            with pytest.raises(SystemExit) as ended:
                main([str(word) for word in words])
            output = capsys.readouterr()
            assert "Traceback" not in output.err
            return ended.value.code, output.out, output.err

        return run

    return command


@pytest.fixture
def call_program(calling):
    """Return a command that takes a program's name and its words."""
    from internav_cli import camp_eval, camp_train, main

    runs = {
        "internav-gen": calling(main.main),
        "camp-eval": calling(camp_eval.main),
        "camp-train": calling(camp_train.main),
    }
    return lambda program, *words: runs[program](*words)
