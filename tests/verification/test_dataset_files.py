"""Files beside the data, files of strangers, and files of a generator that is at work."""

import shutil
import sys
from pathlib import Path

import pytest

from internav_data.core.storage import FolderStore
from internav_data.dataset import read_manifest
from internav_data.dataset.journal import journal_bytes
from internav_data.records.errors import InternavError
from internav_data.verification import levels, validate

KEPT = Path(__file__).parents[1] / "data" / "dataset-10"
sys.path.insert(0, str(Path(__file__).parents[1] / "dataset"))


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    from test_commit import ASSETS, IDENTITY, build

    monkeypatch.undo()  # the files beside the data are wanted here
    monkeypatch.setattr("os.fsync", lambda _: None)
    return extended(tmp_path / "ds", 0, 6, build, IDENTITY, ASSETS)


def extended(out, low, high, build, identity, assets):
    from internav_data.dataset import assemble

    build(out, range(low, high))
    assemble(out, identity, assets, high)
    return out


def predicates(folder):
    return {(f.file, f.predicate) for f in validate(folder, "files").found}


def test_every_file_beside_the_data_is_watched(dataset):
    assert not predicates(dataset)
    for file in read_manifest(dataset).metadata:
        path = dataset / file.path
        good = path.read_bytes()
        for bad in (good[:-1], good + b"\n", bytes([good[0] ^ 1]) + good[1:]):
            path.write_bytes(bad)
            assert (file.path, "files.sha256") in predicates(dataset)
        path.unlink()
        assert predicates(dataset) == {(file.path, "files.present")}
        path.write_bytes(good)
    assert not predicates(dataset)


def test_a_dataset_that_does_not_list_them_is_valid(tmp_path):
    folder = shutil.copytree(KEPT, tmp_path / "kept")
    assert read_manifest(folder).metadata is None
    assert not predicates(folder)


def test_a_strangers_file_among_the_data_is_named(dataset):
    for name in ("data/episodes/mine.parquet", "data/notes.txt", "data/.x.1.tmp"):
        (dataset / name).write_text("precious")
        assert predicates(dataset) == {(name, "files.unlisted")}
        (dataset / name).unlink()
    (dataset / "notes.txt").write_text("precious")
    assert not predicates(dataset)


def test_files_of_a_commit_under_way_are_no_findings(dataset):
    names = ["data/episodes/train-00000-01234567.parquet", "README.md"]
    store = FolderStore(dataset)
    store.put(".work/journal.json", journal_bytes(names))
    for name in names:
        store.put(name, b"the next version")
    findings = validate(dataset, "files")
    assert findings.ok
    assert sum(findings.notes.values()) == 2
    store.put(".work/journal.json", b"[")
    assert {file for file, _ in predicates(dataset)} == set(names)


def test_a_dataset_that_is_extended_under_it_is_validated_anew(dataset, monkeypatch):
    from test_commit import ASSETS, IDENTITY, build

    real, times, scenes = levels.check_file, [2], [6]

    def check(root, file):
        if times[0] and file.table == "assets":
            times[0] -= 1
            scenes[0] += 1
            extended(dataset, scenes[0] - 1, scenes[0], build, IDENTITY, ASSETS)
            # As if the others were read too late.
            root = Path("nowhere")
        return real(root, file)

    monkeypatch.setattr(levels, "check_file", check)
    findings = validate(dataset, "files")
    assert findings.ok, findings.summary()
    assert findings.checked["rows"] == 2 * 8 + 8 + 2
    times[0] = 1000
    with pytest.raises(InternavError, match="extended the dataset 3 times"):
        validate(dataset, "files")
