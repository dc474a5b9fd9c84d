"""One scene or episode made again, to be printed or compared with a dataset."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from internav_data.generation.run import identity_for
from internav_data.generation.scenes import asset_folders, build_scene
from internav_data.physics import cache_disabled
from internav_data.records import House
from internav_data.records.errors import UsageError, ValidationError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from internav_data.dataset import TableSpec
    from internav_data.generation.config import GenerationConfig
    from internav_data.records import Asset, Episode


@dataclass(frozen=True, slots=True)
class Made:
    """A scene made again, and the assets of its objects and obstacles."""

    house: House
    episodes: tuple[Episode, ...]
    assets: Mapping[str, Asset]


def made_again(config: GenerationConfig, scene: int, episode: int | None = None) -> Made:
    """Make a scene with its episodes, or with those up to `episode`: without the result cache.

    Raises
    ------
    UsageError
        A scene or episode below 0.
    QuarantineError
        The scene cannot be made.

    """
    from internav_data.catalog import catalogue  # noqa: PLC0415

    if scene < 0 or (episode is not None and episode < 0):
        raise UsageError(f"scene is {scene} and episode is {episode}: both count from 0")
    known = catalogue(asset_folders(config))
    with cache_disabled():
        built = build_scene(scene, config, known, None if episode is None else episode + 1)
    return Made(built.house, built.episodes, known.assets)


def scene_again(
    config: GenerationConfig, scene: int, episode: int | None = None, out: Path | None = None
) -> tuple[str, str]:
    """Return a scene or one of its episodes as JSON, and a sentence about the comparison.

    Parameters
    ----------
    config, scene, episode
        Config and numbers of the scene and episode; None: all episodes of the scene's split.
    out
        Dataset of the same config to compare with; None: no comparison.

    Raises
    ------
    UsageError
        The dataset is of another config, or does not hold the scene or episode.
    ValidationError
        The dataset holds something else under this name.

    """
    made = made_again(config, scene, episode)
    house, episodes = made.house, made.episodes
    if episode is not None:
        episodes = episodes[-1:]
    parts = [record for record in (None if episode is not None else house, *episodes) if record]
    verdict = f"made {house.scene_id}: {len(episodes)} episodes; physics: {config.physics.engine}"
    if out is not None:
        _compare(out, config, house, episodes)
        verdict += f"; the same as in {out}"
    if episode is not None:
        return json.dumps(record_values(parts[0])), verdict
    values = {"scene": record_values(house), "episodes": [record_values(e) for e in episodes]}
    return json.dumps(values), verdict


def record_values(record: House | Episode) -> dict[str, Any]:
    """Return a record as the row of its table, which obeys the table's JSON Schema."""
    from internav_data.dataset import EPISODES, SCENES, to_table  # noqa: PLC0415 - needs pyarrow

    spec: TableSpec[Any] = SCENES if isinstance(record, House) else EPISODES
    row: dict[str, Any] = to_table([record], spec).to_pylist()[0]
    return row


def _compare(
    out: Path, config: GenerationConfig, house: House, episodes: tuple[Episode, ...]
) -> None:
    from internav_data.catalog import catalogue  # noqa: PLC0415
    from internav_data.dataset import identity_of, load_dataset  # noqa: PLC0415 - as above

    filters = [("scene_id", "=", house.scene_id)]
    data = load_dataset(out, filters=filters)
    wanted = identity_for(config, catalogue(asset_folders(config)))
    if json.dumps(identity_of(data.manifest).config) != json.dumps(wanted.config, sort_keys=True):
        raise UsageError(
            f"{out} holds a dataset of another config: give the options it was made by"
        )
    held: dict[int, Episode] = {episode.index: episode for episode in data}
    pairs: list[tuple[str, Any, Any]] = [(house.scene_id, data.scene(house.scene_id), house)]
    for episode in episodes:
        if episode.index not in held:
            raise UsageError(f"{out} holds no episode {episode.episode_id}")
        pairs.append((episode.episode_id, held[episode.index], episode))
    for name, there, here in pairs:
        if there != here:
            old, new = record_values(there), record_values(here)
            differing = ", ".join(key for key in new if old[key] != new[key])
            raise ValidationError(f"{out}: {name} differs from what its config makes: {differing}")
