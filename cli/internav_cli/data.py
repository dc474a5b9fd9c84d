"""`internav-data`: a first look at the package."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click

from internav_cli.doctor import command as doctor
from internav_cli.main import launch

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

SHEET_HOUSES = 12
"""Number of houses in the demo's contact sheet."""
SAMPLE_EPISODES = "6"
"""Number of episodes in the demo's page, about 1 MB each."""


@click.group(
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  internav-data demo                       a small dataset, made, proved right and drawn
  internav-data doctor                     what is installed here, and what for
  uvx --from 'internav-data[generate]' internav-data demo

\b
The other commands: internav-gen, camp-train, camp-eval; each has --help.

\b
Shell completion (bash; zsh and fish likewise):
  eval "$(_INTERNAV_DATA_COMPLETE=bash_source internav-data)"

\b
Exit codes: 0 good, 1 error, 2 usage, 3 validation failed, 129/130/143 interrupted.""",
)
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
@click.version_option(package_name="internav-data", prog_name="internav-data")
def cli(*, debug: bool) -> None:
    """Try internav-data: a demo of what it makes, and a check of this machine."""


cli.add_command(doctor)


@cli.command(
    "demo",
    epilog="""\b
Examples:
  internav-data demo
  internav-data demo --out /tmp/demo --scenes 12""",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default="demo",
    show_default=True,
    help="Folder for the dataset and the pictures.",
)
@click.option(
    "--scenes",
    type=click.IntRange(10),
    default=24,
    show_default=True,
    metavar="INTEGER",
    help="Number of houses, 10 or more.",
)
def demo(*, out: Path, scenes: int) -> int:
    """Make a small dataset, prove it right, draw it and film it: about three minutes."""
    from internav_cli.main import cli as internav_gen

    for words in _steps(out, scenes, _engine()):
        click.echo(f"$ {shlex.join(['internav-gen', *words])}", err=True)
        code = internav_gen.main(words, prog_name="internav-gen", standalone_mode=False)
        if code:
            return int(code)
    _draw_houses(out / "dataset", out / "houses.png")
    for line in _advice(out):
        click.echo(line)
    return 0


def _engine() -> Sequence[str]:
    """Return the option that names another physics engine where the default one is missing."""
    from internav_data.physics.engines import DEFAULT_ENGINE
    from internav_data.physics.engines.installed import available_engines

    known = available_engines()
    if DEFAULT_ENGINE in known or not known:
        return ()
    click.echo(
        f"the default physics engine, {DEFAULT_ENGINE}, is not installed: {known[0]} takes its "
        "place, and makes other data",
        err=True,
    )
    return ("--physics", known[0])


def _steps(out: Path, scenes: int, engine: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yield the command lines of `internav-gen` that make up the demo."""
    dataset, size = str(out / "dataset"), ("--scenes", str(scenes), "--episodes-per-scene", "5")
    yield "generate", "--out", dataset, *size, *engine
    yield "validate", dataset, "--level", "physics"
    yield "stats", dataset
    yield "show", dataset, "--scene", "6", "--out", str(out / "house.png")
    for episode, name in enumerate(("blocked.png", "lengthened.png")):
        chosen = ("--scene", "6", "--episode", str(episode))
        yield "show", dataset, *chosen, "--out", str(out / name)
    films = ("--out", str(out / "replay.mp4"), "--out", str(out / "replay.gif"))
    yield "replay", dataset, "2/2", "--force", *films
    page = str(out / "page.html")
    yield "view", dataset, "--html", page, "--sample", SAMPLE_EPISODES, "--force"


def _draw_houses(dataset: Path, picture: Path) -> None:
    """Write a contact sheet of the first houses."""
    from internav_data import load_dataset
    from internav_data.views import contact_sheet, draw_house, write_png

    data = load_dataset(dataset)
    chosen = sorted(data.scene_ids)[:SHEET_HOUSES]
    houses = [draw_house(data.scene(scene_id), pixels=520) for scene_id in chosen]
    write_png(picture, contact_sheet(houses, 4))
    click.echo(f"wrote {picture}", err=True)


def _advice(out: Path) -> Iterator[str]:
    pictures = ("house.png", "blocked.png", "lengthened.png", "houses.png")
    yield ""
    yield f"Look at   {'  '.join(str(out / name) for name in pictures)}"
    yield (
        f"Watch     {out / 'replay.gif'} in a browser, {out / 'replay.mp4'} in a player: "
        "things moved out of the way"
    )
    yield f"Browse    {out / 'page.html'}: six episodes, what pushes do, the expert step by step"
    yield f"          internav-gen view {shlex.quote(str(out / 'dataset'))}: all of them"
    yield f"The data  {out / 'dataset'} (begin with its README.md)"
    loading = f"load_dataset({str(out / 'dataset')!r})"
    yield f"Load it   from internav_data import load_dataset; {loading}[0]"
    yield "Make more internav-gen generate --help"


def main(arguments: list[str] | None = None) -> None:
    """Run `internav-data` and exit with its code."""
    launch(cli, "internav-data", arguments)
