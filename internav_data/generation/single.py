"""A house or some episodes from a seed, in this process and without files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.generation.config import GenerationConfig
from internav_data.generation.scenes import ATTEMPTS, asset_folders, beliefs_for, obstacle_pool
from internav_data.records.errors import QuarantineError, UsageError

if TYPE_CHECKING:
    from internav_data.records import Episode, House


def generate_house(seed: int = 0, scene: int = 0, config: GenerationConfig | None = None) -> House:
    """Return the house of a seed and a scene index: the same in any process, on any day.

    Parameters
    ----------
    seed
        Seed of the dataset; takes the place of `config.seed`.
    scene
        Index of the scene, 0 and up.
    config
        Everything else; the defaults where None.

    Raises
    ------
    UsageError
        A seed, scene or setting out of its bounds.
    QuarantineError
        No house could be built within the stated bounds.

    Examples
    --------
    >>> from internav_data import generate_house
    >>> house = generate_house(seed=7, scene=3)
    >>> house.scene_id
    'scene-000003'

    """
    from internav_data.catalog import catalogue  # noqa: PLC0415
    from internav_data.catalog.attributes import hidden_attributes  # noqa: PLC0415 - as above
    from internav_data.houses import build_house  # noqa: PLC0415 - as above

    config = config or GenerationConfig()
    config.check()
    if scene < 0 or seed < 0:
        raise UsageError(f"seed is {seed} and scene is {scene}: both are 0 or more")
    assets, reason = catalogue(asset_folders(config)), ""
    hidden = hidden_attributes(config.catalog, assets.spawnable)
    for attempt in range(ATTEMPTS):
        try:
            return build_house(seed, scene, config.house, assets, attempt, hidden=hidden)
        except QuarantineError as error:
            reason = str(error)
    raise QuarantineError(reason)


def generate_episodes(
    house: House, count: int = 1, first: int = 0, config: GenerationConfig | None = None
) -> tuple[Episode, ...]:
    """Return episodes first … first + count - 1 of a house, each settled and judged.

    They are those of a dataset with the same config, unless the dataset had to make the scene
    again because another of its episodes could not be made.

    Raises
    ------
    UsageError
        A count or setting out of its bounds.
    QuarantineError
        An episode cannot be made within the stated bounds; it names the episode and the reason.

    Examples
    --------
    >>> from internav_data import generate_episodes, generate_house
    >>> episodes = generate_episodes(generate_house(seed=7, scene=3), count=5)
    >>> [episode.index for episode in episodes]
    [0, 1, 2, 3, 4]

    """
    from internav_data.catalog import catalogue  # noqa: PLC0415
    from internav_data.catalog.attributes import hidden_attributes  # noqa: PLC0415 - as above
    from internav_data.episodes import build_episodes  # noqa: PLC0415 - as above

    config = config or GenerationConfig()
    config.check()
    if count < 1 or first < 0:
        raise UsageError(f"count is {count} and first is {first}: ask for 1 or more from 0 or more")
    assets, reason = catalogue(asset_folders(config)), ""
    pool = obstacle_pool(assets, config, house.split)
    hidden = hidden_attributes(config.catalog, assets.spawnable)
    for attempt in range(ATTEMPTS):
        try:
            return build_episodes(
                *(house, count, pool, config.episodes, config.world),
                first=first,
                attempt=attempt,
                hidden=hidden,
                beliefs=beliefs_for(assets, config),
                physics=config.physics,
            )
        except QuarantineError as error:
            reason = str(error)
    raise QuarantineError(reason)
