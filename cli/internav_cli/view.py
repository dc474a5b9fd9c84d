"""`internav-gen view`."""

from __future__ import annotations

from pathlib import Path

import click

from internav_cli.options import DATASET, dataset_to_read, positive


def _port(_context: click.Context, parameter: click.Parameter, value: int | None) -> int | None:
    if value is not None and not 0 <= value < 1 << 16:
        raise click.BadParameter(f"{value}: expected 0 (any free one) to 65535", param=parameter)
    return value


@click.command(
    "view",
    epilog="""\b
Examples:
  internav-gen view                                          in the browser
  internav-gen view data/demo --port 9000 --no-browser       prints the address
  internav-gen view data/demo --html demo.html --sample 24   one file, to be sent to others

\b
The server answers this machine alone, shows nothing but the dataset, and fetches nothing.
From another machine: ssh -L 8437:127.0.0.1:8437 HOST.""",
)
@DATASET
@click.option(
    "--html",
    "html_file",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Write the page with a sample of the episodes as one file, instead of serving it.",
)
@click.option(
    "--sample",
    type=int,
    callback=positive,
    help="Number of episodes in the file of --html.  [default: 12]",
)
@click.option("--force", is_flag=True, help="Write over a file that is there.")
@click.option(
    "--port",
    type=int,
    callback=_port,
    help="Port on 127.0.0.1; 0 takes any free one.  [default: 8437, or a free one]",
)
@click.option("--no-browser", is_flag=True, help="Open no browser; the address is printed.")
def command(
    *,
    dataset: Path | None,
    html_file: Path | None,
    sample: int | None,
    force: bool,
    port: int | None,
    no_browser: bool,
) -> int:
    """Show DATASET in the browser: statistics, a gallery, each episode with its outcomes."""
    if html_file is None and (sample is not None or force):
        raise click.UsageError("--sample and --force are for --html FILE")
    if html_file is not None and (port is not None or no_browser):
        raise click.UsageError("--port and --no-browser are for the server: leave --html out")
    from internav_data.core.extras import require
    from internav_data.records.errors import UsageError
    from internav_data.viewer import ViewedDataset, serve, write_page

    if html_file is not None and html_file.exists() and not force:
        raise UsageError(f"{html_file}: is there already; choose another name, or pass --force")
    require("cv2", "numba", "scipy", "trimesh")
    viewed = ViewedDataset(dataset_to_read(dataset))
    if html_file is None:
        serve(viewed, port, browser=not no_browser, say=lambda text: click.echo(text, err=True))
        return 0
    count = write_page(viewed, html_file, sample or 12)
    size = html_file.stat().st_size / 1e6
    click.echo(f"wrote {html_file}: {count} episodes, {size:.1f} MB", err=True)
    return 0
