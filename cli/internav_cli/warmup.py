"""`internav-gen warmup`."""

from __future__ import annotations

import click


@click.command(
    "warmup",
    epilog="""\b
Examples:
  internav-gen warmup          once after installing, or while building a container""",
)
def command() -> int:
    """Compile the numba kernels before their first use."""
    from internav_data.core.progress import clock
    from internav_data.generation.diagnostics import warm_up

    click.echo("compiling numba kernels: about a minute the first time", err=True)
    seconds = warm_up()
    click.echo(f"ready after {clock(seconds)}; the compiled kernels are cached", err=True)
    return 0
