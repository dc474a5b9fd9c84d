"""Judges one scene and its episodes at the geometry level."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.verification.episodes import check_episode
from internav_data.verification.findings import Collector
from internav_data.verification.houses import check_doors, check_rooms, check_walls
from internav_data.verification.site import Site
from internav_data.verification.things import check_things, check_ways_through

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.records import Episode, House
    from internav_data.verification.shapes import Shapes


def check_scene(
    house: House, episodes: Sequence[Episode], shapes: Shapes, file: str = ""
) -> Collector:
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

    """
    report = Collector(file, house.scene_id)
    report.counts["scenes"] += 1
    unknown = sorted({t.asset_id for t in house.things} - set(shapes.assets))
    rooms = check_rooms(house, report)
    check_doors(house, rooms, report)
    check_walls(house, rooms, report)
    if not report.expect(not unknown, "thing.asset", "assets in assets.parquet", unknown):
        return report
    if len(rooms) < len(house.rooms) or "house.outline-polygon" in report.by_predicate:
        return report  # nothing can be measured in a house without proper rooms
    site = Site(house, shapes)
    check_things(house, rooms, site.shapes, report)
    check_ways_through(house, rooms, site.prints, site.ground, report)
    for number, episode in enumerate(episodes):
        check_episode(site, episode, report, exact=number == len(episodes) // 2)
        report.counts["episodes"] += 1
    return report
