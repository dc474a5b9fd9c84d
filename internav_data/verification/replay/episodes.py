"""Replay of one episode: settling, outcomes, expert."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.physics import cache_disabled, get_solver
from internav_data.physics.engines.installed import available_engines
from internav_data.verification.replay.comparison import compare_outcomes
from internav_data.verification.replay.elsewhere import TolerantExpect
from internav_data.verification.replay.expert_replay import check_experts
from internav_data.verification.replay.outcomes import check_outcomes
from internav_data.verification.replay.settling import check_settling
from internav_data.verification.replay.whole_house import ENGINES, check_whole_house, is_sampled

if TYPE_CHECKING:
    from internav_data.records import Episode
    from internav_data.verification.findings import FindingCollector
    from internav_data.verification.obstacles import Expect
    from internav_data.verification.replay.checked_scene import CheckedScene


def replay_episode(scene: CheckedScene, episode: Episode, report: FindingCollector) -> None:
    """Check the physics of an episode whose geometry is true, without the result cache.

    Skipped checks are counted in the report's notes. Where the config names another engine, the
    outcomes are compared with its outcomes instead (`compare_outcomes`).
    """
    with cache_disabled():
        if scene.config.other_engine is not None:
            compare_outcomes(scene, episode, report, scene.config.other_engine)
        else:
            _replay(scene, episode, report)


def _replay(scene: CheckedScene, episode: Episode, report: FindingCollector) -> None:
    name = episode.episode_id

    def exact(holds: object, predicate: str, expected: object, got: object) -> bool:
        return report.expect(holds, predicate, expected, got, name)

    expect = exact if scene.config.same_hardware else TolerantExpect(episode, report)
    engine = get_solver(scene.engine(episode))
    made = f"{episode.physics.engine} of {episode.physics.build}"
    here = f"{engine.name} of {engine.build}"
    if made != here:
        report.notes[f"made by {made}, checked by {here}: results may differ"] += 1
    config = scene.config
    if config.engine is not None:
        expect(
            episode.physics.engine == config.engine,
            "physics.engine",
            config.engine,
            episode.physics.engine,
        )
        asked = episode.physics.other_engine is not None
        expect(asked == config.cross_check, "physics.cross-check", config.cross_check, asked)
    check_settling(scene, episode, expect)
    if any(obstacle.outcomes is None for obstacle in episode.obstacles):
        report.notes["no outcomes stored: not checked"] += 1
    check_outcomes(scene, episode, expect, _second_engine(episode, report))
    if episode.expert is None:
        report.notes["no expert stored: not checked"] += 1
    check_experts(scene, episode, expect)
    if made == here and is_sampled(episode):
        _check_house(scene, episode, expect, report)
    report.counts["replayed"] += 1
    report.counts["made elsewhere"] += not scene.config.same_hardware


def _second_engine(episode: Episode, report: FindingCollector) -> str | None:
    """Return the engine whose second opinions can be asked again; None without any."""
    name = episode.physics.other_engine
    if name is None:
        return None
    if name not in available_engines():
        report.notes[f"the engine {name} is not installed: its second opinions not checked"] += 1
        return None
    made, here = episode.physics.other_build, get_solver(name).build
    if made != here:
        report.notes[f"second opinions of {made}, checked by {here}: results may differ"] += 1
    return name


def _check_house(
    scene: CheckedScene, episode: Episode, expect: Expect, report: FindingCollector
) -> None:
    """Build the episode's house, unless another engine made the data than builds houses here."""
    if episode.physics.engine not in ENGINES:
        report.notes[f"whole houses are built in {' and '.join(ENGINES)} alone: not checked"] += 1
        return
    check_whole_house(scene.layout.house, scene.layout.shapes, episode, expect)
    report.counts["whole houses"] += 1
