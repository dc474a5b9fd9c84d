"""`internav-gen stats`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from internav_cli.options import DATASET, JSON, dataset_to_read

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    "stats",
    epilog="""\b
Examples:
  internav-gen stats
  internav-gen stats data/demo --split test --json""",
)
@DATASET
@click.option("--split", type=click.Choice(["train", "val", "test"]), help="Count this split only.")
@JSON
def command(*, dataset: Path | None, split: str | None, as_json: bool) -> int:
    """Tell what DATASET is like: the columns of the paper's Table 2 and more."""
    from internav_data.dataset import compute_stats

    stats = compute_stats(dataset_to_read(dataset), split)
    if as_json:
        import json

        click.echo(json.dumps(stats, indent=2))
        return 0
    parts = ", ".join(f"{name} {number}" for name, number in stats["splits"].items() if number)
    click.echo(f"{stats['scenes']} scenes, {stats['episodes']} episodes: {parts}")
    for line in table2_lines(stats):
        click.echo(line)
    blocked, sealed = stats["modes"].get("blocked", 0), stats["sealed"]
    click.echo(
        f"blocked {blocked}, lengthened {stats['modes'].get('lengthened', 0)}; sealed {sealed} "
        f"({stats['sealed_share_of_blocked']:.1%} of the blocked)"
    )
    click.echo(
        f"obstacles: {stats['obstacles_pushable']} pushable, {stats['obstacles_pickable']} "
        f"pickable, {stats['obstacles_fixed']} fixed"
        + ("" if stats["relevant_share"] is None else f"; {stats['relevant_share']:.1%} relevant")
    )
    ratios = sorted(
        (row["ratio"], row["type"]) for row in stats["type_shares"] if row["ratio"] is not None
    )
    if ratios:
        listed = ", ".join(f"{kind} {ratio:.2f}" for ratio, kind in ratios)
        click.echo(f"share of what stands to share of the draws: {listed}")
    click.echo(
        f"shortest_path_m: {_spread(stats['shortest_path_m'])}; "
        f"shortest_path_steps: {_spread(stats['shortest_path_steps'])}"
    )
    if stats["pocket_share"] is not None:
        click.echo(
            f"starts: {stats['facing_wall_share']:.1%} face a wall or furniture, "
            f"{stats['pocket_share']:.1%} reach fewer than 4 nodes"
        )
    for line in interaction_lines(stats):
        click.echo(line)
    if stats["quarantined"]:
        click.echo(f"quarantined scenes: {stats['quarantined']}")
    return 0


def table2_lines(stats: dict[str, Any]) -> list[str]:
    """Return Table 2 of the paper, its figures in brackets beside the dataset's."""
    columns = ("ratio", "obstacle_num", "distance_m", "cross_room_num")
    titles = ("share", "obstacles", "distance m", "rooms on path")
    lines = [f"{'rooms':<6}{'episodes':>9}" + "".join(f"{title:>20}" for title in titles)]
    for row in stats["table2"]:
        cells = [f"{row[name]:.3f} ({row['paper'][name]:.3f})" for name in columns]
        lines.append(
            f"{row['rooms']:<6}{row['episodes']:>9}" + "".join(f"{cell:>20}" for cell in cells)
        )
    return [*lines, "in brackets: Table 2 of the paper"]


def interaction_lines(stats: dict[str, Any]) -> list[str]:
    """Return what outcomes and experts are like, and how often something was drawn again."""
    expert, lines = stats["expert"], []
    for name in ("push", "pick"):
        rows = [row for row in stats["outcomes"] if row["action"].startswith(name)]
        possible = sum(row["possible"] for row in rows)
        worked = sum(row["possible"] * row["success_share"] for row in rows)
        lines.append(
            f"{name}: {possible} possible, {worked / max(1, possible):.1%} succeed, "
            f"{sum(row['opened'] for row in rows)} open a blocked path"
        )
    lines[-1] += f"; {stats['openable_share_of_blocked']:.1%} of the blocked open by one of these"
    both = stats["agreement"]
    if both is not None:
        lowest = sorted((share, kind) for kind, share in both["share_by_type"].items())[:3]
        named = ", ".join(f"{kind} {share:.1%}" for share, kind in lowest if share < 1.0)
        lines.append(
            f"two engines agree on {both['share']:.1%} of {both['asked']} pushes"
            + (f" (lowest: {named})" if named else "")
            + f", on all of an episode's in {both['episodes_share']:.1%}"
        )
    told = stats["confounding"]
    if told is not None:
        lines.append(
            f"pushes of types that are pushed: {told['base_rate']:.1%} succeed; asset, type and "
            f"size guess {told['guess_accuracy']:.1%} right and tell "
            f"{told['information_share']:.1%} of what there is to know (cross-validated)"
        )
    lines.append(
        f"expert: solves {expert['solved']} ({expert['solved_share']:.1%}); steps "
        f"{_spread(expert['steps'])}; {expert['pushes']:.2f} pushes, {expert['picks']:.2f} picks; "
        f"SPL {expert['spl']:.3f}, STS {expert['sts']:.3f}"
    )
    by_number = ", ".join(f"{number}: {count}" for number, count in expert["interactions"].items())
    lines.append(f"experts by number of interactions: {by_number or 'none'}")
    again = ", ".join(f"{reason} {count}" for reason, count in stats["redraws"].items())
    lines.append(
        f"drawn again: {again or 'nothing'}; the expert refused {expert['refused_share']:.1%}"
    )
    return lines


def _spread(figures: dict[str, float]) -> str:
    return f"{figures['min']:g} - {figures['max']:g}, mean {figures['mean']:.2f}"
