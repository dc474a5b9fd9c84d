from __future__ import annotations

import json
from dataclasses import asdict, replace

import pytest
from damage import flipped

from internav_data.core.files import with_sha256
from internav_data.evaluation.archive import (
    ABOUT,
    EPISODES,
    About,
    find_evaluations,
    folder_name,
    forget_evaluations,
    read_evaluation,
    write_evaluation,
)
from internav_data.records.errors import CorruptDataError, UsageError

CAMP = About(
    "camp --intent none", "camp", "0123", "test", 0, 500, intent="none", sync_every=3,
    training_seed=4, environment_steps=300_000, parameters=12, training_s=61.5,
)  # fmt: skip


@pytest.fixture
def written(tmp_path, row):
    write_evaluation(tmp_path / "a", CAMP, [row(1), row(0, actions=(0, -1, 11))])
    return tmp_path / "a"


def test_what_is_written_is_read_back_sorted(written, row):
    found = read_evaluation(written)
    assert found.about == CAMP
    assert found.results == (row(0, actions=(0, -1, 11)), row(1))
    assert sorted(p.name for p in written.iterdir()) == [EPISODES, ABOUT]


def test_the_same_results_give_the_same_bytes(written, tmp_path, row):
    write_evaluation(tmp_path / "b", CAMP, [row(0, actions=(0, -1, 11)), row(1)])
    for name in (ABOUT, EPISODES):
        assert (tmp_path / "b" / name).read_bytes() == (written / name).read_bytes()


def test_whole_numbers_do_for_seconds(written):
    said = json.loads((written / ABOUT).read_text()) | {"training_s": 60}
    (written / ABOUT).write_text(json.dumps(with_sha256(said)))
    assert read_evaluation(written).about == replace(CAMP, training_s=60)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"format": 1}, "format 3"),
        ({"format": None}, "format 3"),
        ({"seed": "0"}, "seed"),
        ({"greedy": 1}, "greedy"),
        ({"name": None}, "name"),
        ({"training_seed": True}, "training_seed"),
        ({"episodes": 3}, "3 rows"),
        ({"episodes": "2"}, "count"),
    ],
)
def test_another_version_or_type_is_refused(written, change, word):
    said = json.loads((written / ABOUT).read_text()) | change
    (written / ABOUT).write_text(json.dumps(with_sha256(said)))
    with pytest.raises(CorruptDataError, match=word):
        read_evaluation(written)


@pytest.mark.parametrize("name", ["seed", "sync_every", "episodes"])
def test_a_description_that_lacks_a_key_is_refused(written, name):
    said = json.loads((written / ABOUT).read_text())
    del said[name]
    (written / ABOUT).write_text(json.dumps(with_sha256(said)))
    with pytest.raises(CorruptDataError, match=name):
        read_evaluation(written)


def test_a_flipped_bit_of_a_description_is_noticed(written):
    path = written / ABOUT
    data = path.read_bytes()
    for k in (k for k in range(len(data)) if data[k] not in b" \n"):
        path.write_bytes(flipped(data, k, k % 7))
        with pytest.raises(CorruptDataError):
            read_evaluation(written)


def test_a_table_of_another_evaluation_is_noticed(written, tmp_path, row):
    write_evaluation(tmp_path / "b", CAMP, [row(1), row(0)])
    (written / EPISODES).write_bytes((tmp_path / "b" / EPISODES).read_bytes())
    with pytest.raises(CorruptDataError, match="other results"):
        read_evaluation(written)


@pytest.mark.parametrize("text", ["", "{", "[1]", "[" * 100_000, "\x00"])
def test_what_is_no_description_is_refused(written, text):
    (written / ABOUT).write_text(text)
    with pytest.raises(CorruptDataError, match="evaluate again"):
        read_evaluation(written)


def test_a_flipped_bit_of_the_table_is_noticed(written):
    path = written / EPISODES
    data = path.read_bytes()
    for k in range(0, len(data), 7):
        path.write_bytes(flipped(data, k, k % 8))
        with pytest.raises(CorruptDataError, match="damaged"):
            read_evaluation(written)


def test_damaged_and_missing_rows_are_told(written, row):
    path = written / EPISODES
    whole = path.read_bytes()
    for k in range(len(whole) // 3, len(whole), len(whole) // 7):
        path.write_bytes(whole[:k])
        with pytest.raises(CorruptDataError):
            read_evaluation(written)
    path.unlink()
    with pytest.raises(CorruptDataError, match=EPISODES):
        read_evaluation(written)
    write_evaluation(written, CAMP, [row(0), row(0)])
    with pytest.raises(CorruptDataError, match="twice"):
        read_evaluation(written)


def test_evaluations_are_found_below_a_folder(tmp_path, row):
    for name in ("run/evaluation-test/camp", "run/evaluation-test/expert", "other"):
        write_evaluation(tmp_path / name, CAMP, [row()])
    found = [str(p.relative_to(tmp_path)) for p in find_evaluations(tmp_path)]
    assert found == ["other", "run/evaluation-test/camp", "run/evaluation-test/expert"]
    assert find_evaluations(tmp_path / "other") == [tmp_path / "other"]
    forget_evaluations(tmp_path / "run/evaluation-test")
    assert find_evaluations(tmp_path) == [tmp_path / "other"]
    with pytest.raises(UsageError, match="camp-eval RUN DATASET"):
        find_evaluations(tmp_path / "run")


def test_a_strangers_file_of_the_same_name_is_not_forgotten(tmp_path, row):
    write_evaluation(tmp_path / "camp", CAMP, [row()])
    theirs = tmp_path / "mine" / ABOUT
    theirs.parent.mkdir()
    theirs.write_text('{"format": "mine"}')
    forget_evaluations(tmp_path)
    assert theirs.read_text() == '{"format": "mine"}'
    assert not (tmp_path / "camp" / ABOUT).exists()


def test_names_become_folders():
    assert folder_name("camp --intent none") == "camp-intent-none"
    assert folder_name("../../etc/x") == "etc-x"
    assert folder_name("///") == "agent"


def test_everything_known_is_written(written):
    assert asdict(CAMP).items() <= json.loads((written / ABOUT).read_text()).items()
