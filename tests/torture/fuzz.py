"""Readers of files against bytes that were changed at random: a value, or a typed error in a line,
in five seconds of processor time and within 300 MB.

A case is a reader and a seed: "parquet 3", twenty seconds of processor time. `fuzz_atheris.py`
steers the same readers by what code the bytes reach.
"""

from __future__ import annotations

import contextlib
import functools
import json
import resource
import signal
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import bits
from campaign import Row
from strategies import rng
from stub_runs import contents, forked, in_scratch, made, scratch
from test_hostile_files import AGENT, DATASET, HOSTILE, JSON, TOMLS
from test_hostile_files import READERS as SMALL

from internav_data.catalog import load_user_assets
from internav_data.core.files import DIGEST, with_sha256
from internav_data.dataset import ASSETS, EPISODES, SCENES, read_table
from internav_data.records.errors import InternavError
from internav_data.viewer import ViewedDataset, respond

if TYPE_CHECKING:
    from collections.abc import Callable

SECONDS, SEEDS = 20.0, 30
"""Processor time of a case, and cases of a reader: ten minutes in all."""
MAX_MB, MAX_S, HANGS_S = 300, 5.0, 100
MESHES = ("obj", "stl", "ply", "glb", "off")
MAX_MESH_S = 30.0
"""Of a mesh that is no longer convex but right: its decomposition (CoACD) takes seconds."""


def beside(place: Path, name: str) -> Path:
    """Return where a reader's file goes, with what stands beside it."""
    beside = {"manifest.json": DATASET, "checkpoint.json": AGENT}
    path = place / name
    if name in beside and not place.exists():
        place.mkdir(parents=True)
        for other, data in contents(beside[name]).items():
            (place / other).parent.mkdir(parents=True, exist_ok=True)
            if data is not None:
                (place / other).write_bytes(data)
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _small(name: str) -> tuple[str, bytes, Callable[[Path], object]]:
    valid = JSON[name][1] if name in JSON else TOMLS[name][1]
    read = _signed(SMALL[name]) if DIGEST in valid else SMALL[name]
    return name, (valid if isinstance(valid, str) else json.dumps(valid)).encode(), read


def _signed(read: Callable[[Path], object]) -> Callable[[Path], object]:
    """Give JSON of an even length the digest that fits, so that readers look at its values too."""

    def signed(path: Path) -> object:
        data = path.read_bytes()
        if len(data) % 2 == 0:
            with contextlib.suppress(ValueError, RecursionError):  # no JSON: the reader's to refuse
                values = json.loads(data)
                if isinstance(values, dict):
                    path.write_text(json.dumps(with_sha256(values)))
        return read(path)

    return signed


def _damaged(kind: str) -> tuple[str, bytes, Callable[[Path], object]]:
    """Return a kind of file of `bits`: its reader compares nothing here, it only reads."""
    with tempfile.TemporaryDirectory() as folder:
        name = bits.KINDS[kind].begin(Path(folder))
        data = (Path(folder) / name).read_bytes()
    return f"{kind}/{name}", data, bits.READERS[kind]


def _mesh(suffix: str) -> tuple[str, bytes, Callable[[Path], object]]:
    import trimesh

    data = trimesh.creation.box((0.4, 0.6, 0.8)).export(file_type=suffix)
    text = data.encode() if isinstance(data, str) else data
    return f"meshes/thing.{suffix}", text, lambda path: load_user_assets(path.parent)


def _table(spec) -> tuple[str, bytes, Callable[[Path], object]]:
    folder = scratch("tables")
    made(folder / "d", 3)
    data = next((folder / "d" / "data").rglob(f"{spec.name}*/*.parquet"), None) or next(
        (folder / "d" / "data").glob(f"{spec.name}*.parquet")
    )
    return f"{spec.name}.parquet", data.read_bytes(), lambda path: read_table(path, spec)


_viewed: list[ViewedDataset] = []


def _url(path: Path) -> None:
    if not _viewed:
        _viewed.append(ViewedDataset(DATASET))
    answer = respond(_viewed[0], path.read_bytes().decode("latin-1"))
    assert answer.status in {200, 400, 404, 414, 501}, answer.status


_URL = b"/api/episodes?split=train&mode=blocked&room_count=1-3&sort=-obstacle_count&page=2"
READERS: dict[str, Callable[[], tuple[str, bytes, Callable[[Path], object]]]] = {
    "parquet": lambda: _table(EPISODES),
    "parquet-scenes": lambda: _table(SCENES),
    "parquet-assets": lambda: _table(ASSETS),
    "weights": lambda: _damaged("weights"),
    "training": lambda: _damaged("training"),
    "staged": lambda: _damaged("staged"),
    "journal": lambda: _damaged("journal"),
    "cache": lambda: _damaged("cache"),
    "evaluation": lambda: _damaged("evaluation.parquet"),
    **{suffix: functools.partial(_mesh, suffix) for suffix in MESHES},
    "url": lambda: ("url", _URL, _url),
    **{name: functools.partial(_small, name) for name in SMALL},
}


@functools.cache
def reader_of(name: str) -> tuple[str, bytes, Callable[[Path], object]]:
    """Return the name of a reader's file, its valid content, and the reader."""
    return READERS[name]()


def read_or_refused(read: Callable[[Path], object], path: Path) -> bool:
    """Return whether a reader takes a file; else it must raise an error for users, in one line."""
    try:
        read(path)
    except InternavError as error:
        if "\n" in str(error):
            raise AssertionError(f"several lines: {error}") from error
        return False
    return True


def changed(valid: bytes, random) -> bytes:
    """Return bytes with some changes, each drawn from six kinds."""
    data = bytearray(valid)
    for _ in range(int(random.integers(1, 6))):
        at = int(random.integers(0, len(data) + 1))
        length = int(2 ** random.uniform(0, 8))
        match int(random.integers(0, 6)):
            case 0 if data:
                data[at % len(data)] ^= 1 << int(random.integers(0, 8))
            case 1:
                data[at : at + length] = random.bytes(length)
            case 2:
                del data[at : at + length]
            case 3:
                data[at:at] = data[at : at + length] * int(random.integers(1, 9))
            case 4:
                data[at : at + 8] = int(2 ** random.uniform(0, 63.9)).to_bytes(8, "little")
            case _:
                value = HOSTILE[int(random.integers(0, len(HOSTILE)))]
                data[at : at + length] = json.dumps(value).encode()
    return bytes(data)


def hammer(name: str, seed: int, seconds: float, folder: Path) -> int:
    """Have a reader read changed bytes for some processor time; return how many times it did."""
    relative, valid, read = reader_of(name)
    path = beside(folder, relative)
    path.write_bytes(valid)
    assert read_or_refused(read, path), f"{name}: what is valid is refused"  # and all is imported
    signal.signal(signal.SIGALRM, signal.SIG_DFL)  # a reader that waits is killed
    before, end, number = _peak_mb(), time.process_time() + seconds, 0
    while time.process_time() < end:
        data = changed(valid, rng([seed, number]))
        path.unlink(missing_ok=True)
        path.write_bytes(data)
        began = time.process_time()
        signal.alarm(HANGS_S)
        where = f"{name}, seed {seed}, input {number} ({len(data)} bytes, {data[:60]!r})"
        try:
            read_or_refused(read, path)
        except Exception as error:
            raise AssertionError(f"{where}: {type(error).__name__}: {error}") from error
        signal.alarm(0)
        took, more = time.process_time() - began, _peak_mb() - before
        assert took < (MAX_MESH_S if name in MESHES else MAX_S), f"{where}: {took:.1f} s"
        assert more < MAX_MB, f"{where}: {more:.0f} MB"
        number += 1
    return number


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def cases():
    """Yield all readers in turns."""
    yield from (f"{name} {seed}" for seed in range(SEEDS) for name in READERS)


def run(key: str, folder: Path):
    """Fuzz a reader with a seed, in a copy of this process."""
    name, seed = key.rsplit(" ", 1)
    reader_of(name)  # once for all copies
    outcome = forked(lambda: hammer(name, int(seed), SECONDS, folder / "place"))
    assert outcome.isdigit(), " ".join(outcome.split())[-1500:]
    return {"runs": int(outcome)}


ROW = Row("fuzz", cases, in_scratch(run))
