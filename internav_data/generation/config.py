"""Configuration of a dataset: every setting that its scenes depend on."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from internav_data.catalog.asset_types import OBSTACLES
from internav_data.catalog.config import CatalogConfig
from internav_data.core.config import (
    MAX_SEED,
    Bounds,
    check_bounds,
    from_mapping,
    nested,
    plain,
    read_settings,
    updated,
)
from internav_data.core.files import read_file
from internav_data.episodes.config import EpisodeConfig, check_types
from internav_data.houses.config import HouseConfig
from internav_data.houses.plan_file import FLOOR_PLAN, load_floor_plan
from internav_data.physics.config import PhysicsConfig
from internav_data.records.errors import UsageError
from internav_data.world.config import WorldConfig

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from internav_data.records import Split

EPISODE_PRESETS: Final = ("paper", "balanced", "dense", "long")
"""Names of the presets of episodes, each a TOML file in the folder `presets`: settings that differ
from the defaults, of any section."""
TEST_SHARE = 10
"""A test scene has one episode for every ten of other scenes, as in the paper (5 for 50)."""
COMMAND_LINE_ONLY = ("scenes", "workers", "executor", "ray_address", "out")
"""Options of a run that are no part of a dataset's config."""
_TEST_ADVICE = "ask for 1 or more episodes, or 0 for a tenth of episodes_per_scene"


@dataclass(frozen=True, slots=True)
class GenerationConfig:
    """Configuration of a dataset: equal configs give equal episodes, scene by scene."""

    seed: Annotated[int, Bounds(0, MAX_SEED, "choose one from 0 to 2^63 - 1")] = 0
    """Every random number derives from this and the scene's index."""
    episodes_per_scene: Annotated[int, Bounds(1, advice="ask for 1 or more episodes")] = 50
    """Episodes of each train and val scene."""
    test_episodes_per_scene: Annotated[int, Bounds(0, advice=_TEST_ADVICE)] = 0
    """Episodes of each test scene; 0 for a tenth of episodes_per_scene, rounded up."""
    assets: tuple[str, ...] = ()
    """Folders of your own meshes that join the catalogue."""
    catalog: CatalogConfig = field(default_factory=CatalogConfig)
    """Settings of the objects' attributes."""
    house: HouseConfig = field(default_factory=HouseConfig)
    """Settings of the houses."""
    episodes: EpisodeConfig = field(default_factory=EpisodeConfig)
    """Settings of the episodes."""
    world: WorldConfig = field(default_factory=WorldConfig)
    """Settings of the world that outcomes, experts and environments share."""
    physics: PhysicsConfig = field(default_factory=PhysicsConfig)
    """Settings of the physics that all of these are solved with."""

    def check(self) -> None:
        """Check all values, and that the files they name are there.

        Raises
        ------
        UsageError
            A value is out of its bounds, a weighed type is none of the catalogue's, a push model
            without a force has one, a folder of meshes is missing, or a floor plan is wrong.

        """
        self.catalog.check()
        self.house.check()
        self.episodes.check()
        self.world.check()
        self.world.check_force()
        self.physics.check()
        check_bounds(self)
        if not self.assets:
            # A user's meshes may have types of their own: those are known once they are read.
            check_types(self.episodes.asset_weights, [kind.type for kind in OBSTACLES])
        for folder in self.assets:
            if not Path(folder).is_dir():
                raise UsageError(f"assets: '{folder}' is no folder; name a folder with meshes")
        if self.house.floor_plan is not None:
            load_floor_plan(self.house.floor_plan)

    def episodes_of(self, split: Split) -> int:
        """Return the number of episodes of a scene of a split."""
        if split != "test":
            return self.episodes_per_scene
        return self.test_episodes_per_scene or -(-self.episodes_per_scene // TEST_SHARE)

    def resolved(self) -> dict[str, Any]:
        """Return all values as plain data."""
        values: dict[str, Any] = plain(self)
        values["test_episodes_per_scene"] = self.episodes_of("test")
        return values

    def identity(self, catalogue_digest: str) -> dict[str, Any]:
        """Return the values that must be equal for two runs to make the same scenes.

        Digests of contents replace paths: the catalogue's digest the asset folders, the SHA-256
        of its bytes a floor plan.
        """
        values = self.resolved()
        values["assets"] = catalogue_digest
        plan = self.house.floor_plan
        values["house"]["floor_plan"] = (
            None if plan is None else hashlib.sha256(read_file(plan, FLOOR_PLAN)).hexdigest()
        )
        return values


def load_config(
    path: Path | None = None,
    overrides: Iterable[str] = (),
    options: Mapping[str, Any] | None = None,
    episode_preset: str = "paper",
) -> GenerationConfig:
    """Read a config: a preset of episodes, a TOML file, options by dotted key, `a.b=c` overrides.

    Later ones win. Other settings have their defaults. Paths inside the file are relative to it.

    Raises
    ------
    UsageError
        An unreadable file, an unknown preset or key, or a value of the wrong type; it names the
        place.

    Examples
    --------
    >>> from internav_data.generation import load_config
    >>> load_config(episode_preset="dense").episodes.idle_obstacles
    'drop'

    """
    config = _preset(episode_preset)
    if path is not None:
        config = from_mapping(config, read_settings(path), str(path), COMMAND_LINE_ONLY)
        config = _beside(config, path.parent)
    for key, value in (options or {}).items():
        config = from_mapping(config, nested(key, value), "option")
    for override in overrides:
        config = updated(config, override, COMMAND_LINE_ONLY)
    return config


def _preset(name: str) -> GenerationConfig:
    if name not in EPISODE_PRESETS:
        raise UsageError(f"episode preset {name!r}: expected one of {', '.join(EPISODE_PRESETS)}")
    path = Path(__file__).parent / "presets" / f"{name}.toml"
    return from_mapping(GenerationConfig(), read_settings(path), str(path))


def _beside(config: GenerationConfig, folder: Path) -> GenerationConfig:
    changes: dict[str, Any] = {"assets": [str(folder / entry) for entry in config.assets]}
    if config.house.floor_plan is not None:
        changes["house"] = {"floor_plan": str(folder / config.house.floor_plan)}
    return from_mapping(config, changes, "paths")
