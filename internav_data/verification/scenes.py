"""Check of one scene and its episodes at the levels `geometry` and `physics`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.verification.checked_layout import CheckedLayout
from internav_data.verification.episodes import check_episode
from internav_data.verification.findings import FindingCollector
from internav_data.verification.houses import check_doors, check_rooms, check_walls
from internav_data.verification.objects import check_objects, check_passages
from internav_data.verification.outcomes import check_outcomes
from internav_data.verification.surfaces import SINCE, check_surfaces

if TYPE_CHECKING:
    from collections.abc import Sequence

    from internav_data.records import Episode, House
    from internav_data.verification.checked_config import CheckedConfig
    from internav_data.verification.outcomes import Scope
    from internav_data.verification.shapes import Shapes

UNTRUE = "geometry not as stated: physics not checked"


def check_scene(
    house: House,
    episodes: Sequence[Episode],
    shapes: Shapes,
    file: str = "",
    physics: CheckedConfig | None = None,
    catalogue_version: int = SINCE,
) -> FindingCollector:
    """Check a house and its episodes.

    Parameters
    ----------
    house
        The house; its own `assets` are ignored.
    episodes
        Episodes of that house. The finely cut visibility graph is built for the one in the
        middle of them, and distances after its outcomes are derived.
    shapes
        Shapes of the assets of the dataset; share them between scenes.
    file
        Path of the episodes' file, for findings.
    physics
        Generation settings for the level `physics`, at which the distances after all outcomes
        are derived; None to omit it.
    catalogue_version
        Version of the dataset's catalogue: early ones had thick rugs, and things overhung.

    """
    report = FindingCollector(file, house.scene_id)
    report.counts["scenes"] += 1
    layout = _check_house(house, shapes, report)
    if layout is not None and catalogue_version >= SINCE:
        check_surfaces(house, shapes, report)
    true: list[Episode] = []
    if layout is not None:
        sound = not report.by_predicate
        for number, episode in enumerate(episodes):
            middle = number == len(episodes) // 2
            holds = check_episode(layout, episode, report, exact=middle)
            report.counts["episodes"] += 1
            if holds:
                scope: Scope = "all" if physics is not None else "sample" if middle else "poses"
                check_outcomes(layout, episode, report, scope)
            if sound and holds:
                true.append(episode)
    if physics is not None:
        if len(true) < len(episodes):
            report.notes[UNTRUE] += len(episodes) - len(true)
        if layout is not None and true:
            _replay(layout, true, physics, report)
    return report


def _check_house(house: House, shapes: Shapes, report: FindingCollector) -> CheckedLayout | None:
    """Check a house and return its layout; None if nothing can be measured in it."""
    unknown = sorted({t.asset_id for t in house.objects} - set(shapes.assets))
    rooms = check_rooms(house, report)
    check_doors(house, rooms, report)
    check_walls(house, rooms, report)
    if not report.expect(not unknown, "object.asset", "assets in the assets", unknown):
        return None
    if len(rooms) < len(house.rooms) or "house.outline-polygon" in report.by_predicate:
        return None  # nothing can be measured in a house without proper rooms
    layout = CheckedLayout(house, shapes)
    check_objects(layout, rooms, report)
    check_passages(house, rooms, layout.footprints, layout.lattice, report)
    return layout


def _replay(
    layout: CheckedLayout,
    episodes: Sequence[Episode],
    config: CheckedConfig,
    report: FindingCollector,
) -> None:
    """Replay episodes. The engine is imported here: the level `geometry` needs none."""
    from internav_data.verification.replay import CheckedScene, replay_episode  # noqa: PLC0415

    scene = CheckedScene(layout, config)
    for episode in episodes:
        replay_episode(scene, episode, report)
