"""`internav-gen schema`."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(
    "schema",
    epilog="""\b
Examples:
  internav-gen schema                      the names
  internav-gen schema episodes             one schema on stdout
  internav-gen schema --out schemas/       all of them as files""",
)
@click.argument("name", required=False)
@click.option("--out", type=click.Path(path_type=Path), help="Write all schemas into this folder.")
def command(*, name: str | None, out: Path | None) -> int:
    """Print the JSON Schema of NAME (episodes, scenes, assets, manifest, stats)."""
    from internav_data.dataset import schema_text, schemas, write_schemas

    if out is not None:
        write_schemas(out)
        click.echo(f"wrote {len(schemas())} schemas into {out}", err=True)
        return 0
    known = {file.removesuffix(".schema.json"): schema for file, schema in schemas().items()}
    if name is None:
        click.echo("\n".join(known))
    elif name not in known:
        raise click.UsageError(f"there is no schema '{name}': choose from {', '.join(known)}")
    else:
        click.echo(schema_text(known[name]), nl=False)
    return 0
