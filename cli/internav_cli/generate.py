"""`internav-gen generate`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from internav_cli.options import (
    JSON,
    config_from,
    config_options,
    engine_is_named,
    name_dataset,
    positive,
    progress,
)

if TYPE_CHECKING:
    from internav_data.generation import GenerationConfig
    from internav_data.generation.report import Report

MAX_NAMED_SCENES = 10
"""Quarantined scenes that are named at the end."""


def _scene_range(
    _context: click.Context, _parameter: click.Parameter, value: str | None
) -> range | None:
    """Return the range that A:B means.

    Raises
    ------
    BadParameter
        It is no range.

    """
    if value is None:
        return None
    first, colon, end = value.partition(":")
    if not (colon and first.isdecimal() and end.isdecimal()):
        raise click.BadParameter(
            f"{value!r}: expected A:B, as in 0:6000, for the scenes A up to B - 1"
        )
    return range(int(first), int(end))


def _one_of(scenes: int, scene_range: range | None) -> int | range:
    """Return what was given, a number of scenes or their range; both are refused."""
    source = click.get_current_context().get_parameter_source("scenes")
    if scene_range is None:
        return scenes
    if source is click.core.ParameterSource.COMMANDLINE:
        raise click.UsageError("--scenes and --scene-range: give one of them")
    return scene_range


@click.command(
    "generate",
    epilog="""\b
Examples:
  internav-gen generate --scenes 12000                        as many as the paper's
  internav-gen generate --out data/demo --scenes 120 --episodes-per-scene 10
  internav-gen generate --out data/demo --scenes 240          extends it
  internav-gen generate --out data/flats --rooms kitchen,living,bedroom:2 --preset realistic
  internav-gen generate --out data/confounded --attributes hidden
  internav-gen generate --out data/sure --cross-check       outcomes two engines agree on
  internav-gen generate --out data/dense --episode-preset dense   obstacles that matter
  internav-gen generate --scene-range 6000:12000 --out part-2   a part, to be merged
  internav-gen generate --dry-run --workers 8                 how long, how large
  internav-gen generate --scene 17 --episode 3                one episode again, as JSON
  internav-gen generate --print-config > mine.toml            all settings, to be changed

Run again on an unfinished folder it continues; a kill loses nothing but the scenes
under way. The first scenes can be read while others are being made. Any number of
workers gives the same bytes.""",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="The dataset's folder.  [default: $INTERNAV_DATASET, else internav-dataset]",
)
@click.option(
    "--scenes",
    type=int,
    default=12_000,
    show_default=True,
    callback=positive,
    help="Number of houses, those that are there already included.",
)
@click.option(
    "--scene-range",
    metavar="A:B",
    callback=_scene_range,
    help="Make scenes A to B - 1 instead: a part of a dataset, for `internav-gen merge`.",
)
@click.option(
    "--episodes-per-scene",
    type=int,
    help="Episodes of a house; a tenth of that in test scenes.  [default: 50]",
)
@click.option("--workers", type=int, callback=positive, help="Processes.  [default: one a core]")
@click.option(
    "--executor",
    type=click.Choice(["processes", "ray"]),
    default="processes",
    show_default=True,
    help="Where scenes are made: processes on this machine, or a Ray cluster (docs/scale.md).",
)
@click.option(
    "--ray-address",
    metavar="HOST:PORT",
    help="Head of the Ray cluster.  [default: $RAY_ADDRESS, else the one that runs here]",
)
@config_options
@click.option(
    "--unseen-assets",
    "episodes__unseen_assets",
    is_flag=True,
    default=None,
    help="Each split draws its obstacles from its own share of the assets.",
)
@click.option(
    "--keep-unsolvable",
    "episodes__keep_unsolvable",
    is_flag=True,
    default=None,
    help="Keep episodes without an expert, marked by a null, rather than draw them again.",
)
@click.option(
    "--blind-expert",
    "episodes__blind_expert",
    is_flag=True,
    default=None,
    help="Store the run of an expert that knows types' averages only, and learns by failing.",
)
@click.option(
    "--cross-check",
    "physics__cross_check",
    is_flag=True,
    default=None,
    help="Ask the other engine for each push too, and store where both agree.",
)
@click.option(
    "--push-model",
    "world__push_model",
    type=click.Choice(["force", "kick", "step"]),
    help="force: 200 N up to 2 m/s; kick: 2 m/s at once for every mass; step: 0.5 m/s for 0.22 m, "
    "by at most 200 N.  [default: force]",
)
@click.option(
    "--attributes",
    "catalog__attributes",
    type=click.Choice(["look", "hidden"]),
    help="Mass, friction and fixedness go by an object's look, or are hidden.  [default: look]",
)
@click.option(
    "--strength",
    "catalog__strength",
    type=float,
    help="With hidden attributes: share that is independent of the look.  [default: 1]",
)
@click.option(
    "--retry-quarantined",
    is_flag=True,
    help="Try all quarantined scenes again; without it, those whose workers died.",
)
@click.option("--dry-run", is_flag=True, help="Tell time and size; write nothing.")
@click.option("--print-config", is_flag=True, help="Print all settings as TOML and stop.")
@click.option("--scene", type=int, help="Make this scene only and print it as JSON.")
@click.option("--episode", type=int, help="With --scene: this episode only.")
@JSON
def command(
    *,
    out: Path | None,
    scenes: int,
    scene_range: range | None,
    workers: int | None,
    executor: str,
    ray_address: str | None,
    retry_quarantined: bool,
    dry_run: bool,
    print_config: bool,
    scene: int | None,
    episode: int | None,
    as_json: bool,
    **settings: Any,  # noqa: ANN401 - the options of config_from; __ for a dot
) -> int:
    """Make a dataset of houses and episodes in the folder --out."""
    wanted = _one_of(scenes, scene_range)
    config = config_from(**settings)
    if print_config:
        from internav_data.core.config import config_toml

        click.echo(config_toml(config), nl=False)
        return 0
    keep = engine_is_named(**settings)
    if scene is not None:
        config = config if keep or out is None else _with_held_engine(config, out)
        _print_scene(config, scene, episode, out)
        return 0
    if episode is not None:
        raise click.UsageError("--episode needs --scene: say which scene it belongs to")
    if dry_run:
        _forecast(config, wanted, workers or 0, as_json=as_json)
        return 0
    config = config if keep else _with_held_engine(config, out)
    name_dataset(out, config.physics.engine)
    from internav_data.dataset import dataset_folder
    from internav_data.generation import generate

    folder = dataset_folder(out)
    report = generate(
        folder,
        config,
        wanted,
        workers or 0,
        progress(),
        executor=executor,
        retry_quarantined=retry_quarantined,
        ray_address=ray_address,
    )
    return _print_report(report, as_json=as_json)


def _print_scene(
    config: GenerationConfig, scene: int, episode: int | None, out: Path | None
) -> None:
    from internav_data.generation.reproduce import scene_again

    text, verdict = scene_again(config, scene, episode, out)
    click.echo(text)
    click.echo(verdict, err=True)


def _forecast(
    config: GenerationConfig, scenes: int | range, workers: int, *, as_json: bool
) -> None:
    from internav_data.generation.forecast import forecast
    from internav_data.generation.run import check_scenes

    made = forecast(config, len(check_scenes(scenes)), workers, progress())
    click.echo(made.to_json() if as_json else made.summary())


def _with_held_engine(config: GenerationConfig, out: Path | None) -> GenerationConfig:
    """Return the config with the engine of the dataset that is to be continued, if there is one."""
    from internav_data.dataset import dataset_folder
    from internav_data.generation.run import with_held_engine

    return with_held_engine(config, dataset_folder(out))


def _print_report(report: Report, *, as_json: bool) -> int:
    from internav_data.generation.report import summary

    click.echo(summary(report), err=True)
    for scene_id, reason in report.quarantined[:MAX_NAMED_SCENES]:
        click.echo(f"quarantined {scene_id}: {reason}", err=True)
    if len(report.quarantined) > MAX_NAMED_SCENES:
        rest = len(report.quarantined) - MAX_NAMED_SCENES
        click.echo(f"and {rest} more quarantined: manifest.json names them", err=True)
    if report.died:
        click.echo(
            f"the workers of {report.died} quarantined scenes died, perhaps for lack of memory: "
            "the same command tries these scenes again (with fewer --workers each has more)",
            err=True,
        )
    if as_json:
        click.echo(json.dumps(report.plain()))
    return report.exit_code
