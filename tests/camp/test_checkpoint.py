"""Checkpoints are whole or not there, and reading one can neither run code nor eat the memory."""

import json
import pickle
import struct

import pytest

torch = pytest.importorskip("torch")
from safetensors.torch import load_file, save_file  # noqa: E402

from internav_data.camp import checkpoint as checkpoints  # noqa: E402
from internav_data.camp.agents import AGENTS, make_agent  # noqa: E402
from internav_data.camp.checkpoint import Checkpoint, find, load_agent, read, save  # noqa: E402
from internav_data.core import storage  # noqa: E402
from internav_data.core.files import with_sha256  # noqa: E402
from internav_data.core.storage import file_sha256  # noqa: E402
from internav_data.records.errors import CorruptDataError, UsageError  # noqa: E402


@pytest.fixture
def made(config):
    def make(method="camp", number=1):
        agent = make_agent(method, config(seed=number))
        training = {"state/hidden": torch.full((2, 3), float(number))}
        progress = {"updates": number, "environment_steps": 32 * number}
        return Checkpoint(method, config(seed=number), agent.state_dict(), progress, training)

    return make


@pytest.fixture
def kept(tmp_path, made):
    """A run with one checkpoint, and the folder of that."""
    return tmp_path, save(tmp_path, made())


def test_an_agent_is_handed_on_alone(kept, made, tmp_path):
    from internav_data.camp.run import resume
    from internav_data.camp.train import Request

    run, _ = kept
    folder = checkpoints.export_agent(run, tmp_path / "alone")
    agent = load_agent(folder)
    assert agent.progress == {"environment_steps": 32}
    for name, value in agent.state_dict().items():
        assert torch.equal(value, made().weights[name])
    with pytest.raises(UsageError, match="there already"):
        checkpoints.export_agent(run, folder)
    with pytest.raises(UsageError, match="an agent alone"):
        resume(Request(tmp_path, folder), {})


def edit(folder, **changes):
    path = folder / checkpoints.ABOUT
    said = json.loads(path.read_bytes())
    path.write_text(json.dumps(with_sha256(said | changes)))


def sealed(folder, name):
    """Write the size and digest of a file of tensors again."""
    files = json.loads((folder / checkpoints.ABOUT).read_bytes())["files"]
    files[name] = {"bytes": (folder / name).stat().st_size, "sha256": file_sha256(folder / name)}
    edit(folder, files=files)


def test_what_is_read_is_what_was_written(kept, made):
    run, folder = kept
    again, written = read(run), made()
    assert (again.method, again.config) == (written.method, written.config)
    assert again.progress == written.progress
    assert again.weights.keys() == written.weights.keys()
    assert all(torch.equal(again.weights[name], value) for name, value in written.weights.items())
    assert torch.equal(again.training["state/hidden"], written.training["state/hidden"])
    assert not read(folder, training=False).training


@pytest.mark.parametrize("method", AGENTS)
def test_an_agent_comes_back_knowing_what_it_is(tmp_path, made, method):
    written = made(method)
    save(tmp_path, written)
    agent = load_agent(tmp_path)
    assert agent.method == method
    assert agent.config == written.config
    assert agent.progress["environment_steps"] == 32
    for name, value in agent.state_dict().items():
        assert torch.equal(value, written.weights[name])


def test_last_and_best_are_kept_and_no_other(tmp_path, made):
    for number, score in ((1, 0.2), (2, 0.5), (3, None), (4, None)):
        save(tmp_path, made(number=number), score=score)
    assert read(tmp_path).progress["updates"] == 4
    assert read(tmp_path, "best").progress["updates"] == 2
    assert checkpoints.best_score(tmp_path) == 0.5
    assert len(list((tmp_path / checkpoints.FOLDER).iterdir())) == 2
    with pytest.raises(UsageError, match="which: expected one of last, best, got 'first'"):
        read(tmp_path, "first")


@pytest.mark.parametrize("victim", ["save_file", "file_sha256", "write_atomically", "sync"])
@pytest.mark.parametrize("after", range(3))
def test_killed_between_files_the_last_one_stands(kept, made, monkeypatch, victim, after):
    """Whatever comes last before a kill, reading finds the old checkpoint, and saving goes on."""
    run, _ = kept
    owner = checkpoints if victim == "save_file" else storage
    true, left = getattr(owner, victim), [after]

    def dies(*given):
        if not left[0]:
            raise KeyboardInterrupt
        left[0] -= 1
        return true(*given)

    monkeypatch.setattr(owner, victim, dies)
    try:
        save(run, made(number=2))
        died = False
    except KeyboardInterrupt:
        died = True
    monkeypatch.setattr(owner, victim, true)
    assert read(run).progress["updates"] == (1 if died else 2)
    save(run, made(number=3))
    assert read(run).progress["updates"] == 3
    assert [path.name for path in (run / checkpoints.FOLDER).iterdir()] == [find(run).name]


def test_no_temporary_folder_is_taken_for_a_checkpoint(kept, made):
    run, folder = kept
    left = folder.with_name(".000002.1.tmp")
    left.mkdir()
    (left / checkpoints.ABOUT).write_text("{")
    noted = json.loads((run / checkpoints.POINTER).read_text()) | {"leftovers": [left.name]}
    (run / checkpoints.POINTER).write_text(json.dumps(with_sha256(noted)))
    assert read(run).progress["updates"] == 1
    save(run, made(number=2))
    assert not left.exists()


def test_a_strangers_folders_survive_all_checkpoints(kept, made):
    run, folder = kept
    theirs = [
        folder.with_name(name) / "thesis.tex"
        for name in ("mine", ".000002.1.tmp", "000002", "000004", ".000009.7.tmp")
    ]
    for path in theirs:
        path.parent.mkdir()
        path.write_text("precious")
    noted = json.loads((run / checkpoints.POINTER).read_text())
    outside = {"leftovers": ["mine", "../../x", "", ".", "..", 7, folder.name]}
    (run / checkpoints.POINTER).write_text(json.dumps(with_sha256(noted | outside)))
    for number in range(2, 6):
        save(run, made(number=number))
        assert read(run).progress["updates"] == number
    assert all(path.read_text() == "precious" for path in theirs)
    names = {path.name for path in (run / checkpoints.FOLDER).iterdir()}
    assert names == {path.parent.name for path in theirs} | {find(run).name}


def test_a_run_killed_at_its_first_checkpoint_has_none(tmp_path, made, monkeypatch):
    monkeypatch.setattr(checkpoints, "_write_folder", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        save(tmp_path, made(number=1))
    assert not checkpoints.has_checkpoint(tmp_path)


@pytest.mark.parametrize("name", [checkpoints.WEIGHTS, checkpoints.TRAINING, checkpoints.ABOUT])
@pytest.mark.parametrize("share", [0.0, 0.5, 0.99])
def test_truncated_files_are_refused_in_a_line(kept, name, share):
    run, folder = kept
    data = (folder / name).read_bytes()
    (folder / name).write_bytes(data[: int(len(data) * share)])
    with pytest.raises(CorruptDataError, match=name):
        read(run)


def test_a_changed_byte_is_noticed(kept):
    run, folder = kept
    path = folder / checkpoints.WEIGHTS
    data = bytearray(path.read_bytes())
    data[-5] ^= 1
    path.write_bytes(data)
    with pytest.raises(CorruptDataError, match="its bytes are not those"):
        read(run)


@pytest.mark.parametrize("name", [checkpoints.ABOUT, checkpoints.POINTER])
def test_a_flipped_bit_of_a_checkpoints_json_is_noticed(kept, name):
    """A sample of the bytes, and each letter of the name of the digest."""
    run, folder = kept
    path = (folder if name == checkpoints.ABOUT else run) / name
    data, whole = path.read_bytes(), read(run)
    key = data.index(b'"sha256": "', len(data) - 100)
    sample = [k for k in range(0, len(data), max(1, len(data) // 40)) if data[k] not in b" \n"]
    for k in (*sample, *range(key + 1, key + 7)):
        path.write_bytes(data[:k] + bytes([data[k] ^ (1 << k % 7)]) + data[k + 1 :])
        with pytest.raises(CorruptDataError):
            read(run)
    path.write_text(json.dumps(json.loads(data)))  # another layout is no damage
    assert read(run).progress == whole.progress


@pytest.mark.parametrize("name", [checkpoints.ABOUT, checkpoints.POINTER])
def test_json_without_its_digest_is_refused(kept, name):
    run, folder = kept
    path = (folder if name == checkpoints.ABOUT else run) / name
    said = json.loads(path.read_bytes())
    del said["sha256"]
    path.write_text(json.dumps(said))
    with pytest.raises(CorruptDataError, match="no sha256"):
        read(run)


class Bomb:
    def __reduce__(self):
        return (pytest.fail, ("unpickled",))


def test_a_pickle_is_not_opened(kept):
    run, folder = kept
    path = folder / checkpoints.WEIGHTS
    path.write_bytes(pickle.dumps(Bomb()))
    sealed(folder, checkpoints.WEIGHTS)
    with pytest.raises(CorruptDataError, match="no safetensors file"):
        read(run)


def test_a_header_that_asks_for_the_moon_is_refused(kept):
    run, folder = kept
    path = folder / checkpoints.WEIGHTS
    header = json.dumps({"x": {"dtype": "F32", "shape": [10**6] * 3, "data_offsets": [0, 4]}})
    path.write_bytes(struct.pack("<Q", len(header)) + header.encode() + b"\0" * 4)
    sealed(folder, checkpoints.WEIGHTS)
    with pytest.raises(CorruptDataError, match="no safetensors file"):
        read(run)


def test_a_config_larger_than_its_weights_takes_no_memory(kept):
    """hidden 8192 on 1024 pixels would take 64 GB."""
    run, folder = kept
    said = json.loads((folder / checkpoints.ABOUT).read_bytes())["config"]
    said["network"] |= {"hidden": 8192, "image_size": 1024}
    edit(folder, config=said)
    with pytest.raises(CorruptDataError, match="another agent's weights"):
        read(run)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": 1}, "format 1: this release reads 3"),
        ({"method": "ppo"}, "another agent's weights"),
        ({"method": 3}, "expected method, config, files, progress"),
        ({"config": []}, "expected method, config, files, progress"),
        ({"config": {"speed": 1}}, "no key 'speed'"),
        ({"config": {"ppo": {"num_steps": 0}}}, "ppo.num_steps is 0"),
        ({"files": {}}, "weights.safetensors: its bytes are not those"),
        ({"progress": None}, "expected method, config, files, progress"),
    ],
)
def test_what_does_not_fit_is_told(kept, changes, words):
    run, folder = kept
    edit(folder, **changes)
    with pytest.raises(CorruptDataError, match=words):
        read(run)


def test_deep_json_is_refused(kept):
    run, folder = kept
    (folder / checkpoints.ABOUT).write_text("[" * 100_000)
    with pytest.raises(CorruptDataError, match="not JSON"):
        read(run)


def test_a_pointer_leads_nowhere_else(kept):
    run, _ = kept
    (run / checkpoints.POINTER).write_text(json.dumps(with_sha256({"last": "../../etc"})))
    with pytest.raises(CorruptDataError, match="expected a folder's name"):
        read(run)


def test_a_folder_without_one_says_what_is_expected(tmp_path):
    with pytest.raises(UsageError, match="expected the folder of a run"):
        read(tmp_path)


def written_again(folder, name, change):
    """Write a file of tensors with one of them changed, and its size and digest."""
    path = folder / name
    tensors = load_file(path)
    first = min(key for key, value in tensors.items() if value.is_floating_point())
    save_file(tensors | {first: change(tensors[first])}, path)
    sealed(folder, name)


@pytest.mark.parametrize("name", [checkpoints.WEIGHTS, checkpoints.TRAINING])
@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_numbers_that_are_not_finite_are_refused(kept, name, value):
    run, folder = kept
    written_again(folder, name, lambda tensor: torch.full_like(tensor, value))
    with pytest.raises(CorruptDataError, match="no finite number"):
        read(run)


@pytest.mark.parametrize("change", [torch.Tensor.double, torch.Tensor.half, torch.Tensor.long])
def test_weights_of_another_type_are_refused(kept, change):
    run, folder = kept
    written_again(folder, checkpoints.WEIGHTS, change)
    with pytest.raises(CorruptDataError, match=r"type and shape.*another agent's weights"):
        read(run)


def test_an_oversize_header_is_refused(kept):
    run, folder = kept
    path = folder / checkpoints.WEIGHTS
    with path.open("wb") as file:
        file.write(struct.pack("<Q", 90_000_000) + b"{")
        file.truncate(100_000_000)
    sealed(folder, checkpoints.WEIGHTS)
    with pytest.raises(CorruptDataError, match="no safetensors file"):
        read(run)
