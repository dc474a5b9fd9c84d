"""An evaluation on disk: a row a episode in Parquet, and beside it what was evaluated, and how."""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, Final, get_args, get_type_hints

from internav_data.core.storage import write_atomically
from internav_data.dataset import from_table, write_parquet
from internav_data.dataset.parquet import open_parquet, read_all
from internav_data.evaluation.metrics import RESULTS, EpisodeResult
from internav_data.records.errors import CorruptDataError, UsageError

if TYPE_CHECKING:
    from collections.abc import Sequence

ABOUT: Final = "evaluation.json"
EPISODES: Final = "episodes.parquet"
FORMAT: Final = 2
_BYTES_AT_MOST: Final = 1_000_000
_ROWS_AT_MOST: Final = 5_000_000
_DEPTH: Final = 3
"""How many folders deep evaluations are looked for."""


@dataclass(frozen=True, slots=True)
class About:
    """What was evaluated, and how."""

    name: str
    """Of its row, as in `camp --intent none`."""
    method: str
    """camp, ppo, ppo-intent, hrl, nie, a user's own; or a reference policy."""
    dataset: str
    """Fingerprint of the selected episodes (`Dataset.fingerprint`)."""
    split: str
    seed: int
    """Of the evaluation."""
    max_steps: int
    greedy: bool = False
    is_reference: bool = False
    """A reference policy, not a trained agent."""
    intent: str = ""
    """How the intent was made: integrated, policy, recursive, none; empty without one."""
    sync_every: int | None = None
    """Rollouts between synchronisations of the intent policy."""
    without_intent: bool = False
    """Trained with the intent, evaluated without."""
    training_seed: int | None = None
    environment_steps: int | None = None
    """Of training, auxiliary stages included."""
    cloned_frames: int | None = None
    """Expert frames it was cloned from beforehand."""
    parameters: int | None = None
    training_s: float | None = None
    """Wall time of training."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What somebody did in every episode."""

    about: About
    results: tuple[EpisodeResult, ...]
    """In order of episode_id."""


def write_evaluation(folder: Path, about: About, results: Sequence[EpisodeResult]) -> None:
    """Write an evaluation; `evaluation.json` comes last, so what has it is whole."""
    ordered = sorted(results, key=lambda result: result.episode_id)
    (folder / ABOUT).unlink(missing_ok=True)
    info = write_parquet(folder / EPISODES, ordered, RESULTS)
    said = {"format": FORMAT, **asdict(about), "episodes": info.rows}
    said["logical_digest"] = info.logical_digest
    write_atomically(folder / ABOUT, (json.dumps(said, indent=2) + "\n").encode())


def read_evaluation(folder: Path) -> Evaluation:
    """Read an evaluation back.

    Raises
    ------
    CorruptDataError
        A file is missing, damaged, or of another version.
    """
    path = Path(folder) / ABOUT
    about, episodes = _about(path)
    table_path = Path(folder) / EPISODES
    with open_parquet(table_path, RESULTS) as opened:
        rows = opened.metadata.num_rows
        if rows != episodes or rows > _ROWS_AT_MOST:
            raise CorruptDataError(
                f"{table_path}: expected {episodes} rows as {ABOUT} says (at most "
                f"{_ROWS_AT_MOST}), got {rows}; evaluate again"
            )
        results = tuple(from_table(read_all(table_path, opened, RESULTS), RESULTS))
    if len({result.episode_id for result in results}) != len(results):
        raise CorruptDataError(f"{table_path}: an episode is there twice; evaluate again")
    return Evaluation(about, results)


def folder_name(name: str) -> str:
    """Return a folder's name for a row."""
    return re.sub(r"[^\w.]+", "-", name).strip("-.") or "agent"


def forget_evaluations(folder: Path) -> None:
    """Take away what makes evaluations of the folders in a folder; new ones replace them."""
    for path in folder.glob(f"*/{ABOUT}"):
        path.unlink()


def find_evaluations(path: Path) -> list[Path]:
    """Return the folders of evaluations in a folder, itself included, in order.

    Raises
    ------
    UsageError
        There is none.
    """
    path = Path(path)
    patterns = ["/".join(["*"] * depth + [ABOUT]) for depth in range(_DEPTH + 1)]
    found = sorted({file.parent for pattern in patterns for file in path.glob(pattern)})
    if not found:
        raise UsageError(
            f"{path}: holds no evaluation (no {ABOUT} in it or below); make one with "
            "`camp-eval RUN DATASET`"
        )
    return found


def _about(path: Path) -> tuple[About, int]:
    def wrong(what: str) -> CorruptDataError:
        return CorruptDataError(f"{path}: {what}; evaluate again with `camp-eval RUN DATASET`")

    try:
        with path.open("rb") as file:
            raw = file.read(_BYTES_AT_MOST + 1)
        said: Any = json.loads(raw.decode("utf-8")) if len(raw) <= _BYTES_AT_MOST else None
    except OSError as error:
        raise wrong(f"cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        raise wrong("not JSON") from error
    if not isinstance(said, dict) or said.get("format") != FORMAT:
        raise wrong(f"expected an evaluation of format {FORMAT}")
    hints = get_type_hints(About)
    for field in fields(About):
        kinds = get_args(hints[field.name]) or (hints[field.name],)
        kind = type(said.get(field.name))
        if kind not in kinds and not (kind is int and float in kinds):
            names = " or ".join("null" if k is NoneType else k.__name__ for k in kinds)
            raise wrong(f"{field.name}: expected {names}, got {kind.__name__}")
    if type(said.get("episodes")) is not int:
        raise wrong("episodes: expected a count")
    return About(**{field.name: said[field.name] for field in fields(About)}), said["episodes"]
