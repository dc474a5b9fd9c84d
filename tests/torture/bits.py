"""One flipped bit of every byte of every kind of file, and every truncation at a border of pages.

A case is a kind of file, a seed that chooses the bit of each byte, and a range of bytes:
"episodes 0 512:1024"; or its truncations: "episodes cuts". What is damaged is noticed before a row
is read, and by `validate`.
"""

from __future__ import annotations

import functools
import itertools
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from unittest import mock

import pyarrow.parquet as pq
from campaign import Row
from page_headers import page_headers
from stub_runs import CATALOGUE, CONFIG, SHARDS, made, plain

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
    from collections.abc import Callable

BLOCK = 512
"""Bytes of one case."""
PAGE = 4096
SAMPLED = 512
"""Bytes of a case at which all of `validate` and `load_dataset` runs are this far apart."""
VALUES = {b"%032d" % k: bytes([k]) * (900 + k) for k in range(3)}
"""Entries of the result cache."""
IDENTITY_OF_RUN = identity_for(CONFIG, CATALOGUE)


@dataclass(frozen=True)
class Kind:
    """A kind of file: how a folder with one is made, and who notices that it is damaged."""

    begin: Callable[[Path], str]
    """Fills a folder; returns the name of the file."""
    noticed: Callable[[Path, str, bool], bool]
    """Whether readers refuse the damaged file; what they read otherwise is asserted to be right.

    The last argument says whether to ask all of them.
    """


def _result(read):
    """Return what a reader returns; None if it refuses, in one line."""
    try:
        return read()
    except InternavError as error:
        assert "\n" not in str(error)  # noqa: PT017 - any error of this class will do
        return None


def _refused(read, truth) -> bool:
    """Return whether a reader refuses; assert that what it reads is the truth."""
    found = _result(read)
    assert found is None or found == truth, "damage is believed"
    return found is None


# Datasets


@functools.cache
def _dataset() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="torture-dataset-"))
    made(folder, 3)
    return folder


def _copied(folder):
    shutil.copytree(_dataset(), folder, dirs_exist_ok=True)
    return read_manifest(folder)


def _data(table, split):
    def begin(folder):
        return _copied(folder).of(table, split)[0].path

    return Kind(begin, _data_noticed)


def _data_noticed(folder, name, thorough):
    file = next(file for file in read_manifest(folder).files if file.path == name)

    def read():
        with open_file(folder, file, SPECS[file.table]) as opened:
            return opened.read_all()

    assert check_file(folder, file).found, "check_file finds nothing"
    noticed = _refused(read, _table(name))
    if thorough:
        _refused(lambda: load_dataset(folder).to_table(), load_dataset(_dataset()).to_table())
        assert name in {finding.file for finding in validate(folder, "files").found}, "validate"
    return noticed


@functools.cache
def _table(name):
    file = next(file for file in read_manifest(_dataset()).files if file.path == name)
    with open_file(_dataset(), file, SPECS[file.table]) as opened:
        return opened.read_all()


def _beside(name):
    return Kind(lambda folder: (_copied(folder), name)[1], _beside_noticed)


def _beside_noticed(folder, name, thorough):
    report = FindingCollector()
    check_listing(folder, read_manifest(folder), report)
    assert {finding.file for finding in report.found} == {name}, "check_listing finds nothing"
    damage = find_damage(FolderStore(folder))
    assert damage, "find_damage"
    assert damage.paths == (name,)
    if thorough:
        assert name in {finding.file for finding in validate(folder, "files").found}, "validate"
    return True


def _manifest_noticed(folder, _, thorough):
    noticed = _refused(lambda: read_manifest(folder), read_manifest(_dataset()))
    assert noticed == (check_manifest(folder, FindingCollector()) is None), "check_manifest"
    if thorough:
        _refused(lambda: load_dataset(folder).to_table(), load_dataset(_dataset()).to_table())
        assert noticed != validate(folder, "files").ok, "validate"
    return noticed


# A run under way


@functools.cache
def _under_way() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="torture-staged-"))
    staging = open_staging(folder, IDENTITY_OF_RUN)
    payload = mock.Mock(config=CONFIG, staging=staging)
    for scene in range(2):
        plain(payload)(scene)
    Journal(FolderStore(folder)).announce("README.md", "data/assets-0123abcd.parquet")
    return folder


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
    noticed = _refused(staging.check, None)
    if _result(lambda: open_staging(folder, IDENTITY_OF_RUN)):
        assert (folder / name).read_bytes() == (_under_way() / name).read_bytes()
        assert set(staged_scenes(staging)) == {0, 1}
    return noticed


def _journal_noticed(folder, _name, _thorough):
    return _refused(
        lambda: journal_names(FolderStore(folder)), journal_names(FolderStore(_under_way()))
    )


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
    folder = Path(tempfile.mkdtemp(prefix="torture-run-"))
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

    truth = next((_run() / "checkpoints").iterdir())
    return _refused(lambda: repr(read((folder / name).parent)), repr(read(truth)))


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
    found = {key: cache.get(key) for key in VALUES}
    assert all(found[key] in {None, value} for key, value in VALUES.items()), "another value"
    cache.put(b"x" * 32, b"new")
    cache.flush()
    del cache
    for path in folder.iterdir():
        if path.name != FILE_NAME:
            path.unlink()  # SQLite's own journals
    return found != VALUES


KINDS = {
    "manifest": Kind(lambda folder: (_copied(folder), "manifest.json")[1], _manifest_noticed),
    "episodes": _data("episodes", "train"),
    "scenes": _data("scenes", "train"),
    "assets": _data("assets", None),
    "journal": Kind(_staged(JOURNAL), _journal_noticed),
    "identity": Kind(_staged(IDENTITY), _identity_noticed),
    "staged": Kind(_staged(""), _scene_noticed),
    "stats": _beside("stats.json"),
    "card": _beside("README.md"),
    "evaluation.json": Kind(_evaluation("evaluation.json"), _evaluation_noticed),
    "evaluation.parquet": Kind(_evaluation("episodes.parquet"), _evaluation_noticed),
    "cache": Kind(_cache, _cache_noticed),
    "checkpoint": Kind(_checkpoint("checkpoint.json"), _checkpoint_noticed),
    "pointer": Kind(_pointer, _pointer_noticed),
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


def flipped(data: bytes, at: int, bit: int) -> bytes:
    """Return bytes of which one has a bit flipped."""
    return data[:at] + bytes([data[at] ^ (1 << bit)]) + data[at + 1 :]


def borders(path: Path) -> list[int]:
    """Return the lengths to which a file is cut: pages of Parquet, of memory, and its ends."""
    data = path.read_bytes()
    ends = {0, 1, len(data) - 1, *range(PAGE, len(data), PAGE), *range(512, len(data), 512)}
    if data[:4] == b"PAR1":
        for _, start, stop in page_headers(data, pq.read_metadata(path)):
            ends |= {start, stop}
    return sorted(ends)


def run(key: str, folder: Path):
    """Damage a file in one way after the other; all must be noticed."""
    kind, *rest = key.split()
    name = KINDS[kind].begin(folder)
    path = folder / name
    whole = path.read_bytes()
    if rest == ["cuts"]:
        damaged = [(f"cut to {end} bytes", whole[:end]) for end in borders(path)]
    else:
        seed, span = int(rest[0]), rest[1]
        damaged = [
            (f"bit {(at + seed) % 8} of byte {at}", flipped(whole, at, (at + seed) % 8))
            for at in range(*map(int, span.split(":")))
        ]
    right = 0
    for number, (what, data) in enumerate(damaged):
        path.write_bytes(data)
        with mock.patch.object(shards, "SCENES_PER_SHARD", SHARDS):
            try:
                right += not KINDS[kind].noticed(folder, name, number % SAMPLED == 0)
            except Exception as error:
                error.add_note(what)
                raise AssertionError(f"{what}: {type(error).__name__}: {error}") from error
    return {"runs": len(damaged), "unnoticed_but_right": right}


ROW = Row("bits", cases, run)
