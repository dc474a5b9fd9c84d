"""Forecast of a dataset's duration and size, measured on a few of its scenes."""

from __future__ import annotations

import dataclasses
import json
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from internav_data.core.machine import available_cores
from internav_data.core.progress import clock
from internav_data.generation.executors import DEFAULT_EXECUTOR, get_executor
from internav_data.generation.progress import GenerationProgress
from internav_data.generation.run import check_scenes
from internav_data.generation.scenes import asset_folders, build_scene
from internav_data.physics.engines.installed import require_engine
from internav_data.records.errors import QuarantineError
from internav_data.records.splits import split_of_scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.generation.config import GenerationConfig
    from internav_data.generation.scenes import Scene
    from internav_data.records import Episode, House

SAMPLE_SCENES = 12
"""Scenes made for a forecast. The quota gives them the dataset's room counts within 5 %."""
SAMPLE_EPISODES = 10
SAMPLE_S = 60.0
"""Seconds after which no further scene is begun, and one under way is given up: settings that
discard most draws may take minutes for an episode."""
MEGABYTE = 1_000_000


@dataclass(frozen=True, slots=True)
class Forecast:
    """Expected duration and size of a run on this machine, with nothing else running."""

    scenes: int
    episodes: int
    workers: int
    seconds: float
    """Wall time, from the processor time of the sample."""
    bytes: int
    """Size of the data files."""
    episodes_per_second: float
    sampled_scenes: int
    sampled_episodes: int
    quarantined_share: float

    def summary(self) -> str:
        """Return the forecast as a sentence."""
        return (
            f"{self.scenes} scenes, {self.episodes} episodes: about {clock(self.seconds)} with "
            f"{self.workers} workers ({self.episodes_per_second:.1f} episodes/s), "
            f"{self.bytes / MEGABYTE:.1f} MB; from {self.sampled_episodes} episodes of "
            f"{self.sampled_scenes} scenes"
        )

    def to_json(self) -> str:
        """Return the forecast as JSON."""
        return json.dumps(dataclasses.asdict(self))


@dataclass(slots=True)
class _Sample:
    houses: list[House]
    episodes: list[Episode]
    house_s: float
    episode_s: float
    failed: int


def forecast(
    config: GenerationConfig,
    scenes: int,
    workers: int = 0,
    progress: GenerationProgress | None = None,
) -> Forecast:
    """Make some scenes in memory and forecast a run of all; nothing is written.

    Raises
    ------
    UsageError
        A count or setting out of its bounds.
    MissingEngineError
        The config's physics engine is not installed.
    QuarantineError
        Not one scene of the sample could be made, or none within `SAMPLE_S`.

    """
    check_scenes(scenes)
    config.check()
    require_engine(config.physics.engine, switchable=True)
    (progress or GenerationProgress()).log(
        f"making up to {SAMPLE_SCENES} scenes to measure, for {SAMPLE_S:.0f} s at most; "
        f"physics: {config.physics.engine}"
    )
    sample = _sample(config, range(min(scenes, SAMPLE_SCENES)))
    made, tried = len(sample.houses), len(sample.houses) + sample.failed
    share = made / tried
    episodes = sum(config.episodes_of(split_of_scene(scene)) for scene in range(scenes))
    workers = get_executor(DEFAULT_EXECUTOR, workers).slots
    at_once = min(workers, available_cores(), scenes)
    alone = scenes * sample.house_s / made + episodes * sample.episode_s / len(sample.episodes)
    size = _bytes(sample, scenes, episodes)
    return Forecast(
        scenes=scenes,
        episodes=round(episodes * share),
        workers=workers,
        seconds=round(alone / at_once, 3),
        bytes=round(size * share),
        episodes_per_second=round(episodes * share / (alone / at_once), 3),
        sampled_scenes=made,
        sampled_episodes=len(sample.episodes),
        quarantined_share=round(1.0 - share, 6),
    )


class _TimeUpError(Exception):
    """End of the time for the sample."""


def _sample(config: GenerationConfig, scenes: range) -> _Sample:
    from internav_data.catalog import catalogue  # noqa: PLC0415

    known = catalogue(asset_folders(config))
    sample, reason = _Sample([], [], 0.0, 0.0, 0), ""
    until = time.monotonic() + SAMPLE_S

    def make(scene: int, episodes: int) -> Scene:
        return build_scene(scene, config, known, episodes, before_draw=lambda: _check_time(until))

    for scene in scenes:
        try:
            if not sample.houses:
                # The first one compiles kernels and fills caches: made once unmeasured.
                make(scene, 1)
            _measure(sample, scene, make, min(config.episodes_per_scene, SAMPLE_EPISODES))
        except QuarantineError as error:
            sample.failed += 1
            reason = str(error)
        except _TimeUpError:
            reason = reason or f"the first was not finished after {SAMPLE_S:.0f} s"
            sample.failed += not sample.houses and not sample.failed
            break
    if not sample.houses:
        raise QuarantineError(
            f"none of the first {sample.failed} scenes could be made: {reason}; settings that ask "
            "less of an episode (episodes.min_interactions, min_detour_steps) discard fewer draws"
        )
    return sample


def _check_time(until: float) -> None:
    if time.monotonic() > until:
        raise _TimeUpError


def _measure(sample: _Sample, scene: int, make: Callable[[int, int], Scene], episodes: int) -> None:
    """Make a scene twice, the second time with more episodes: what differs is their cost."""
    began = time.process_time()
    make(scene, 1)
    between = time.process_time()
    built = make(scene, 1 + episodes)
    ended = time.process_time()
    episodes_s = max(0.0, (ended - between) - (between - began))
    sample.episode_s += episodes_s / episodes * len(built.episodes)
    sample.house_s += max(0.0, (ended - between) - episodes_s / episodes * len(built.episodes))
    sample.houses.append(built.house)
    sample.episodes += built.episodes


def _bytes(sample: _Sample, scenes: int, episodes: int) -> float:
    """Return the size of the tables of the complete dataset."""
    from internav_data.dataset import EPISODES, SCENES, write_parquet  # noqa: PLC0415 - as above

    with tempfile.TemporaryDirectory() as folder:
        houses = write_parquet(Path(folder) / "scenes.parquet", sample.houses, SCENES)
        tasks = write_parquet(Path(folder) / "episodes.parquet", sample.episodes, EPISODES)
    return scenes * houses.bytes / houses.rows + episodes * tasks.bytes / tasks.rows
