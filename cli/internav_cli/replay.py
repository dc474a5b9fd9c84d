"""`internav-gen replay`."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from internav_cli.options import DATASET, dataset_to_read, positive

if TYPE_CHECKING:
    from internav_data.records import Episode

_EPISODE_ID = re.compile(r"(?:scene-)?(\d{1,9})/(\d{1,9})")


@click.command(
    "replay",
    epilog="""\b
Examples:
  internav-gen replay 17/3                                   scene-000017-0003.mp4
  internav-gen replay data/demo 17/3 --out there.mp4 --out there.gif
  internav-gen replay data/demo --scene 17 --episode 3 --format gif
  internav-gen replay data/demo 17/3 --actions mine.json --out mine.gif

\b
FILE is a JSON list of actions' names or numbers, ["MoveAhead", "PushAhead", 11],
or {"episode_id": "scene-000017/0003", "actions": [...]}; -1 waits.
MP4 (MPEG-4 Part 2) plays in VLC, mpv, ffplay and most desktop players, not in browsers;
GIF plays anywhere.""",
)
@DATASET
@click.argument("episode_id", required=False)
@click.option("--scene", type=int, help="Index of the scene, instead of EPISODE_ID.  [default: 0]")
@click.option("--episode", type=int, help="Index of the episode in it.  [default: 0]")
@click.option(
    "--actions",
    "actions_file",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Play these actions instead of the expert's.",
)
@click.option(
    "--out",
    "outs",
    type=click.Path(path_type=Path),
    multiple=True,
    help="The .mp4 or .gif to write.  [repeatable; default: named after the episode]",
)
@click.option(
    "--format",
    "formats",
    type=click.Choice(["mp4", "gif"]),
    multiple=True,
    help="Format of the file that is named after the episode.  [repeatable; default: mp4]",
)
@click.option(
    "--size",
    type=int,
    callback=positive,
    help="Pixels a side of the camera's picture.  [default: mp4 480, gif 360]",
)
@click.option("--fps", type=float, help="Frames a second.  [default: mp4 12, gif 8]")
@click.option("--force", is_flag=True, help="Write over a file that is there.")
def command(
    *,
    dataset: Path | None,
    episode_id: str | None,
    scene: int | None,
    episode: int | None,
    actions_file: Path | None,
    outs: tuple[Path, ...],
    formats: tuple[str, ...],
    size: int | None,
    fps: float | None,
    force: bool,
) -> int:
    """Record a video of an episode of DATASET: camera, map, and every action in words."""
    if outs and formats:
        raise click.UsageError("--format is for files without --out: a name's suffix says it")
    from internav_data.records.errors import UsageError
    from internav_data.views import Replay, read_actions, video_format, write_video
    from internav_data.views.replay import DEFAULTS

    dataset, episode_id = _arguments(dataset, episode_id)
    given = None if actions_file is None else read_actions(actions_file)
    if given is not None and given.episode_id and (episode_id, scene, episode) == (None,) * 3:
        episode_id = given.episode_id
    place = _place(episode_id, scene, episode)
    name = f"scene-{place[0]:06d}/{place[1]:04d}"
    if given is not None and given.episode_id not in {None, name}:
        raise UsageError(f"{actions_file}: its actions are for {given.episode_id}, not for {name}")
    paths = outs or [Path(f"{name.replace('/', '-')}.{kind}") for kind in formats or ("mp4",)]
    kinds = [video_format(path) for path in paths]
    for path in paths:
        if path.exists() and not force:
            raise UsageError(f"{path}: is there already; choose another name, or pass --force")
    folder = dataset_to_read(dataset, solves=True)
    house, task, assets, config = _stored(folder, *place)
    if given is None and task.expert is None:
        raise UsageError(
            f"{folder}: {name} has no expert (none was found, or the dataset is of a version "
            "without); choose another episode, or pass --actions FILE"
        )
    actions = None if given is None else given.actions
    film = Replay.of(house, task, assets, actions, config=config)
    for path, kind in zip(paths, kinds, strict=True):
        pixels, rate = size or DEFAULTS[kind][0], fps if fps is not None else DEFAULTS[kind][1]
        count = write_video(path, film.frames(size=pixels, fps=rate), rate)
        end = "reaches the goal" if film.success else "does not end at the goal"
        length = f"{count / rate:.0f} s, {path.stat().st_size / 1e6:.1f} MB"
        click.echo(f"wrote {path}: {film.steps} actions, {end}; {length}", err=True)
    return 0


def _arguments(dataset: Path | None, episode_id: str | None) -> tuple[Path | None, str | None]:
    """Return DATASET and EPISODE_ID; a single argument that reads like an episode is one."""
    if dataset is not None and episode_id is None and _EPISODE_ID.fullmatch(str(dataset)):
        return None, str(dataset)
    return dataset, episode_id


def _place(episode_id: str | None, scene: int | None, episode: int | None) -> tuple[int, int]:
    """Return the scene's and the episode's index."""
    if episode_id is None:
        if (scene or 0) < 0 or (episode or 0) < 0:
            raise click.UsageError("--scene and --episode count from 0")
        return scene or 0, episode or 0
    if scene is not None or episode is not None:
        raise click.UsageError("name the episode once: EPISODE_ID, or --scene and --episode")
    found = _EPISODE_ID.fullmatch(episode_id)
    if found is None:
        raise click.UsageError(
            f"{episode_id!r} names no episode: expected one like scene-000017/0003, or 17/3"
        )
    return int(found[1]), int(found[2])


def _stored(dataset: Path, scene: int, episode: int) -> tuple[Any, Episode, Any, Any]:
    """Return a house, an episode, the assets, and the settings of its dataset's world."""
    from internav_data.dataset import load_dataset
    from internav_data.records.errors import UsageError
    from internav_data.world.config import WorldConfig

    scene_id = f"scene-{scene:06d}"
    filters = [("scene_id", "=", scene_id), ("index", "=", episode)]
    data = load_dataset(dataset, filters=filters)
    if not len(data):
        raise UsageError(
            f"{dataset}: has no episode {scene_id}/{episode:04d}; `internav-gen stats {dataset}` "
            "tells how many scenes and episodes there are"
        )
    config = WorldConfig.of_dataset(data.manifest.config)
    return data.scene(scene_id), data[0], data.assets, config
