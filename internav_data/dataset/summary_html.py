"""Statistics of a dataset as HTML, for notebooks: what its files say, nothing computed."""

from __future__ import annotations

import json
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.core.storage import Store
    from internav_data.dataset.manifest import Manifest

_STATS = "stats.json"


def summary_html(name: str, store: Store, manifest: Manifest) -> str:
    """Return tables of a dataset: splits, and Table 2 with the paper's figures in brackets.

    Parameters
    ----------
    name
        Description of the dataset, its `repr`.
    store, manifest
        Place and manifest of the dataset. Statistics are those of its `stats.json`; a dataset
        whose file cannot be read has the counts alone.
    """
    config = manifest.config
    settings = {
        "seed": manifest.seed,
        "houses": config.get("house", {}).get("preset"),
        "engine": config.get("physics", {}).get("engine"),
        "attributes": config.get("catalog", {}).get("attributes"),
        "generator": f"{manifest.generator} {manifest.generator_version}",
    }
    told = ", ".join(f"{key} {value}" for key, value in settings.items() if value is not None)
    splits = [
        (split, f"{count.scenes:,}", f"{count.episodes:,}")
        for split, count in manifest.counts.items()
    ]
    parts = [f"<p><code>{escape(name)}</code><br/>{escape(told)}</p>"]
    parts.append(_table(("split", "scenes", "episodes"), splits))
    stats = _stats(store)
    if stats:
        parts.append(_table(("rooms", "share", "obstacles", "distance, m", "rooms on path"), [
            _table2_row(row) for row in stats["table2"]
        ]))  # fmt: skip
        parts.append(f"<p>{escape(_sentence(stats))}</p>")
    return f"<div>{''.join(parts)}</div>"


def _stats(store: Store) -> dict[str, Any]:
    try:
        found = json.loads(store.read(_STATS))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and "table2" in found else {}


def _table2_row(row: dict[str, Any]) -> tuple[str, ...]:
    names = ("ratio", "obstacle_num", "distance_m", "cross_room_num")
    return row["rooms"], *(f"{row[name]:.2f} ({row['paper'][name]:.2f})" for name in names)


def _sentence(stats: dict[str, Any]) -> str:
    modes, expert = stats["modes"], stats["expert"]
    return (
        f"{modes.get('blocked', 0):,} blocked, {modes.get('lengthened', 0):,} lengthened, "
        f"{stats['sealed']:,} sealed; the expert solves {expert['solved']:,} in "
        f"{expert['steps']['mean']:.1f} steps on average. In brackets: Table 2 of the paper."
    )


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["".join(f"<th>{escape(head)}</th>" for head in heads)]
    lines += ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
    return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"
