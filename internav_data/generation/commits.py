"""Commits of a run under way: readers have its first scenes while others are being made."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.dataset import (
    commit_scenes,
    has_manifest,
    read_manifest,
    shards,
    staged_scenes,
)
from internav_data.records.splits import split_of_scene

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from internav_data.dataset import DatasetPart, Identity, Staging
    from internav_data.generation.progress import GenerationProgress
    from internav_data.records import Asset


class PrefixCommits:
    """Commits the scenes before the first one that is missing, a full training shard at a time.

    More often would write the same rows again and again: a shard that is not full is replaced.

    Parameters
    ----------
    staging, identity, assets
        Staged scenes of the run, its identity, and all assets of its catalogue.
    done
        Numbers of the scenes that need not be made.
    progress
        Reporter, told how many scenes can be read.
    part
        Range of scenes, where they are to be a part of a dataset.

    """

    def __init__(
        self,
        staging: Staging,
        identity: Identity,
        assets: Sequence[Asset],
        done: Collection[int],
        progress: GenerationProgress,
        part: DatasetPart | None = None,
    ) -> None:
        self._staging, self._identity, self._assets = staging, identity, assets
        self._progress, self._part = progress, part
        self._first = part.first_scene if part else 0
        store = staging.store
        held = read_manifest(store).scene_numbers if has_manifest(store) else range(0)
        self._held = held.stop or self._first
        self._ended = {*done, *held}
        self._first_missing = self._full = self._first
        self._train = 0
        progress.readable = len(held)
        self._advance()

    def add(self, scene: int) -> None:
        """Note that a scene is staged; commit if a shard is full by now."""
        self._ended.add(scene)
        self._advance()
        self._commit(self._full)

    def commit_all(self) -> None:
        """Commit all scenes before the first one that is missing."""
        self._commit(self._first_missing)

    def _advance(self) -> None:
        while self._first_missing in self._ended:
            train = split_of_scene(self._first_missing) == "train"
            self._first_missing += 1
            self._train += train
            if train and self._train % shards.SCENES_PER_SHARD["episodes"] == 0:
                self._full = self._first_missing

    def _commit(self, end: int) -> None:
        if end <= self._held or not self._any_good(end):
            return
        commit_scenes(self._staging, self._identity, self._assets, end, self._part)
        self._held = end
        self._progress.readable = end - self._first

    def _any_good(self, end: int) -> bool:
        """Return whether a dataset of the scenes before `end` would hold one."""
        if self._held > self._first:
            return True
        states = staged_scenes(self._staging, range(self._first, end))
        return any(not state.quarantined for state in states.values())
