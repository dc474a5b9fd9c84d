"""Evaluations on disk: a row an episode in Parquet, and a JSON file about policy and settings."""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
from dataclasses import asdict, dataclass, fields
from io import BytesIO
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Final, get_args, get_type_hints

from internav_data.core.files import FileLimits, check_sha256, read_json, with_sha256
from internav_data.core.storage import write_atomically
from internav_data.dataset import from_table, write_parquet
from internav_data.dataset.parquet import open_parquet
from internav_data.evaluation.metrics import RESULTS, EpisodeResult
from internav_data.records.errors import CorruptDataError, InternavError, UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

ABOUT: Final = "evaluation.json"
"""Name of the JSON file."""
EPISODES: Final = "episodes.parquet"
"""Name of the table."""
FORMAT: Final = 3
"""Version of both files."""
_TABLE_KEYS: Final = {"episodes": int, "table_bytes": int, "table_sha256": str}
"""Keys of `evaluation.json` about the table: its rows, size and digest."""
_FILE: Final = FileLimits(remedy="evaluate again with `camp-eval RUN DATASET`", max_number=2.0**63)
_MAX_ROWS: Final = 5_000_000
_MAX_DEPTH: Final = 3
"""Depth of folders in which evaluations are searched."""


@dataclass(frozen=True, slots=True)
class About:
    """Policy and settings of an evaluation."""

    name: str
    """Name of the row in tables, as `camp --intent none`."""
    method: str
    """Method: camp, ppo, ppo-intent, hrl, nie, a user's own; or a reference policy."""
    dataset: str
    """Fingerprint of the selected episodes (`Dataset.fingerprint`)."""
    split: str
    """Split of the episodes."""
    seed: int
    """Seed of the evaluation."""
    max_steps: int
    """Number of steps after which episodes were truncated."""
    greedy: bool = False
    """Whether the most probable actions were taken instead of sampled ones."""
    is_reference: bool = False
    """Whether it is a reference policy, not a trained agent."""
    intent: str = ""
    """Kind of intent: integrated, policy, recursive, none; empty for methods without one."""
    sync_every: int | None = None
    """Number of rollouts between synchronisations of the intent policy."""
    without_intent: bool = False
    """Whether an agent trained with the intent was evaluated without it."""
    training_seed: int | None = None
    """Seed of the training run."""
    environment_steps: int | None = None
    """Environment steps of training, auxiliary stages included."""
    cloned_frames: int | None = None
    """Expert frames that were cloned before."""
    parameters: int | None = None
    """Number of trained parameters."""
    training_s: float | None = None
    """Wall time of training, seconds."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Evaluation of one policy: a result for each episode."""

    about: About
    """Policy and settings."""
    results: tuple[EpisodeResult, ...]
    """Results in order of episode_id."""


@dataclass(frozen=True, slots=True)
class _Table:
    """Table of results, as `evaluation.json` describes it."""

    rows: int
    bytes: int
    sha256: str


def write_evaluation(folder: Path, about: About, results: Sequence[EpisodeResult]) -> None:
    """Write an evaluation; `evaluation.json` comes last, so a folder that has it is complete."""
    ordered = sorted(results, key=lambda result: result.episode_id)
    (folder / ABOUT).unlink(missing_ok=True)
    info = write_parquet(folder / EPISODES, ordered, RESULTS)
    values = {"format": FORMAT, **asdict(about), "episodes": info.rows}
    values |= {"table_bytes": info.bytes, "table_sha256": info.sha256}
    write_atomically(folder / ABOUT, (json.dumps(with_sha256(values), indent=2) + "\n").encode())


def read_evaluation(folder: Path) -> Evaluation:
    """Read an evaluation back.

    Raises
    ------
    CorruptDataError
        A file is missing, damaged, or of another version.
    """
    about, expected = _about(Path(folder) / ABOUT)
    path = Path(folder) / EPISODES
    with open_parquet(path, RESULTS, BytesIO(_verified(path, expected))) as opened:
        rows = opened.metadata.num_rows
        if rows != expected.rows or rows > _MAX_ROWS:
            raise CorruptDataError(
                f"{path}: expected {expected.rows} rows as {ABOUT} says (at most {_MAX_ROWS}), "
                f"got {rows}; evaluate again"
            )
        table = opened.read_all()
    results = tuple(from_table(table, RESULTS))
    if len({result.episode_id for result in results}) != len(results):
        raise CorruptDataError(f"{path}: an episode is there twice; evaluate again")
    return Evaluation(about, results)


def _verified(path: Path, expected: _Table) -> bytes:
    """Return the bytes of the table; nothing of a damaged one is parsed.

    Raises
    ------
    CorruptDataError
        It is missing, or not the file that `evaluation.json` was written with.
    """
    try:
        size = path.stat().st_size
        data = path.read_bytes() if size == expected.bytes else b""
    except OSError as error:
        raise CorruptDataError(f"{path}: {error.strerror}; evaluate again") from None
    if hashlib.sha256(data).hexdigest() != expected.sha256:
        raise CorruptDataError(
            f"{path}: damaged, or holds other results than {ABOUT} was written with; evaluate again"
        )
    return data


def folder_name(name: str) -> str:
    """Return the name of the folder for a row."""
    return re.sub(r"[^\w.]+", "-", name).strip("-.") or "agent"


def forget_evaluations(folder: Path) -> None:
    """Remove the JSON files of the evaluations in a folder, so that new ones replace them.

    Files of this name that are no evaluations stay.
    """
    for path in folder.glob(f"*/{ABOUT}"):
        with contextlib.suppress(CorruptDataError):
            _about(path)
            path.unlink()


def find_evaluations(path: Path) -> list[Path]:
    """Return the folders of evaluations in a folder, itself included, in order.

    Raises
    ------
    UsageError
        There is none.
    """
    path = Path(path)
    patterns = ["/".join(["*"] * depth + [ABOUT]) for depth in range(_MAX_DEPTH + 1)]
    found = sorted({file.parent for pattern in patterns for file in path.glob(pattern)})
    if not found:
        raise UsageError(
            f"{path}: holds no evaluation (no {ABOUT} in it or below); make one with "
            "`camp-eval RUN DATASET`"
        )
    return found


def _about(path: Path) -> tuple[About, _Table]:
    """Return what `evaluation.json` says: policy and settings, and the table of results."""

    def wrong(text: str) -> InternavError:
        return _FILE.refusal(path, text)

    values = read_json(path, _FILE)
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise wrong(f"expected an evaluation of format {FORMAT}")
    names = [field.name for field in fields(About)]
    check_sha256(values, path, _FILE, ["format", *names, *_TABLE_KEYS])
    if missing := [name for name in names if name not in values]:
        raise wrong(f"{missing[0]} is missing")
    hints = get_type_hints(About)
    for field in fields(About):
        kinds = get_args(hints[field.name]) or (hints[field.name],)
        kind = type(values.get(field.name))
        if kind not in kinds and not (kind is int and float in kinds):
            expected = " or ".join("null" if k is NoneType else k.__name__ for k in kinds)
            raise wrong(f"{field.name}: expected {expected}, got {kind.__name__}")
    for key, kind in _TABLE_KEYS.items():
        if type(values.get(key)) is not kind:
            expected = "a count" if kind is int else "a digest"
            raise wrong(f"{key}: expected {expected}")
    about = About(**{name: values[name] for name in names})
    return about, _Table(*(values[key] for key in _TABLE_KEYS))
