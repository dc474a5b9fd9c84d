"""One flipped bit of every byte of every kind of file, and every truncation at a border of pages.

A case is a kind of file, a seed that chooses the bit of each byte, and a range of bytes:
"episodes 0 512:1024"; or its truncations: "episodes cuts". What is damaged is noticed before a row
is read, and by `validate`; what is not damaged is not. Damage where no reader looks must not change
what is read: each kind of file says where that may be.
"""

from __future__ import annotations

import functools
import hashlib
import itertools
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from unittest import mock

import pyarrow.parquet as pq
from campaign import Row
from damage import flipped
from page_headers import page_headers
from stub_runs import CATALOGUE, CONFIG, SHARDS, in_scratch, made, plain, scratch

from internav_data.core.storage import FolderStore
from internav_data.dataset import (
    Staging,
    load_dataset,
    open_staging,
    read_manifest,
    read_table,
    shards,
    staged_scenes,
)
from internav_data.dataset.journal import JOURNAL, Journal, journal_names
from internav_data.dataset.manifest import open_file
from internav_data.dataset.repair import find_damage
from internav_data.dataset.staging import IDENTITY
from internav_data.dataset.tables import SPECS
from internav_data.evaluation.archive import About, Evaluation, read_evaluation, write_evaluation
from internav_data.evaluation.metrics import RESULTS, EpisodeResult
from internav_data.generation.run import identity_for
from internav_data.physics.result_cache import FILE_NAME, ResultCache
from internav_data.records.errors import InternavError
from internav_data.verification import validate
from internav_data.verification.files import check_file, check_listing, check_manifest
from internav_data.verification.findings import FindingCollector

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

BLOCK = 512
"""Bytes of one case."""
PAGE = 4096
SAMPLED = 512
"""Bytes of a case at which all of `validate` and `load_dataset` runs are this far apart."""
NAMED = 8
"""Most damages that a result names each."""
VALUES = {hashlib.sha256(bytes([k])).digest(): bytes([k]) * (900 + k) for k in range(3)}
"""Entries of the result cache."""
IDENTITY_OF_RUN = identity_for(CONFIG, CATALOGUE)


@dataclass(frozen=True)
class Kind:
    """A kind of file: how a folder with one is made, and who notices that it is damaged."""

    begin: Callable[[Path], str]
    """Fills a folder; returns the name of the file."""
    noticed: Callable[[Path, str, bool], bool]
    """Whether readers refuse the damaged file; what they read otherwise is asserted to be right.

    The last argument says whether to ask all of them. Where all damage is noticed, it asserts so.
    """
    unread: Callable[[bytes], range] = lambda _: range(0)
    """Positions of bytes of the file that may be damaged unnoticed, as nothing depends on them."""


def _first_magic(_data: bytes) -> range:
    """Return the positions of the mark at the beginning of a Parquet file: readers use the last."""
    return range(4)


def _last_byte(data: bytes) -> range:
    """Return the position of the line break at the end of JSON text."""
    return range(len(data) - 1, len(data))


def _everything(data: bytes) -> range:
    """Return all positions: a cache may keep what is right."""
    return range(len(data))


def _result(read):
    """Return what a reader returns; None if it refuses, in one line."""
    try:
        return read()
    except InternavError as error:
        assert "\n" not in str(error)  # noqa: PT017 - any error of this class will do
        return None


def _refused(read, truth) -> bool:
    """Return whether a reader refuses; assert that what it reads is the truth."""
    result = _result(read)
    assert result is None or result == truth, "damage is believed"
    return result is None


# Datasets


@functools.cache
def _dataset() -> Path:
    folder = scratch("dataset")
    made(folder, 3)
    return folder


@functools.cache
def _manifest():
    return read_manifest(_dataset())


@functools.cache
def _rows():
    return load_dataset(_dataset()).to_table()


def _copied(folder):
    shutil.copytree(_dataset(), folder, dirs_exist_ok=True)
    return _manifest()


def _data(table, split):
    def begin(folder):
        return _copied(folder).of(table, split)[0].path

    return Kind(begin, _data_noticed, _first_magic)


def _data_noticed(folder, name, thorough):
    file = _file(name)

    def read():
        with open_file(folder, file, SPECS[file.table]) as opened:
            return opened.read_all()

    assert check_file(folder, file).found, "check_file finds nothing"
    noticed = _refused(read, _table(name))
    if thorough:
        _refused(lambda: load_dataset(folder).to_table(), _rows())
        assert name in {finding.file for finding in validate(folder, "files").found}, "validate"
    return noticed


@functools.cache
def _file(name):
    return next(file for file in _manifest().files if file.path == name)


@functools.cache
def _table(name):
    file = _file(name)
    with open_file(_dataset(), file, SPECS[file.table]) as opened:
        return opened.read_all()


def _beside(name):
    return Kind(lambda folder: (_copied(folder), name)[1], _beside_noticed)


def _beside_noticed(folder, name, thorough):
    report = FindingCollector()
    check_listing(folder, _manifest(), report)
    assert {finding.file for finding in report.found} == {name}, "check_listing finds nothing"
    damage = find_damage(FolderStore(folder))
    assert damage, "find_damage"
    assert damage.paths == (name,)
    if thorough:
        assert name in {finding.file for finding in validate(folder, "files").found}, "validate"
    return True


def _manifest_noticed(folder, _, thorough):
    noticed = _refused(lambda: read_manifest(folder), _manifest())
    assert noticed == (check_manifest(folder, FindingCollector()) is None), "check_manifest"
    if thorough:
        _refused(lambda: load_dataset(folder).to_table(), _rows())
        assert noticed != validate(folder, "files").ok, "validate"
    return noticed


# A run under way


@functools.cache
def _under_way() -> Path:
    folder = scratch("staged")
    staging = open_staging(folder, IDENTITY_OF_RUN)
    payload = mock.Mock(config=CONFIG, staging=staging)
    for scene in range(2):
        plain(payload)(scene)
    Journal(FolderStore(folder)).announce("README.md", "data/assets-0123abcd.parquet")
    return folder


@functools.cache
def _announced():
    return journal_names(FolderStore(_under_way()))


def _staged(name):
    def begin(folder):
        shutil.copytree(_under_way(), folder, dirs_exist_ok=True)
        return name or Staging(FolderStore(folder), IDENTITY_OF_RUN.digest()).name(1)

    return begin


def _scene_noticed(folder, _name, _thorough):
    staging = Staging(FolderStore(folder), IDENTITY_OF_RUN.digest())
    assert set(staged_scenes(staging)) == {0}, "a damaged scene is believed"
    return True


def _identity_noticed(folder, name, _thorough):
    staging = Staging(FolderStore(folder), IDENTITY_OF_RUN.digest())
    noticed = _refused(lambda: staging.check() or True, True)
    if _result(lambda: open_staging(folder, IDENTITY_OF_RUN)):
        assert (folder / name).read_bytes() == (_under_way() / name).read_bytes()
        assert set(staged_scenes(staging)) == {0, 1}
    return noticed


def _journal_noticed(folder, _name, _thorough):
    return _refused(lambda: journal_names(FolderStore(folder)), _announced())


# Checkpoints, evaluations, the result cache


@functools.cache
def _run() -> Path:
    import torch

    from internav_data.camp.agents import make_agent
    from internav_data.camp.checkpoint import Checkpoint, save
    from internav_data.camp.config import from_mapping, preset

    sizes = {"network": {"image_size": 16, "hidden": 4}, "ppo": {"num_envs": 4}}
    config = from_mapping(preset("small"), sizes, "torture")
    torch.manual_seed(0)
    agent = make_agent("ppo", config)
    folder = scratch("run")
    training = {"state/hidden": torch.full((2, 3), 1.0)}
    save(folder, Checkpoint("ppo", config, agent.state_dict(), {"updates": 1}, training), score=0.5)
    return folder


def _checkpoint(name):
    def begin(folder):
        shutil.copytree(_run(), folder, dirs_exist_ok=True)
        return f"checkpoints/{next((folder / 'checkpoints').iterdir()).name}/{name}"

    return begin


def _pointer(folder):
    shutil.copytree(_run(), folder, dirs_exist_ok=True)
    return "checkpoints.json"


def _checkpoint_noticed(folder, name, _thorough):
    from internav_data.camp.checkpoint import read

    return _refused(lambda: _values(read((folder / name).parent)), _checkpoint_values())


@functools.cache
def _checkpoint_values():
    from internav_data.camp.checkpoint import read

    return _values(read(next((_run() / "checkpoints").iterdir())))


def _values(checkpoint):
    """Return all values of a checkpoint, tensors as type, shape and bytes."""
    tensors = [
        {
            name: (value.dtype, tuple(value.shape), value.contiguous().numpy().tobytes())
            for name, value in group.items()
        }
        for group in (checkpoint.weights, checkpoint.training)
    ]
    return checkpoint.method, checkpoint.config, checkpoint.progress, *tensors


def _pointer_noticed(folder, _name, _thorough):
    from internav_data.camp.checkpoint import find

    return _refused(lambda: find(folder).name, find(_run()).name)


_EVALUATION = Evaluation(
    About("camp", "camp", "d", "test", 0, 500),
    (
        EpisodeResult(
            *("scene-000001/0000", "scene-000001", 2, 1, "blocked", True, 40, 0.0, 5.0, 6.25),
            *(0.8, 0.5, 0, 0, 0, 0, 0, 0, 0.0, 0, 0, 10.0, (11,)),
        ),
    ),
)


def _evaluation(name):
    def begin(folder):
        write_evaluation(folder, _EVALUATION.about, _EVALUATION.results)
        return name

    return begin


def _evaluation_noticed(folder, _name, _thorough):
    return _refused(lambda: read_evaluation(folder), _EVALUATION)


@functools.cache
def _solutions() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        cache = ResultCache(Path(folder))
        for key, value in VALUES.items():
            cache.put(key, value)
        cache.flush()
        del cache
        return (Path(folder) / FILE_NAME).read_bytes()


def _cache(folder):
    (folder / FILE_NAME).write_bytes(_solutions())
    return FILE_NAME


def _cache_noticed(folder, _name, _thorough):
    cache = ResultCache(folder)
    values = {key: cache.get(key) for key in VALUES}
    assert all(values[key] in {None, value} for key, value in VALUES.items()), "another value"
    cache.put(b"x" * 32, b"new")
    cache.flush()
    del cache
    for path in folder.iterdir():
        if path.name != FILE_NAME:
            path.unlink()  # SQLite's own journals
    return values != VALUES


KINDS = {
    "manifest": Kind(
        lambda folder: (_copied(folder), "manifest.json")[1], _manifest_noticed, _last_byte
    ),
    "episodes": _data("episodes", "train"),
    "scenes": _data("scenes", "train"),
    "assets": _data("assets", None),
    "journal": Kind(_staged(JOURNAL), _journal_noticed, _last_byte),
    "identity": Kind(_staged(IDENTITY), _identity_noticed, _last_byte),
    "staged": Kind(_staged(""), _scene_noticed),
    "stats": _beside("stats.json"),
    "card": _beside("README.md"),
    "evaluation.json": Kind(_evaluation("evaluation.json"), _evaluation_noticed, _last_byte),
    "evaluation.parquet": Kind(_evaluation("episodes.parquet"), _evaluation_noticed),
    "cache": Kind(_cache, _cache_noticed, _everything),
    "checkpoint": Kind(_checkpoint("checkpoint.json"), _checkpoint_noticed, _last_byte),
    "pointer": Kind(_pointer, _pointer_noticed, _last_byte),
    "weights": Kind(_checkpoint("weights.safetensors"), _checkpoint_noticed),
    "training": Kind(_checkpoint("training.safetensors"), _checkpoint_noticed),
    "eval.yaml": _beside("eval.yaml"),
    "schema": _beside("schemas/manifest.schema.json"),
    "croissant": _beside("croissant.json"),
}


def _read_staged(path):
    staging = Staging(FolderStore(path.parents[5]), IDENTITY_OF_RUN.digest())
    return staged_scenes(staging), staged_scenes(staging, [1])


def _read_checkpoint(path):
    from internav_data.camp.checkpoint import read

    for other in _run().rglob("*.*"):  # what stands beside it
        place = path.parents[2] / other.relative_to(_run())
        place.parent.mkdir(parents=True, exist_ok=True)
        if other.is_file() and place != path:
            place.write_bytes(other.read_bytes())
    return read(path.parent)


def _read_cache(path):
    cache = ResultCache(path.parent)
    return [cache.get(key) for key in VALUES]


READERS = {
    "staged": _read_staged,
    "weights": _read_checkpoint,
    "training": _read_checkpoint,
    "journal": lambda path: journal_names(FolderStore(path.parents[1])),
    "evaluation.parquet": lambda path: read_table(path, RESULTS),
    "cache": _read_cache,
}
"""Readers of some kinds of file as it is, for `fuzz`."""


@functools.cache
def size(kind: str) -> int:
    """Return the number of bytes of a kind of file."""
    with tempfile.TemporaryDirectory() as folder:
        return (Path(folder) / KINDS[kind].begin(Path(folder))).stat().st_size


def cases():
    """Yield truncations, then blocks of bytes of all kinds, in turns."""
    yield from (f"{kind} cuts" for kind in KINDS)
    blocks = [
        [
            f"{kind} 0 {first}:{min(first + BLOCK, size(kind))}"
            for first in range(0, size(kind), BLOCK)
        ]
        for kind in KINDS
    ]
    for some in itertools.zip_longest(*blocks):
        yield from filter(None, some)


def borders(path: Path) -> list[int]:
    """Return the lengths to which a file is cut: pages of Parquet, of memory, and its ends."""
    data = path.read_bytes()
    ends = {0, 1, len(data) - 1, *range(PAGE, len(data), PAGE), *range(512, len(data), 512)}
    if data[:4] == b"PAR1":
        for _, start, stop in page_headers(data, pq.read_metadata(path)):
            ends |= {start, stop}
    return sorted(ends)


@dataclass(frozen=True)
class Damage:
    """A damaged file."""

    what: str
    """What was done to it, for messages."""
    lost: range
    """Positions of the bytes that are changed or gone."""
    data: bytes


def damages(path: Path, rest: list[str]) -> Iterable[Damage]:
    """Yield what a case does to a file: cuts it, or flips a bit of each byte of a range."""
    data = path.read_bytes()
    if rest == ["cuts"]:
        for end in borders(path):
            yield Damage(f"cut to {end} bytes", range(end, len(data)), data[:end])
        return
    seed, span = int(rest[0]), range(*map(int, rest[1].split(":")))
    for at in span:
        bit = (at + seed) % 8
        yield Damage(f"bit {bit} of byte {at}", range(at, at + 1), flipped(data, at, bit))


def check_undamaged(kind: str, folder: Path, name: str) -> None:
    """Check that nothing is noticed of a file as it was written."""
    data = (folder / name).read_bytes()
    try:
        noticed = KINDS[kind].noticed(folder, name, True)
    except AssertionError:  # it asserts that damage is noticed
        return
    finally:
        (folder / name).write_bytes(data)
    assert not noticed, f"{name} is refused undamaged"


def run(key: str, folder: Path):
    """Damage a file in one way after the other; all must be noticed."""
    kind, *rest = key.split()
    name = KINDS[kind].begin(folder)
    path = folder / name
    unread = set(KINDS[kind].unread(path.read_bytes()))
    unnoticed, runs = [], 0
    with mock.patch.object(shards, "SCENES_PER_SHARD", SHARDS):
        check_undamaged(kind, folder, name)
        for damage in list(damages(path, rest)):
            path.write_bytes(damage.data)
            try:
                noticed = KINDS[kind].noticed(folder, name, runs % SAMPLED == 0)
                assert noticed or unread.issuperset(damage.lost), "it is not noticed"
            except Exception as error:
                raise AssertionError(f"{damage.what}: {type(error).__name__}: {error}") from error
            if not noticed:
                unnoticed.append(damage.what)
            runs += 1
    return {"runs": runs, "unnoticed_but_right": len(unnoticed), "unnoticed": _named(unnoticed)}


def _named(unnoticed: list[str]) -> list[str]:
    """Return damages by name; of many, the first and the last."""
    return unnoticed if len(unnoticed) <= NAMED else [unnoticed[0], "…", unnoticed[-1]]


ROW = Row("bits", cases, in_scratch(run))
