"""Options that several commands share."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, get_args

import click

from internav_data.physics.engines import DEFAULT_ENGINE, EngineName

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.dataset import DatasetPart
    from internav_data.generation import GenerationConfig, GenerationProgress

F = TypeVar("F", bound="Callable[..., Any]")

DATASET = click.argument("dataset", required=False, type=click.Path(path_type=Path))
"""Folder to read; see `dataset_to_read`."""
JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON on stdout.")

_CONFIG = (
    click.option(
        "--config",
        "config_file",
        type=click.Path(path_type=Path),
        help="TOML file with any of the settings that --print-config lists.",
    ),
    click.option(
        "--set",
        "overrides",
        multiple=True,
        metavar="KEY=VALUE",
        help="One setting, as in --set house.scale=1.1; wins over the file.  [repeatable]",
    ),
    click.option("--seed", type=int, help="Every random number derives from it.  [default: 0]"),
    click.option(
        "--preset",
        type=click.Choice(["paper", "realistic"]),
        help="Houses. paper: generous rooms, calibrated to the paper; realistic: those of real "
        "homes.  [default: paper]",
    ),
    click.option(
        "--episode-preset",
        type=click.Choice(["paper", "balanced", "dense", "long"]),
        help="Episodes. paper: as in the paper; balanced: all types of obstacles alike; dense: "
        "only obstacles that matter; long: interactions of several actions.  [default: paper]",
    ),
    click.option(
        "--rooms",
        metavar="ROOMS",
        help="Rooms: a count (4), a range (2-5) or a programme (kitchen,living,bedroom:2).",
    ),
    click.option(
        "--physics",
        type=click.Choice(get_args(EngineName)),
        help=f"Engine that settles and pushes.  [default: the dataset's, else {DEFAULT_ENGINE}]",
    ),
    click.option("--floor-plan", metavar="FILE", help="A floor plan of your own (TOML or JSON)."),
    click.option(
        "--assets",
        "folders",
        multiple=True,
        metavar="DIR",
        help="A folder of your own meshes that join the catalogue.  [repeatable]",
    ),
)


def config_options(command: F) -> F:
    """Add the options that make a config."""
    for option in reversed(_CONFIG):
        command = option(command)
    return command


def config_from(
    config_file: Path | None = None,
    overrides: tuple[str, ...] = (),
    seed: int | None = None,
    preset: str | None = None,
    rooms: str | None = None,
    floor_plan: str | None = None,
    folders: tuple[str, ...] = (),
    episode_preset: str | None = None,
    physics: str | None = None,
    **more: Any,  # noqa: ANN401 - further settings by key, __ for a dot
) -> GenerationConfig:
    """Return the config that the options describe: preset, file, then options, then --set."""
    from internav_data.generation import load_config

    options = {
        "seed": seed,
        "house.preset": preset,
        "house.rooms": rooms,
        "house.floor_plan": floor_plan,
        "physics.engine": physics,
        "assets": list(folders) or None,
    } | {key.replace("__", "."): value for key, value in more.items()}
    chosen = {key: value for key, value in options.items() if value is not None}
    config = load_config(config_file, overrides, chosen, episode_preset or "paper")
    config.check()
    return config


def engine_is_named(
    config_file: Path | None = None,
    overrides: tuple[str, ...] = (),
    physics: str | None = None,
    **_: object,
) -> bool:
    """Return whether the options of `config_from` name a physics engine."""
    from internav_data.core.config import keys_given

    return physics is not None or "physics.engine" in keys_given(config_file, overrides, {})


def dataset_to_read(given: Path | None, *, solves: bool = False, engine: str | None = None) -> Path:
    """Return the folder of the dataset that a command reads, and name it on stderr.

    A folder without a dataset is left to the error that names it.

    Parameters
    ----------
    given
        Folder that the command was given; None for the default one.
    solves
        Whether the command solves physics: then the engine is named too, and has to be installed.
    engine
        Engine that it solves with; None for the dataset's.

    Raises
    ------
    CorruptDataError
        There is no dataset in the default folder, or its manifest is damaged.
    MissingEngineError
        The dataset's physics engine is not installed.

    """
    from internav_data.dataset import has_manifest, is_unfinished, read_manifest
    from internav_data.dataset.location import MINI_FOLDER, folder_to_read
    from internav_data.physics.engines.installed import require_engine

    folder = folder_to_read(given)
    if has_manifest(folder):
        chosen = (engine or _engine_of(folder)) if solves else ""
        part = read_manifest(folder).part
        name_dataset(
            folder if folder == MINI_FOLDER else given,
            chosen,
            part,
            unfinished=is_unfinished(folder),
        )
        if chosen:
            require_engine(chosen, "" if engine else str(folder))
    elif given is None:
        read_manifest(folder)  # raises: nothing is there, or nothing finished
    return folder


def _engine_of(folder: Path) -> str:
    from internav_data.dataset import read_manifest
    from internav_data.physics.config import PhysicsConfig

    return PhysicsConfig.of_dataset(read_manifest(folder).config).engine


def name_dataset(
    given: Path | None,
    engine: str = "",
    part: DatasetPart | None = None,
    *,
    unfinished: bool = False,
) -> None:
    """Write on stderr which dataset a command takes, why if none was named, range and engine."""
    from internav_data.core.storage import store_of
    from internav_data.dataset.location import dataset_folder, origin

    if os.environ.get("RANK", "0") != "0":
        return  # torchrun starts this program once a rank
    reason = origin(given)
    line = f"dataset: {store_of(dataset_folder(given)).at('')}" + (f" ({reason})" if reason else "")
    line += f"; part {part.first_scene}:{part.end_scene} of a dataset" if part else ""
    line += "; unfinished: its first scenes, until what makes it has ended" if unfinished else ""
    click.echo(line + (f"; physics: {engine}" if engine else ""), err=True)


def progress() -> GenerationProgress:
    """Return a progress line on stderr."""
    from internav_data.generation import GenerationProgress

    return GenerationProgress(sys.stderr)


def positive(_context: click.Context, parameter: click.Parameter, value: int | None) -> int | None:
    """Check that a count is 1 or more.

    Raises
    ------
    BadParameter
        It is less.

    """
    if value is not None and value < 1:
        raise click.BadParameter(f"{value}: ask for 1 or more", param=parameter)
    return value
