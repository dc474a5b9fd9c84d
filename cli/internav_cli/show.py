"""`internav-gen show`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from internav_cli.options import DATASET, config_from, config_options, dataset_to_read

if TYPE_CHECKING:
    from internav_data.generation import GenerationConfig


@click.command(
    "show",
    epilog="""\b
Examples:
  internav-gen show --scene 17                              scene-000017.png
  internav-gen show --scene 17 --episode 3                  scene-000017-0003.png
  internav-gen show data/demo --scene 17 --out house.png
  internav-gen show --seed 7 --scene 3 --rooms 6            a fresh house: no dataset needed
  internav-gen show --floor-plan plan.toml --out plan.png   your own, furnished""",
)
@DATASET
@click.option("--scene", type=int, default=0, show_default=True, help="Index of the scene.")
@click.option("--episode", type=int, help="Draw this episode; without it, the house alone.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="The PNG to write.  [default: named after the scene or episode]",
)
@click.option(
    "--pixels",
    type=click.IntRange(1, 8192),
    default=900,
    show_default=True,
    metavar="INTEGER",
    help="Length of the picture's longer side.",
)
@config_options
def command(
    *,
    dataset: Path | None,
    scene: int,
    episode: int | None,
    out: Path | None,
    pixels: int,
    **settings: Any,  # noqa: ANN401 - the options of config_from
) -> int:
    """Draw a scene or an episode of DATASET, or of a seed and config, from above."""
    from internav_data.views import draw_episode, draw_house, write_png

    fresh = any(value not in {None, ()} for value in settings.values())
    if dataset is not None and fresh:
        raise click.UsageError("options of a config are for fresh houses: leave DATASET out")
    if scene < 0 or (episode is not None and episode < 0):
        raise click.UsageError("--scene and --episode count from 0")
    if fresh:
        house, task, assets = _fresh(config_from(**settings), scene, episode)
    else:
        house, task, assets = _stored(dataset_to_read(dataset), scene, episode)
    if task is None:
        picture = draw_house(house, pixels=pixels)
    else:
        picture = draw_episode(house, task, assets, pixels=pixels)
    name = f"scene-{scene:06d}" if episode is None else f"scene-{scene:06d}-{episode:04d}"
    out = out or Path(f"{name}.png")
    write_png(out, picture)
    click.echo(f"wrote {out}", err=True)
    return 0


def _stored(dataset: Path, scene: int, episode: int | None) -> tuple[Any, Any, Any]:
    from internav_data.dataset import load_dataset
    from internav_data.records.errors import UsageError

    scene_id = f"scene-{scene:06d}"
    data = load_dataset(dataset)
    house = data.scene(scene_id)
    if episode is None:
        return house, None, None
    filters = [("scene_id", "=", scene_id), ("index", "=", episode)]
    found = load_dataset(dataset, filters=filters)
    if not len(found):
        raise UsageError(f"{dataset}: {scene_id} has no episode {episode}")
    return house, found[0], data.assets


def _fresh(config: GenerationConfig, scene: int, episode: int | None) -> tuple[Any, Any, Any]:
    if episode is None:  # episodes take seconds
        from internav_data.generation import generate_house

        return generate_house(config.seed, scene, config), None, None
    from internav_data.generation.reproduce import made_again

    made = made_again(config, scene, episode)
    return made.house, made.episodes[-1], made.assets
