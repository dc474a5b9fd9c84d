"""`generate` on a damaged dataset makes what is damaged again."""

import io

import pytest
from test_run import contents, journal, made

from internav_data.dataset import read_manifest
from internav_data.generation.progress import GenerationProgress
from internav_data.records.errors import CorruptDataError


@pytest.fixture
def damaged(tmp_path):
    out = tmp_path / "d"
    made(out, 4)
    whole = contents(out)
    manifest = read_manifest(out)
    (out / manifest.of("episodes", "train")[0].path).unlink()
    path = out / manifest.of("scenes", "val")[0].path
    path.write_bytes(path.read_bytes()[::-1])
    (out / "README.md").write_text("mine")
    return out, whole


def test_damaged_and_missing_files_are_made_again(damaged):
    out, whole = damaged
    told = io.StringIO()
    made(out, 4, progress=GenerationProgress(told))
    assert journal(out) == [0, 2, 3], "the scene of the test split is not needed"
    assert contents(out) == whole
    assert "missing or damaged: data/episodes/train-00000" in told.getvalue()
    assert made(out, 4).new_scenes == 0
    assert journal(out) == []


def test_a_damaged_dataset_is_extended_to_the_bytes_of_a_whole_one(damaged, tmp_path):
    out, _ = damaged
    made(out, 6)
    assert sorted(journal(out)) == [0, 2, 3, 4, 5]
    made(tmp_path / "once" / "d", 6)
    assert contents(out) == contents(tmp_path / "once" / "d")


def test_a_scene_that_cannot_be_made_again_is_an_error(damaged):
    out, _ = damaged
    with pytest.raises(CorruptDataError, match="could not be made again"):
        made(out, 4, quarantine=[2])
