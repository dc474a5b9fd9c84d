"""Videos of evaluated episodes: camera, map, and bars of the distributions behind each action."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from internav_data.dataset import load_dataset
from internav_data.evaluation.evaluator import EvaluationConfig, evaluate
from internav_data.evaluation.report import episodes_by_id, picked
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.dataset import Dataset
    from internav_data.evaluation.evaluator import Note, Policy
    from internav_data.evaluation.metrics import EpisodeResult
    from internav_data.records import Episode

SIZE: Final = 320
"""Pixels a side of the camera's picture."""
FPS: Final = 6.0
"""Frames a second."""


class _Noting:
    """Policy that acts as another one does, and keeps the notes of each action."""

    def __init__(self, policy: Policy) -> None:
        self.name, self.image_size = policy.name, policy.image_size
        self.sensors = policy.sensors
        self._policy = policy
        self.steps: list[list[Note]] = []

    def begin(self, count: int, seed: int) -> None:
        self._policy.begin(count, seed)

    def start(self, slot: int, episode: Episode) -> None:
        self._policy.start(slot, episode)

    def act(self, observations: Mapping[str, NDArray[Any]]) -> NDArray[np.int64]:
        actions = self._policy.act(observations)
        notes = getattr(self._policy, "notes", None)
        if notes is not None:
            self.steps.append(notes(0))
        return actions


def videos(
    folder: Path,
    policy: Policy,
    results: Sequence[EpisodeResult],
    dataset: Dataset[Episode],
    settings: EvaluationConfig,
    kind: str = "gif",
) -> Iterator[Path]:
    """Record videos of the best, the median and the worst episode of an evaluation.

    Each is played once more, alone, with the same random numbers, to get the notes of each action.

    Yields
    ------
    Path
        File of each video, once it is written.
    """
    from internav_data.views import Replay, write_video  # noqa: PLC0415 - OpenCV
    from internav_data.views.bars import Bars, bars_panel  # noqa: PLC0415

    for word, result in picked(results, each=1):
        only = load_dataset(dataset.path, dataset.split, [("episode_id", "=", result.episode_id)])
        noting = _Noting(policy)
        alone = EvaluationConfig(settings.seed, batch=1, max_steps=settings.max_steps)
        (again,) = evaluate(noting, only, alone)
        (episode,) = episodes_by_id(only, [result.episode_id]).values()
        steps = [[Bars(*note) for note in notes] for notes in noting.steps]
        panel = bars_panel(steps, SIZE) if any(steps) else None
        replay = Replay.of(
            only.scene(episode.scene_id), episode, only.assets, again.actions,
            title=policy.name, config=WorldConfig.of_dataset(only.manifest.config),
        )  # fmt: skip
        path = folder / f"{word}-{result.episode_id.replace('/', '-')}.{kind}"
        write_video(path, replay.frames(size=SIZE, fps=FPS, panel=panel), FPS)
        yield path
