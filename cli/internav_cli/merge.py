"""`internav-gen merge`."""

from __future__ import annotations

import json
from pathlib import Path

import click

from internav_cli.options import JSON


@click.command(
    "merge",
    epilog="""\b
Examples:
  internav-gen generate --scene-range 0:6000 --out part-1          on one machine
  internav-gen generate --scene-range 6000:12000 --out part-2      on another
  internav-gen merge part-1 part-2 --out data/all

Parts are only read. They must hold every scene from 0 on once, and be made with the
same settings by the same versions of this package and of the engine; then every
file is that of a run in one piece. After a kill the same command goes on.""",
)
@click.argument("parts", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="The dataset's folder: new, empty, or what this command left there.",
)
@JSON
def command(*, parts: tuple[Path, ...], out: Path, as_json: bool) -> int:
    """Join the parts of a dataset into one, with the bytes of a run in one piece."""
    from internav_data.core.storage import store_of
    from internav_data.dataset import merge

    place = store_of(out).at("").rstrip("/")
    manifest = merge(parts, out, lambda line: click.echo(line, err=True))
    episodes = sum(count.episodes for count in manifest.counts.values())
    click.echo(
        f"{place}: {manifest.scenes} scenes, {episodes} episodes of {len(parts)} parts", err=True
    )
    if as_json:
        figures = {"out": place, "scenes": manifest.scenes, "episodes": episodes}
        click.echo(json.dumps(figures | {"parts": [str(part) for part in parts]}))
    return 0
