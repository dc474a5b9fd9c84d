"""`internav-gen validate`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, get_args

import click

from internav_cli.options import DATASET, JSON, dataset_to_read, positive
from internav_data.physics.engines import EngineName

if TYPE_CHECKING:
    from pathlib import Path

LEVELS = ("files", "schema", "geometry", "physics")


@click.command(
    "validate",
    epilog="""\b
Examples:
  internav-gen validate
  internav-gen validate data/demo --level files         hashes and checksums only
  internav-gen validate data/demo --level physics       every push, pick and expert again
  internav-gen validate data/paper --level physics --sample 300 --workers 2
  internav-gen validate data/demo --level physics --physics mujoco   a second opinion

\b
Levels:
  files     every file of the manifest is there, unchanged, readable, and none besides
  schema    columns, ranges, ids, order; what outcomes and experts must be by themselves
  geometry  houses, obstacles and distances derived again by shapely, scipy and networkx
  physics   every obstacle falls again, every outcome and expert is played again, and the
            distances that follow are derived as at geometry; what geometry finds untrue
            is not played

Exit code 3 when something in the dataset is not true, 5 when it cannot be read.""",
)
@DATASET
@click.option(
    "--level",
    type=click.Choice(LEVELS),
    default="geometry",
    show_default=True,
    help="Extent of the checks; each level runs those before it.",
)
@click.option(
    "--sample",
    type=int,
    callback=positive,
    help="Check geometry and physics of this many scenes only.",
)
@click.option(
    "--physics",
    type=click.Choice(get_args(EngineName)),
    help="At level physics: replay by this engine; another than the dataset's is asked for all "
    "pushes, and the share is told on which it agrees.  [default: the dataset's]",
)
@click.option("--workers", type=int, callback=positive, help="Processes.  [default: one a core]")
@JSON
def command(
    *,
    dataset: Path | None,
    level: Any,  # noqa: ANN401 - one of LEVELS, by click
    sample: int | None,
    physics: str | None,
    workers: int | None,
    as_json: bool,
) -> int:
    """Prove DATASET right by independent, slower ways, or say what in it is wrong."""
    from internav_data.core.machine import available_cores
    from internav_data.records.errors import ValidationError
    from internav_data.verification import validate

    progress = _show_progress if sys.stderr.isatty() else None
    folder = dataset_to_read(dataset, solves=level == "physics", engine=physics)
    findings = validate(folder, level, sample, workers or available_cores(), progress, physics)
    if progress is not None:
        click.echo("\r\033[K", nl=False, err=True)
    click.echo(findings.to_json() if as_json else findings.summary())
    return 0 if findings.ok else ValidationError.exit_code


def _show_progress(level: str, done: int, total: int) -> None:
    click.echo(f"\r\033[K{level}: {done}/{total}", nl=False, err=True)
