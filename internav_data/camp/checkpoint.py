"""Checkpoints: tensors in safetensors, the rest in JSON, complete or absent.

Nothing is unpickled. A checkpoint is a folder: `weights.safetensors` (the agent's, enough to act),
`training.safetensors` (the optimiser's moments, hidden states) and
`checkpoint.json`, which has the sizes and digests of both, and its own. A run keeps its last
checkpoint and its best; `checkpoints.json` names them, and takes a new one in only when it is on
the disk. It notes as `leftovers` what a kill would leave behind; no other folder is ever removed.

`TrainState`, `pack` and `unpack` turn training between two updates into counters and tensors by
name, and back.
"""

from __future__ import annotations

import json
import platform
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import safetensors
import torch
from safetensors.torch import load_file, save_file
from torch import Tensor
from torch.optim import Optimizer

from internav_data.camp.agents import make_agent
from internav_data.camp.agents.protocol import Agent, State
from internav_data.camp.config import CampConfig, from_mapping, preset
from internav_data.camp.stages import check_parts
from internav_data.core import config as values
from internav_data.core import files, storage
from internav_data.records.errors import CorruptDataError, InternavError, UsageError

if TYPE_CHECKING:
    from internav_data.envs.slot import EpisodeSnapshot

FORMAT: Final = 3
FOLDER: Final = "checkpoints"
POINTER: Final = "checkpoints.json"
_NAMED: Final = ("last", "best")
"""Checkpoints that a run's list names."""
_SERIAL: Final = re.compile(r"\d{6,}")
"""Name of a checkpoint's folder in a run."""
ABOUT, WEIGHTS, TRAINING = "checkpoint.json", "weights.safetensors", "training.safetensors"
_EXPORTED: Final = ("environment_steps", "cloned_frames", "training_s", "dataset")
"""Progress that goes with an agent alone: evaluations show it."""
_FILE: Final = files.FileLimits(
    remedy="copy the checkpoint again", max_bytes=256_000_000, max_values=50_000_000
)
"""Limits of the JSON files; the actions of 65,536 environments stay below."""
_MAX_TENSOR_BYTES: Final = 16_000_000_000


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """State of a run between two updates."""

    method: str
    config: CampConfig
    weights: Mapping[str, Tensor]
    """Parameters of the agent by name."""
    progress: Mapping[str, Any] = field(default_factory=dict)
    """Plain JSON: counters, the stage, snapshots of the environments, the log's length."""
    training: Mapping[str, Tensor] = field(default_factory=dict)
    """Tensors of `pack`; empty for an agent alone."""


def save(run: Path, checkpoint: Checkpoint, *, score: float | None = None) -> Path:
    """Write a checkpoint and make it the run's last one; return its folder.

    Parameters
    ----------
    run
        The run's folder.
    checkpoint
        Checkpoint to write.
    score
        Validation score, if there is one; the checkpoint becomes the best unless another is better.
    """
    known = _swept(run, _pointer(run))
    folder = _next_folder(run, known)
    # Noted before they are written, so that what a kill leaves is told from a stranger's folders.
    leftovers = [folder.name, storage.temporary_of(folder.name)]
    _write_json(run / POINTER, known | {"leftovers": leftovers})
    _write_folder(folder, checkpoint)
    pointer = {**known, "format": FORMAT, "serial": int(folder.name), "last": folder.name}
    best = best_score(run)
    if score is not None and (best is None or score >= best):
        pointer |= {"best": folder.name, "best_score": score}
    replaced = {known.get("last"), known.get("best")} - {pointer["last"], pointer.get("best")}
    _write_json(run / POINTER, pointer | {"leftovers": sorted(filter(None, replaced))})
    _swept(run, _pointer(run))
    return folder


def _next_folder(run: Path, known: Mapping[str, Any]) -> Path:
    """Return the first folder after the last checkpoint's that nobody has made."""
    serial = int(known.get("serial", 0)) + 1
    while (run / FOLDER / f"{serial:06d}").exists():
        serial += 1
    return run / FOLDER / f"{serial:06d}"


def _swept(run: Path, pointer: dict[str, Any]) -> dict[str, Any]:
    """Remove the folders that are noted as leftovers; return the pointer without them."""
    rest = {key: value for key, value in pointer.items() if key != "leftovers"}
    if found := pointer.get("leftovers"):
        for name in filter(_is_ours, found):
            if name not in {rest.get("last"), rest.get("best")}:
                shutil.rmtree(run / FOLDER / name, ignore_errors=True)
        _write_json(run / POINTER, rest)
    return rest


def _is_ours(name: object) -> bool:
    return isinstance(name, str) and bool(_SERIAL.fullmatch(storage.final_of(name) or name))


def _write_json(path: Path, content: Mapping[str, Any]) -> None:
    text = json.dumps(files.with_sha256(content), indent=1)
    storage.write_atomically(path, (text + "\n").encode())


def best_score(run: Path) -> float | None:
    """Return the validation score of a run's best checkpoint."""
    score = _pointer(run).get("best_score")
    return float(score) if isinstance(score, int | float) else None


def has_checkpoint(run: Path) -> bool:
    """Return whether a folder is a checkpoint, or a run with one."""
    return "last" in _pointer(run) or (run / ABOUT).is_file()


def find(path: Path, which: str = "last") -> Path:
    """Return the folder of a run's checkpoint, `last` or `best`; a checkpoint is its own.

    Raises
    ------
    UsageError
        There is none.
    CorruptDataError
        The run's list of them is damaged.
    """
    if (path / ABOUT).is_file():
        return path
    if which not in _NAMED:
        raise UsageError(f"which: expected one of {', '.join(_NAMED)}, got {which!r}")
    name = _pointer(path).get(which)
    if name is None:
        raise UsageError(
            f"{path}: no {which} checkpoint here; expected the folder of a run of `camp-train` "
            f"(with {POINTER}) or of a checkpoint (with {ABOUT})"
        )
    if not isinstance(name, str) or name != Path(name).name or name.startswith("."):
        raise CorruptDataError(f"{path / POINTER}: {which}: expected a folder's name, got {name!r}")
    return path / FOLDER / name


def read(path: Path, which: str = "last", *, training: bool = True) -> Checkpoint:
    """Read a checkpoint.

    Parameters
    ----------
    path
        A run's folder, or a checkpoint's.
    which
        `last` or `best`.
    training
        Read the training tensors, too.

    Raises
    ------
    UsageError
        There is none.
    CorruptDataError
        The checkpoint is damaged, of another version, or its weights do not fit its config.
    """
    folder = find(path, which)
    about = _json(folder / ABOUT)
    if about.get("format") != FORMAT:
        raise CorruptDataError(
            f"{folder / ABOUT}: format {about.get('format')!r}: this release reads {FORMAT}; "
            "read it with the release that wrote it"
        )
    kinds = {"method": str, "config": dict, "files": dict, "progress": dict}
    if not all(isinstance(about.get(name), kind) for name, kind in kinds.items()):
        raise CorruptDataError(f"{folder / ABOUT}: expected {', '.join(kinds)}")
    method, known = about["method"], about["files"]
    try:
        config = from_mapping(preset("small"), about["config"], "config")
        with torch.device("meta"):  # names and shapes, without their memory
            wanted = make_agent(method, config).state_dict()
    except InternavError as error:
        raise CorruptDataError(f"{folder / ABOUT}: {error}") from error
    weights = _tensors(folder / WEIGHTS, known)
    for name in sorted({*weights, *wanted}):
        found, right = _kind(weights.get(name)), _kind(wanted.get(name))
        if found != right:
            raise CorruptDataError(
                f"{folder / WEIGHTS}: {name} has type and shape {found}, the method and sizes of "
                f"{ABOUT} want {right}: these are another agent's weights"
            )
    rest = _tensors(folder / TRAINING, known) if training else {}
    return Checkpoint(method, config, weights, about["progress"], rest)


def load_agent(path: str | Path, which: str = "last") -> Agent[Any]:
    """Return the trained agent of a run or checkpoint, on the CPU.

    It has the attributes `method`, `config` and `progress`.

    Parameters
    ----------
    path
        A run's folder, a checkpoint's, or that of an exported agent.
    which
        `last` or `best`, of a run.

    Raises
    ------
    UsageError
        There is no checkpoint.
    CorruptDataError
        The checkpoint is damaged, of another version, or its weights do not fit its config.
    """
    checkpoint = read(Path(path), which, training=False)
    agent = make_agent(checkpoint.method, checkpoint.config)
    agent.load_state_dict(dict(checkpoint.weights))
    agent.eval()
    vars(agent).update(
        method=checkpoint.method, config=checkpoint.config, progress=dict(checkpoint.progress)
    )
    return agent


def export_agent(path: str | Path, folder: str | Path, which: str = "last") -> Path:
    """Write an agent alone, to be published: `load_agent` and `camp-eval` take the folder.

    The training tensors are left out: no run can be resumed from it.

    Parameters
    ----------
    path
        A run's folder, or a checkpoint's.
    folder
        Folder to write, which must not be there yet.
    which
        `last` or `best`, of a run.

    Raises
    ------
    UsageError
        There is no checkpoint, or the folder is there already.
    CorruptDataError
        The checkpoint is damaged, of another version, or its weights do not fit its config.
    """
    folder = Path(folder)
    if folder.exists():
        raise UsageError(f"{folder}: is there already; choose another folder")
    found = read(Path(path), which, training=False)
    known = {name: found.progress[name] for name in _EXPORTED if name in found.progress}
    _write_folder(folder, Checkpoint(found.method, found.config, found.weights, known))
    return folder


def _write_folder(folder: Path, checkpoint: Checkpoint) -> None:
    def fill(temporary: Path) -> None:
        described = {}
        for name, tensors in ((WEIGHTS, checkpoint.weights), (TRAINING, checkpoint.training)):
            copies = {key: value.detach().cpu().contiguous() for key, value in tensors.items()}
            try:
                save_file(copies, temporary / name)
            except safetensors.SafetensorError as error:  # a full disk, in words alone
                raise OSError(None, str(error), str(temporary / name)) from error
            # safetensors makes files private: readers of the folder may read them too.
            (temporary / name).chmod(temporary.stat().st_mode & 0o666)
            described[name] = _size_and_digest(temporary / name)
            storage.sync(temporary / name)
        about = {
            "format": FORMAT,
            "method": checkpoint.method,
            "config": values.plain(checkpoint.config),
            "progress": checkpoint.progress,
            "files": described,
            "versions": {
                "python": platform.python_version(),
                **{name: version(name) for name in ("internav-data", "torch", "numpy")},
            },
        }
        _write_json(temporary / ABOUT, about)

    storage.write_folder_atomically(folder, fill)


def _pointer(run: Path) -> dict[str, Any]:
    path = run / POINTER
    return _json(path) if path.is_file() else {}


def _json(path: Path) -> dict[str, Any]:
    """Read an object with a digest of its own."""
    value = files.read_json(path, _FILE)
    if not isinstance(value, dict):
        raise CorruptDataError(f"{path}: expected a JSON object, got {type(value).__name__}")
    files.check_sha256(value, path, _FILE, ())
    return value


def _tensors(path: Path, known: Mapping[str, Any]) -> dict[str, Tensor]:
    """Read tensors whose file has the size and digest that `known` has."""
    try:
        found, expected = _size_and_digest(path), known.get(path.name)
        if found != expected:
            raise CorruptDataError(
                f"{path}: its bytes are not those that {ABOUT} knows: expected "
                f"{str(expected)[:100]}, got {found}; copy the checkpoint again"
            )
        tensors = load_file(path)
    except OSError as error:
        raise CorruptDataError(f"{path}: {error.strerror or error}") from error
    except safetensors.SafetensorError as error:
        raise CorruptDataError(f"{path}: this is no safetensors file: {error}") from error
    for name, value in tensors.items():
        if value.is_floating_point() and not bool(torch.isfinite(value).all()):
            raise CorruptDataError(
                f"{path}: {name} holds what is no finite number: take an earlier checkpoint"
            )
    return tensors


def _size_and_digest(path: Path) -> dict[str, Any]:
    """Return the size of a file of tensors and the digest of its bytes."""
    size = files.size_of_regular(path)
    if size > _MAX_TENSOR_BYTES:
        raise CorruptDataError(f"{path}: {size} bytes, expected {_MAX_TENSOR_BYTES} at most")
    return {"bytes": size, "sha256": storage.file_sha256(path)}


def _kind(tensor: Tensor | None) -> tuple[torch.dtype, torch.Size] | None:
    """Return type and shape of a tensor; None for none."""
    return None if tensor is None else (tensor.dtype, tensor.shape)


_OPTIMISER, _STATE, _STARTS = "optimiser", "state", "starts"
"""Groups of the training tensors."""


@dataclass(slots=True)
class TrainState:
    """Counters of a run, to resume from."""

    parts: tuple[str, ...] = ()
    """Parts of the schedule that it is to go through."""
    clones: bool = False
    """Whether experts are cloned first."""
    stage: str = ""
    """Stage that is under way or has just ended; empty before the first."""
    done: int = 0
    """Updates of that stage."""
    updates: int = 0
    """PPO updates of all stages."""
    environment_steps: int = 0
    cloned_frames: int = 0
    training_s: float = 0.0
    critics: Mapping[str, Annotated[int, values.Bounds(0)]] = field(default_factory=dict)
    """Rollouts that each critic has learnt from."""
    window: tuple[Mapping[str, float], ...] = ()
    """Metrics of the last episodes that ended in the stage."""
    log: Annotated[int, values.Bounds(0)] = 0
    """Size of the log in bytes: later rows are of updates that are done again."""

    @classmethod
    def from_progress(cls, progress: Mapping[str, Any]) -> TrainState:
        """Read the counters of a checkpoint.

        Raises
        ------
        CorruptDataError
            A value is missing or of another type.
        """
        counters = {f.name: progress.get(f.name) for f in fields(cls)}
        try:
            state = values.from_mapping(cls(), counters, "progress")
            values.check_bounds(state)
            if state.parts:
                check_parts(state.parts)
        except UsageError as error:
            raise CorruptDataError(f"checkpoint: {error}") from error
        return state


def pack(optimiser: Optimizer, state: State, episode_starts: Tensor) -> dict[str, Tensor]:
    """Return an optimiser's moments, an agent's memory and where episodes start, by name.

    `state` (n, …) and `episode_starts` (n,) bool are those of all environments.
    """
    tensors = {_STARTS: episode_starts}
    for number, moments in optimiser.state_dict()["state"].items():
        tensors |= {f"{_OPTIMISER}/{number}/{name}": value for name, value in moments.items()}
    return tensors | {f"{_STATE}/{name}": value for name, value in state.items()}


def unpack(
    tensors: Mapping[str, Tensor], optimiser: Optimizer, blank: State, local: range, count: int
) -> tuple[State, Tensor]:
    """Restore an optimiser; return the memory and the episode starts of some environments.

    Parameters
    ----------
    tensors
        Tensors of `pack`, of all `count` environments.
    optimiser
        New optimiser of the same parameters.
    blank
        Initial memory of the agent, (n, …).
    local, count
        Numbers of this rank's environments, and how many there are.

    Raises
    ------
    CorruptDataError
        A tensor is missing, or belongs to another agent or number of environments.
    """
    parameters = [p for group in optimiser.param_groups for p in group["params"]]
    moments: dict[int, dict[str, Tensor]] = {}
    for key, value in tensors.items():
        group, _, rest = key.partition("/")
        if group != _OPTIMISER:
            continue
        number, _, name = rest.partition("/")
        k = int(number) if number.isdecimal() else len(parameters)
        fits = k < len(parameters) and value.shape in {parameters[k].shape, torch.Size([])}
        if not fits or not value.is_floating_point():
            raise CorruptDataError(f"checkpoint: {key} is of no parameter that is trained now")
        moments.setdefault(k, {})[name] = value
    groups = optimiser.state_dict()["param_groups"]
    optimiser.load_state_dict({"state": moments, "param_groups": groups})

    def rows(name: str, like: Tensor) -> Tensor:
        found, right = tensors.get(name), (like.dtype, torch.Size([count, *like.shape[1:]]))
        if found is None or _kind(found) != right:
            raise CorruptDataError(f"checkpoint: {name}: expected {right}, got {_kind(found)}")
        return found[local.start : local.stop].to(like.device)

    state = {name: rows(f"{_STATE}/{name}", like) for name, like in blank.items()}
    episode_starts = rows(_STARTS, torch.zeros(1, dtype=torch.bool))
    return state, episode_starts


def snapshots_of(progress: Mapping[str, Any], local: range) -> list[EpisodeSnapshot]:
    """Return the snapshots of the environments with these numbers.

    Raises
    ------
    CorruptDataError
        There are none, or fewer, or they are damaged.
    """
    from internav_data.envs.slot import EpisodeSnapshot  # noqa: PLC0415 - the camera's kernels

    states = progress.get("environments")
    if not isinstance(states, list) or len(states) < local.stop:
        raise CorruptDataError(
            f"checkpoint: progress: environments: expected a list of {local.stop} at least"
        )
    return [EpisodeSnapshot.from_json(state) for state in states[local.start : local.stop]]
