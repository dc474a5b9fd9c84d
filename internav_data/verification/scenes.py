"""Judges one scene and its episodes at the geometry level, and at that of physics if asked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.episodes import check_episode
from internav_data.verification.findings import FindingCollector
from internav_data.verification.houses import check_doors, check_rooms, check_walls
from internav_data.verification.things import check_things, check_ways_through

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.records import Episode, House
    from internav_data.verification.settings import Settings
    from internav_data.verification.shapes import Shapes

UNTRUE = "geometry not as stated: physics not checked"


def check_scene(
    house: House,
    episodes: Sequence[Episode],
    shapes: Shapes,
    file: str = "",
    physics: Settings | None = None,
) -> FindingCollector:
    """Judge a house and its episodes, sharing what they have in common.

    Parameters
    ----------
    house
        The house; its own `assets` are not looked at.
    episodes
        Episodes of that house. The finely cut visibility graph is built for the one in the
        middle of them.
    shapes
        Of what `assets.parquet` says; worth keeping from scene to scene.
    file
        Path of the episodes' file, for findings.
    physics
        How the episodes were made, to play them again; None to leave physics alone.

    """
    report = FindingCollector(file, house.scene_id)
    report.counts["scenes"] += 1
    site = _check_house(house, shapes, report)
    true: list[Episode] = []
    if site is not None:
        sound = not report.by_predicate
        for number, episode in enumerate(episodes):
            holds = check_episode(site, episode, report, exact=number == len(episodes) // 2)
            report.counts["episodes"] += 1
            if sound and holds:
                true.append(episode)
    if physics is not None:
        if len(true) < len(episodes):
            report.notes[UNTRUE] += len(episodes) - len(true)
        if site is not None and true:
            _replay(site, true, physics, report)
    return report


def _check_house(house: House, shapes: Shapes, report: FindingCollector) -> CheckedLayout | None:
    """Judge a house; None where nothing can be measured in it."""
    unknown = sorted({t.asset_id for t in house.objects} - set(shapes.assets))
    rooms = check_rooms(house, report)
    check_doors(house, rooms, report)
    check_walls(house, rooms, report)
    if not report.expect(not unknown, "thing.asset", "assets in assets.parquet", unknown):
        return None
    if len(rooms) < len(house.rooms) or "house.outline-polygon" in report.by_predicate:
        return None  # nothing can be measured in a house without proper rooms
    site = CheckedLayout(house, shapes)
    check_things(house, rooms, site.shapes, report)
    check_ways_through(house, rooms, site.prints, site.ground, report)
    return site


def _replay(
    site: CheckedLayout, episodes: Sequence[Episode], settings: Settings, report: FindingCollector
) -> None:
    """Play episodes again. The engine is imported here: geometry does without."""
    from internav_data.verification.replay import CheckedScene, replay_episode  # noqa: PLC0415

    theatre = CheckedScene(site, settings)
    for episode in episodes:
        replay_episode(theatre, episode, report)
