"""What a run says of itself: a JSON row an update in `log.jsonl`, and TensorBoard beside it.

A run's progress in words: the line while it trains, and what is said at its end.
"""

from __future__ import annotations

import json
from collections import deque
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Final, Self

from internav_data.camp.agents.options import DONE, OPTIONS, PICK, PUSH
from internav_data.core.progress import Ticker, clock
from internav_data.envs.tasks import STEP, SUCCESS
from internav_data.records.errors import CorruptDataError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path
    from types import TracebackType

    from torch import Tensor

    from internav_data.camp.distributed import DistributedContext
    from internav_data.camp.rollout import Rollout

    Row = dict[str, Any]
    """Plain JSON: numbers by name, one level of groups."""
    from typing import TextIO

LOG: Final = "log.jsonl"
BOARD: Final = "tensorboard"
OPTION_NAMES: Final = ("navigate", "push", "pick", "done")
_LEAST: Final = 1e-12
_SUCCESSES: Final = {
    "interaction": ("pushes", "picks", "drops"),
    "push": ("pushes",),
    "pick": ("picks",),
    "drop": ("drops",),
}
"""Shares of successes that are logged, and what is counted for each."""


class MetricsLogger:
    """Appends rows; goes on after those that a checkpoint knew of.

    Parameters
    ----------
    run
        The run's folder.
    position
        Bytes of the log that count; what comes after is cut off: those updates are done again.
    board
        Write TensorBoard's files too, if the `tensorboard` package is there.

    Raises
    ------
    CorruptDataError
        The log is shorter than that.
    """

    def __init__(self, run: Path, position: int = 0, *, board: bool = True) -> None:
        path = run / LOG
        size = path.stat().st_size if path.exists() else 0
        if size < position:
            raise CorruptDataError(
                f"{path}: {size} bytes, the checkpoint knows of {position}: put the log back that "
                "belongs to it"
            )
        self._file = path.open("ab")
        self._file.truncate(position)
        self.position = position
        self._board: Any = None
        if board and find_spec("tensorboard") is not None:
            from torch.utils.tensorboard import SummaryWriter  # noqa: PLC0415 - seconds

            # What a resumed run does again it does to the last bit, so no step is to be purged.
            self._board = SummaryWriter(str(run / BOARD))

    def write(self, row: Row) -> None:
        """Append a row; its "step" is where TensorBoard draws it."""
        line = (json.dumps(row, allow_nan=False) + "\n").encode()
        self._file.write(line)
        self._file.flush()
        self.position += len(line)
        if self._board is not None:
            for name, value in flat(row):
                self._board.add_scalar(name, value, row["step"])

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close what is open."""
        self._file.close()
        if self._board is not None:
            self._board.close()


def flat(row: Mapping[str, Any]) -> Iterable[tuple[str, float]]:
    """Yield a row's numbers by name, groups joined by a slash."""
    for name, value in row.items():
        if isinstance(value, dict):
            yield from ((f"{name}/{inner}", number) for inner, number in flat(value))
        elif isinstance(value, int | float) and name != "step":
            yield name, float(value)


class EpisodeWindow:
    """The last episodes that ended: what curves are made of.

    Parameters
    ----------
    size
        How many.
    kept
        Of an earlier run.
    """

    def __init__(self, size: int, kept: Iterable[Mapping[str, float]] = ()) -> None:
        self._episodes: deque[dict[str, float]] = deque((dict(each) for each in kept), size)
        self.ended = 0

    def add(self, ended: Sequence[Mapping[str, Any]]) -> None:
        """Take in what was said of a rollout's episodes."""
        self.ended = len(ended)
        for metrics in ended:
            self._episodes.append({name: float(value) for name, value in metrics.items()})

    def noted(self, rollout: Rollout, own: range, ranks: DistributedContext) -> Row:
        """Take in the episodes that ended on all ranks; return what was decided on them.

        `own` are the numbers of this rank's environments.
        """
        ended = ranks.listed(
            [[each.step, own[each.environment], each.metrics] for each in rollout.finished]
        )
        self.add([metrics for _, _, metrics in sorted(ended, key=lambda e: e[:2])])
        noted = rollout.batch.record
        record = {n: ranks.joined(noted[n], 1) for n in DECISIVE if n in noted}
        return decisions(record, ranks.joined(rollout.rewards, 1))

    def plain(self) -> list[dict[str, float]]:
        """Return what to keep in a checkpoint."""
        return list(self._episodes)

    def row(self) -> Row:
        """Return means over the episodes: `success`, lengths, what paid, interactions' success."""
        if not self._episodes:
            return {"ended": self.ended}
        sums: dict[str, float] = {}
        counts: dict[str, int] = {}
        for episode in self._episodes:
            for name, value in episode.items():
                sums[name] = sums.get(name, 0.0) + value
                counts[name] = counts.get(name, 0) + 1
        means = {name: value / counts[name] for name, value in sums.items()}
        said = {"ended": self.ended, **means}
        said |= {f"reward_{name}": value for name, value in reward_parts(means).items()}
        for told, names in _SUCCESSES.items():
            tried = sum(sums.get(f"{name}_tried", 0.0) for name in names)
            if tried:
                done = sum(sums.get(f"{name}_done", 0.0) for name in names)
                said[f"{told}_success"] = done / tried
        return said


def reward_parts(means: Mapping[str, float]) -> dict[str, float]:
    """Return what pays in an episode; the parts add up to "return"."""
    parts = {
        "steps": STEP * means.get("steps", 0.0),
        "success": SUCCESS * means.get("success", 0.0),
        "ways": means.get("interaction_reward_m", 0.0)
        + means.get("openings", 0.0)
        - means.get("closings", 0.0),
        "actions": means.get("auxiliary_reward", 0.0),
    }
    return {**parts, "moves": means.get("return", 0.0) - sum(parts.values())}


DECISIVE: Final[tuple[str, ...]] = (
    "action_probs", "intent", "option", "choice", "decide", "done_probability", "forced", "plan",
    "meant",
)  # fmt: skip
"""What `decisions` reads of a record, where it is there."""


def decisions(record: Mapping[str, Tensor], rewards: Tensor) -> Row:
    """Return what an agent decided in a rollout, of what it recorded and was paid: (T, n, …).

    `done_probability` is P(Done), the chance of ending the episode; `intent_kl` is the divergence
    of the decision from what was meant, KL(P(omega) || P(omega')), where there is a decision;
    shares are of all steps, lengths in actions.
    """
    said: Row = {"reward": float(rewards.mean())}
    if "action_probs" in record:
        said["done_probability"] = float(record["action_probs"][..., DONE].mean())
        if "intent" in record:
            said["intent_kl"] = divergence(record["action_probs"], record["intent"])
    if "option" not in record or "decide" not in record:
        return said
    option, decide = record["option"], record["decide"].bool()
    said |= {
        f"share_{name}": float((option == k).float().mean())
        for k, name in enumerate(OPTION_NAMES[:OPTIONS])
    }
    interacting = (option == PUSH) | (option == PICK)
    opened = int((interacting & decide).sum())
    said |= {
        "done_probability": float(record["done_probability"][decide].mean())
        if decide.any()
        else 0.0
    }
    said["interactions"] = opened
    if opened:
        said["interaction_length"] = float(interacting.sum()) / opened
    if "forced" in record and "choice" in record:
        forced = int(record["forced"].sum())
        ended = forced + int((interacting & (record["choice"] == DONE)).sum())
        if ended:
            said["forced_share"] = forced / ended
    if "meant" in record and decide.any():
        said["intent_kl"] = divergence(record["plan"][decide], record["meant"][decide])
    return said


def divergence(first: Tensor, second: Tensor) -> float:
    """Return the mean KL divergence of distributions (…, k) of one another, in nats."""
    ratio = first.clamp_min(_LEAST).log() - second.clamp_min(_LEAST).log()
    return float((first * ratio).sum(-1).mean())


def rates(steps: int, seconds: Sequence[float]) -> Row:
    """Return steps a second in three tiers: environments alone, rollouts, all of training."""
    names = ("env_steps_per_s", "collect_steps_per_s", "steps_per_s")
    return {
        name: round(steps / spent, 2) if spent > 0.0 else 0.0
        for name, spent in zip(names, seconds, strict=True)
    }


class ProgressReporter(Ticker):
    """Takes in the rows of a run's log and tells how far it is.

    Parameters
    ----------
    stream
        Where; None: nowhere.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        super().__init__(stream)
        self._stage = ""
        self._last: Row = {}
        self._validation: Row = {}

    def __call__(self, row: Row) -> None:
        """Take in a row."""
        if "validation" in row:
            self._validation = row["validation"]
            self.say(f"{row['stage']}, {row['step']:,} steps: validation {_words(row)}")
            return
        stage = str(row.get("stage", "cloning"))
        if stage != self._stage and self._stage:
            self.say(self.line())
        self._stage, self._last = stage, row
        if self.due():
            self.tell(self.line())

    def line(self) -> str:
        """Return how far it is, in one line."""
        row = self._last
        if "cloning" in row:
            said = row["cloning"]
            rate = said["frames_per_s"]
            left = said["updates"] - said["update"]
            frames = row["step"] / said["update"]
            share = said["update"] / said["updates"]
            return (
                f"cloning: {row['step']:,} frames ({share:.0%}), loss {said['loss']:.3f}, "
                f"{rate:,.0f} frames/s, {clock(left * frames / max(rate, 1e-9))} left"
            )
        rate = row["time"]["steps_per_s"]
        left = (row["updates"] - row["update"]) * row["step"] / row["update"]
        share = row["update"] / row["updates"]
        parts = [f"{row['stage']}: {row['step']:,} steps ({share:.0%})"]
        episode = row["episode"]
        if "success" in episode:
            parts.append(f"success {episode['success']:.0%}")
        parts += [f"{rate:,.0f} steps/s", f"{clock(left / max(rate, 1e-9))} left"]
        return ", ".join(parts)

    def summary(self, run: Path) -> str:
        """Return what is said at the end."""
        if not self._last:
            return f"{run}: was finished already"
        said = f"{run}: {self._last['step']:,} steps"
        success = self._last.get("episode", {}).get("success")
        if success is not None:
            said += f", success {success:.0%} of the last training episodes"
        if self._validation:
            said += f"; validation {_words({'validation': self._validation})}"
        return said

    def plain(self, run: Path) -> dict[str, Any]:
        """Return the same as plain JSON."""
        return {
            "run": str(run),
            "step": self._last.get("step"),
            "episode": self._last.get("episode"),
            "validation": self._validation or None,
        }


def _words(row: Row) -> str:
    said = row["validation"]
    return (
        f"success {said['success']:.0%}, SPL {said['spl']:.2f}, STS {said['sts']:.2f} "
        f"over {said['episodes']:.0f} episodes"
    )
