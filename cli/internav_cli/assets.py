"""`internav-gen assets`."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

import click

from internav_cli.options import JSON

if TYPE_CHECKING:
    from collections.abc import Iterable

    from internav_data.catalog import Catalogue
    from internav_data.records import Asset


@click.command(
    "assets",
    epilog="""\b
Examples:
  internav-gen assets                              counts by type
  internav-gen assets --type Chair                 every chair
  internav-gen assets --assets my_meshes           with your own; names a broken file
  internav-gen assets --sheet assets.png           a picture of all types""",
)
@click.option("--type", "kind", help="List the assets of this type.")
@click.option(
    "--assets",
    "folders",
    multiple=True,
    metavar="DIR",
    help="A folder of your own meshes, to be listed too.  [repeatable]",
)
@click.option("--sheet", type=click.Path(path_type=Path), help="Write a contact sheet (PNG).")
@JSON
def command(
    *, kind: str | None, folders: tuple[str, ...], sheet: Path | None, as_json: bool
) -> int:
    """List the assets: obstacles and furniture."""
    from internav_data.catalog import catalogue
    from internav_data.generation import load_config
    from internav_data.generation.scenes import asset_folders

    config = load_config(None, (), {"assets": list(folders)} if folders else {})
    config.check()
    known = catalogue(asset_folders(config))
    chosen = [a for a in known.assets.values() if kind is None or a.type == kind]
    if not chosen:
        types = ", ".join(sorted({asset.type for asset in known.assets.values()}))
        raise click.UsageError(f"there is no type '{kind}': choose from {types}")
    if sheet is not None:
        _draw(sheet, known, kind)
    if as_json:
        rows = [_row(asset) for asset in chosen] if kind else _counts(chosen)
        values = {"version": known.version, "digest": known.digest, "assets": rows}
        click.echo(json.dumps(values, indent=2))
    elif kind is None:
        _print_counts(_counts(chosen), len(known.spawnable))
    else:
        for asset in chosen:
            width, depth, height = asset.size
            click.echo(
                f"{asset.asset_id:<20} {width:.2f} x {depth:.2f} x {height:.2f} m "
                f"{asset.mass_kg:8.2f} kg  friction {asset.friction:.2f}  {_handling(asset)}"
            )
    return 0


def _row(asset: Asset) -> dict[str, object]:
    names = ("asset_id", "type", "size", "mass_kg", "friction", "pushable", "pickable", "spawnable")
    return {name: getattr(asset, name) for name in names} | {"parts": len(asset.parts)}


def _handling(asset: Asset) -> str:
    if asset.pushable:
        return "pushable"
    return "pickable" if asset.pickable else "fixed"


def _counts(assets: Iterable[Asset]) -> list[dict[str, object]]:
    by_type: dict[tuple[bool, str], Counter[str]] = {}
    for asset in assets:
        by_type.setdefault((not asset.spawnable, asset.type), Counter())[_handling(asset)] += 1
    return [
        {
            "type": name,
            "obstacle": not furniture,
            "assets": counts.total(),
            **{handling: counts[handling] for handling in ("pushable", "pickable", "fixed")},
        }
        for (furniture, name), counts in sorted(by_type.items())
    ]


def _print_counts(rows: list[dict[str, object]], spawnable: int) -> None:
    columns = ("assets", "pushable", "pickable", "fixed")
    click.echo(f"{'type':<20}" + "".join(f"{name:>10}" for name in columns))
    for row in rows:
        mark = "" if row["obstacle"] else "  furniture only"
        click.echo(f"{row['type']:<20}" + "".join(f"{row[name]:>10}" for name in columns) + mark)
    click.echo(f"{spawnable} assets can be spawned on an agent's path")


def _draw(path: Path, known: Catalogue, kind: str | None) -> None:
    from internav_data.views.asset_sheet import write_asset_sheet

    write_asset_sheet(path, known, None if kind is None else [kind])
    click.echo(f"wrote {path}", err=True)
