"""Copies and pickles of environments: made anew from their arguments, and restored."""

from __future__ import annotations

import copy
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_data.core.storage import FolderStore, store_of
from internav_data.dataset.location import folder_to_read

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gymnasium.envs.registration import EnvSpec

    from internav_data.dataset import Dataset
    from internav_data.envs.slot import EpisodeSnapshot
    from internav_data.records import Episode


def with_absolute_path(dataset: str | Path | Dataset[Episode]) -> str | Dataset[Episode]:
    """Return a dataset's path, found from any directory, or its URL; a loaded dataset as it is."""
    if not isinstance(dataset, str | Path):
        return dataset
    store = store_of(folder_to_read(dataset))
    if not isinstance(store, FolderStore):
        return store.at("")
    return os.path.abspath(store.root)  # noqa: PTH100 - links stay what they are


def plain_spec(spec: EnvSpec | None) -> EnvSpec | None:
    """Return Gymnasium's record of an environment with its dataset as text, which JSON can write.

    A loaded dataset becomes its folder, split and filters.
    """
    if spec is None or "dataset" not in spec.kwargs:
        return spec
    spec = copy.copy(spec)
    spec.kwargs = dict(spec.kwargs)
    dataset = with_absolute_path(spec.kwargs["dataset"])
    if not isinstance(dataset, str):
        for name in ("split", "filters"):
            if getattr(dataset, name) is not None:
                spec.kwargs[name] = getattr(dataset, name)
        dataset = str(dataset.path)
    spec.kwargs["dataset"] = dataset
    return spec


class PlainSpec:
    """Environment whose record of how it was made can be written as JSON, and outlives `chdir`."""

    _spec: EnvSpec | None = None

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's record of how the environment was made."""
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = plain_spec(spec)


class Rebuilt(PlainSpec):
    """Environment whose copies and pickles are rebuilt: nothing of it lies in two of them.

    Buffers, cameras, houses and open files belong to one environment and to one process.
    """

    _arguments: dict[str, Any]
    """Arguments of the constructor."""
    _np_random: Any
    _np_random_seed: Any

    def snapshots(self) -> Sequence[EpisodeSnapshot | None]:
        """Return a snapshot of each slot, None where nothing has begun."""
        raise NotImplementedError

    def restore_snapshots(self, snapshots: Sequence[EpisodeSnapshot | None]) -> None:
        """Restore each slot that has a snapshot."""
        raise NotImplementedError

    def __getstate__(self) -> dict[str, Any]:
        spaces = {name: getattr(self, name) for name in ("action_space", "observation_space")}
        return {
            "arguments": self._arguments,
            "snapshots": self.snapshots(),
            "attributes": {
                **spaces,
                "_np_random": self._np_random,
                "_np_random_seed": self._np_random_seed,
                "_spec": self._spec,
            },
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(**state["arguments"])  # type: ignore[misc] # made anew, where it now is
        for name, value in state["attributes"].items():
            setattr(self, name, value)
        self.restore_snapshots(state["snapshots"])
