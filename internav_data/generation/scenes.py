"""One scene: its house and its episodes, from the config and the scene's index alone."""

from __future__ import annotations

import gc
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from internav_data.episodes.config import check_types
from internav_data.records.errors import QuarantineError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from internav_data.catalog import Catalogue
    from internav_data.dataset import Staging
    from internav_data.generation.config import GenerationConfig
    from internav_data.planner.beliefs import TypeBelief
    from internav_data.records import Asset, Episode, House, Split

ATTEMPTS = 3
"""Sub-seeds tried for a scene whose house or episodes cannot be made within their bounds."""


@dataclass(frozen=True, slots=True)
class Scene:
    """A finished scene."""

    house: House
    episodes: tuple[Episode, ...]
    attempts: int
    """Number of sub-seeds tried, the successful one included."""
    redraws: Mapping[str, int]
    """Number of redraws of its episodes, by reason."""


@dataclass(frozen=True, slots=True)
class ScenePayload:
    """Inputs of a worker that makes scenes and stages them."""

    config: GenerationConfig
    assets: Catalogue
    """Catalogue, built once by the parent: a user's meshes take a while to cut into parts."""
    staging: Staging
    """Staged scenes of the run."""


def build_scene(
    scene: int,
    config: GenerationConfig,
    catalogue: Catalogue,
    episodes: int | None = None,
    *,
    before_draw: Callable[[], None] = lambda: None,
) -> Scene:
    """Return a scene with its episodes: `episodes` of them, or as many as its split has.

    `before_draw` is called before each draw of a start and goal; what it raises ends the scene.

    Raises
    ------
    QuarantineError
        No attempt succeeded; it gives the reason of the last failure.

    """
    from internav_data.catalog.attributes import hidden_attributes  # noqa: PLC0415 - as below
    from internav_data.episodes import build_batch  # noqa: PLC0415 - numba, engine when used
    from internav_data.houses import build_house  # noqa: PLC0415 - as above

    reason, hidden = "", hidden_attributes(config.catalog, catalogue.spawnable)
    beliefs = beliefs_for(catalogue, config)
    for attempt in range(ATTEMPTS):
        try:
            house = build_house(config.seed, scene, config.house, catalogue, attempt, hidden=hidden)
            count = config.episodes_of(house.split) if episodes is None else episodes
            pool = obstacle_pool(catalogue, config, house.split)
            made = build_batch(
                *(house, count, pool, config.episodes, config.world),
                attempt=attempt,
                hidden=hidden,
                beliefs=beliefs,
                before_draw=before_draw,
                physics=config.physics,
            )
        except QuarantineError as error:
            reason = str(error)
        else:
            return Scene(house, made.episodes, attempt + 1, made.redraws)
    raise QuarantineError(reason, ATTEMPTS)


def obstacle_pool(catalogue: Catalogue, config: GenerationConfig, split: Split) -> Sequence[Asset]:
    """Return the assets that obstacles of a split are drawn from.

    Raises
    ------
    UsageError
        No obstacle has a type that the settings weigh.

    """
    from internav_data.catalog import split_of_asset  # noqa: PLC0415 - needed with one option only

    _check_weights(catalogue, config)
    if not config.episodes.unseen_assets:
        return catalogue.spawnable
    return tuple(asset for asset in catalogue.spawnable if split_of_asset(asset) == split)


def obstacle_shares(catalogue: Catalogue, config: GenerationConfig) -> dict[str, float]:
    """Return the share of each type of obstacle among what is drawn, over all splits.

    Raises
    ------
    UsageError
        No obstacle has a type that the settings weigh, or all have weight 0.

    """
    from internav_data.episodes.pool import ObstaclePool  # noqa: PLC0415 - numpy when used

    _check_weights(catalogue, config)
    return ObstaclePool.of(catalogue.spawnable, config.episodes).shares()


def _check_weights(catalogue: Catalogue, config: GenerationConfig) -> None:
    """Check weighed types again, with those of a user's meshes."""
    types = {asset.type for asset in catalogue.spawnable}
    check_types(config.episodes.asset_weights, types)


def beliefs_for(catalogue: Catalogue, config: GenerationConfig) -> Mapping[str, TypeBelief] | None:
    """Return what a blind expert believes about the catalogue's types; None if none is stored."""
    from internav_data.catalog.attributes import hidden_attributes  # noqa: PLC0415 - as below
    from internav_data.planner.beliefs import type_beliefs  # noqa: PLC0415 - one option only

    if not config.episodes.blind_expert:
        return None
    hidden = hidden_attributes(config.catalog, catalogue.spawnable)
    return type_beliefs(catalogue.assets.values(), config.world.push_spec, hidden)


def scene_maker(payload: ScenePayload) -> Callable[[int], int]:
    """Set a worker up; return a function that makes and stages a scene and counts its episodes."""
    from internav_data.dataset.staging import stage_scene  # noqa: PLC0415 - workers only

    config, assets, staging = payload.config, payload.assets, payload.staging
    gc.freeze()  # the catalogue stays: no collection need look at it again

    def make(scene: int) -> int:
        built = build_scene(scene, config, assets)
        stage_scene(
            staging,
            scene,
            built.house,
            built.episodes,
            redraws=built.redraws,
            attempts=built.attempts,
        )
        return len(built.episodes)

    return make


def asset_folders(config: GenerationConfig) -> tuple[Path, ...]:
    """Return the folders of the user's own meshes."""
    return tuple(Path(folder) for folder in config.assets)
