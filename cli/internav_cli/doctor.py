"""`internav-gen doctor`."""

from __future__ import annotations

from pathlib import Path

import click

from internav_cli.options import JSON


@click.command(
    "doctor",
    epilog="""\b
Examples:
  internav-gen doctor
  internav-gen doctor --out /data --json""",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Folder for datasets, whose free space is checked.  [default: here]",
)
@JSON
def command(*, out: Path, as_json: bool) -> int:
    """Check that this machine can generate datasets; name a remedy for each problem."""
    from internav_data.generation.diagnostics import examine

    checks = examine(out)
    if as_json:
        import json
        from dataclasses import asdict

        click.echo(json.dumps([asdict(check) for check in checks], indent=2))
    else:
        for check in checks:
            mark = {"good": "ok  ", "warning": "note", "bad": "BAD "}[check.state]
            click.echo(f"{mark} {check.name}: {check.found}")
            if check.remedy:
                click.echo(f"     -> {check.remedy}")
    return 1 if any(check.state == "bad" for check in checks) else 0
