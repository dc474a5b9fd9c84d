"""The dataset card: README.md with the YAML front matter that Hugging Face reads."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from internav_data.core.field_docs import descriptions
from internav_data.dataset.croissant import LICENCE, citation
from internav_data.dataset.nodes import Coordinates, Field, Keyed, Leaf, Node, Record
from internav_data.dataset.tables import EPISODES, SCENES, TableSpec

if TYPE_CHECKING:
    from typing import Any

    from internav_data.dataset.manifest import Manifest
    from internav_data.dataset.stats import Stats

_SIZES = (
    *((1_000, "n<1K"), (10_000, "1K<n<10K"), (100_000, "10K<n<100K")),
    *((1_000_000, "100K<n<1M"), (10_000_000, "1M<n<10M")),
)


def card_text(manifest: Manifest, stats: Stats) -> str:
    """Return README.md of a dataset."""
    parts = (
        _front_matter(manifest),
        _summary(manifest, stats),
        _table2(stats),
        _interactions(stats),
        _use(),
        _limits(manifest),
        "## Columns of an episode\n\n" + _columns(EPISODES),
        "## Columns of a scene\n\n" + _columns(SCENES),
        _origin(manifest),
    )
    return "\n".join(part.strip() + "\n" for part in parts)


def _front_matter(manifest: Manifest) -> str:
    episodes = sum(count.episodes for count in manifest.counts.values())
    size = next((name for most, name in _SIZES if episodes < most), "n>10M")
    lines = [
        "---",
        "pretty_name: Interactive navigation episodes",
        f"license: {LICENCE.lower()}",
        f"size_categories: [{json.dumps(size)}]",
        "task_categories: [robotics, reinforcement-learning]",
        "tags: [embodied-ai, interactive-navigation, indoor-scenes, procedural-generation]",
        "configs:",
    ]
    for table in ("episodes", "scenes"):
        lines += [f"- config_name: {table}"] + ["  default: true"] * (table == "episodes")
        lines.append("  data_files:")
        for split in manifest.counts:
            if files := manifest.of(table, split):
                lines += [f"  - split: {split}", "    path:"]
                lines += [f"    - {file.path}" for file in files]
    lines += ["- config_name: assets", "  data_files:"]
    lines += [f"  - {file.path}" for file in manifest.of("assets")] + ["---"]
    return "\n".join(lines)


def _summary(manifest: Manifest, stats: Stats) -> str:
    splits = ", ".join(
        f"{count.episodes:,} {split} ({count.scenes:,} scenes)"
        for split, count in manifest.counts.items()
    )
    share = f"{100 * stats.sealed_share_of_blocked:.1f} %"
    return f"""
# Interactive navigation episodes
{_part(manifest)}
{stats.episodes:,} tasks in {stats.scenes:,} generated houses: {splits}. In each, an agent (a disc
of 0.2 m radius) is to reach a goal while obstacles, settled by physics, block the path
({stats.modes["blocked"]:,} episodes) or lengthen it ({stats.modes["lengthened"]:,}). Of the
blocked ones {share} let nothing through off the 0.25 m lattice either (`sealed`).

Metres, kilograms, seconds, degrees; right-handed, z up, yaw 0 along +x, counter-clockwise;
quaternions are (x, y, z, w). `schemas/` holds a JSON Schema of each row, `stats.json` more figures,
`manifest.json` every file with its sha256, `croissant.json` the same for machines, `eval.yaml` the
tasks of evaluation results. The data take {_megabytes(manifest)} MB in {len(manifest.files)} files.
"""


def _part(manifest: Manifest) -> str:
    numbers = manifest.scene_numbers
    if manifest.part is None:
        return ""
    return (
        f"\nA part of a dataset, scenes {numbers.start} to {numbers.stop - 1} of it: "
        "`internav-gen merge` joins the parts.\n"
    )


def _megabytes(manifest: Manifest) -> str:
    return f"{sum(file.bytes for file in manifest.files) / 1e6:.1f}"


def _table2(stats: Stats) -> str:
    lines = [
        "| rooms | share | obstacles | distance, m | rooms on the path |",
        "|---|---|---|---|---|",
    ]
    lines += [
        f"| {row.rooms} | {100 * row.ratio:.1f} % | {row.obstacle_num:.2f} | "
        f"{row.distance_m:.2f} | {row.cross_room_num:.2f} |"
        for row in stats.table2
    ]
    return "\n".join(lines)


def _interactions(stats: Stats) -> str:
    expert = stats.expert
    lines = [
        "## Interactions",
        "",
        "Effects of pushing each obstacle along each axis or of picking it up (`outcomes`):",
        "",
        "| | possible | succeeds | opens a blocked path by itself |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| `{row.action}` | {row.possible:,} | {100 * row.success_share:.1f} % | {row.opened:,} |"
        for row in stats.outcomes
    ]
    return (
        "\n".join(lines)
        + f"""

{100 * stats.openable_share_of_blocked:.1f} % of the blocked episodes open by a single one. An
expert, replayed before it was stored, solves {100 * expert.solved_share:.1f} % of the episodes in
{expert.steps.mean:.1f} steps on average ({expert.pushes:.2f} pushes, {expert.picks:.2f} picks); its
SPL of {expert.spl:.3f} and STS of {expert.sts:.3f} are there to compare agents with,
and no bound: its plans are not proven shortest. It refused
{100 * expert.refused_share:.1f} % of the draws.
{_agreement(stats)}"""
    )


def _agreement(stats: Stats) -> str:
    found = stats.agreement
    if found is None:
        return ""
    return f"""
A second physics engine was asked for {found.asked:,} pushes: on {100 * found.share:.1f} % it gives
the same success and opening (`agrees`), in {100 * found.episodes_share:.1f} % of the episodes on
all of them (`agreed`).
"""


def _use() -> str:
    return """
## Use

```python
from internav_data import load_dataset

ds = load_dataset("path/to/this/folder", split="train", filters=[("room_count", ">=", 4)])
episode = ds[0]
house = ds.scene(episode.scene_id)
```

The folder is a dataset repository of Hugging Face, on the hub or on disk. Configurations are
`episodes`, `scenes` and `assets`; splits are those of the table above.

```python
import datasets

episodes = datasets.load_dataset("path/to/this/folder", "episodes", split="train", streaming=True)
```

It is plain Parquet: pandas, Polars, DuckDB and pyarrow read the files that `manifest.json` names:

```python
import json
import polars

files = json.load(open("manifest.json"))["files"]
episodes = polars.read_parquet([f["path"] for f in files if f["table"] == "episodes"])
```
"""


def _limits(manifest: Manifest) -> str:
    return f"""
## Limits

- Everything is generated: houses, furniture of convex parts in plain materials, rigid bodies. No
  scan, no photograph, no person: nothing here is personal data, and looks are no measure of homes.
- Physics is an engine's, in contacts and friction too. Outcomes say what one push or pickup does
  with all else as the episode starts, not what a later one does.
- `outcomes`, `mass_kg`, `friction`, `pushable` and the experts are privileged: an agent that is to
  act on what it sees must not be given them.
- Distances on the lattice are about a quarter longer than Euclidean ones; SPL counts the latter.
- Draws for which the expert found no plan were drawn again: the rest is solvable by its means.
- All episodes of a scene share its house: splits are by scene; never divide them by episode.

## Licence and citation

{LICENCE}, as the generator. Meshes that you had it add keep their own licence: say so here.

```bibtex
{citation(manifest)}
```
"""


def _columns(spec: TableSpec[Any]) -> str:
    notes = descriptions(spec.cls)
    lines = ["| column | type | unit | description |", "|---|---|---|---|"]
    for field in spec.node.fields:
        note = " ".join(notes.get(field.name, "").split()).replace("|", "\\|")
        lines.append(f"| `{field.name}` | {_type(field)} | {field.unit or ''} | {note} |")
    return "\n".join(lines)


def _type(field: Field) -> str:
    return _node_type(field.node) + (", may be null" if field.nullable else "")


def _node_type(node: Node) -> str:
    if isinstance(node, Leaf):
        return " or ".join(node.choices) or node.kind
    if isinstance(node, Coordinates):
        return "{" + ", ".join(node.names) + "}"
    if isinstance(node, Record):
        return "{" + ", ".join(field.name for field in node.fields) + "}"
    if isinstance(node, Keyed):
        return "mapping"
    return f"list of {_node_type(node.item)}"


def _origin(manifest: Manifest) -> str:
    config = json.dumps(manifest.config, indent=1, sort_keys=True, ensure_ascii=False)
    return f"""
## Origin

Generated by {manifest.generator} {manifest.generator_version} with seed {manifest.seed}, catalogue
version {manifest.catalogue_version} (`{manifest.catalogue_digest[:16]}`), and this configuration;
the same again gives the same data. {len(manifest.quarantined)} of {manifest.scenes:,} scenes could
not be built within the stated bounds and are left out (`manifest.json` names them).

```json
{config}
```
"""
