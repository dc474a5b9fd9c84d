"""Scenes by the arithmetic that made them, where a dataset was made by more than one."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from internav_data.dataset.manifest import Manifest
    from internav_data.dataset.staging import SceneState

_RANGES: Final = re.compile(r"\d{1,8}:\d{1,8}(?:,\d{1,8}:\d{1,8})*", re.ASCII)
_NOBODY: Final = -1


def hardware_of(
    manifests: Sequence[Manifest], states: Sequence[SceneState] = ()
) -> tuple[str, ...]:
    """Return the names of the arithmetic of datasets and staged scenes; () where one is unknown."""
    if any(manifest.scenes and not manifest.hardware for manifest in manifests):
        return ()
    made = [state for state in states if not state.quarantined] or states
    names = {name for manifest in manifests for name in manifest.hardware}
    return tuple(sorted({*names, *(state.hardware for state in made)}))


def hardware_scenes(
    names: Sequence[str],
    numbers: range,
    manifests: Sequence[Manifest],
    states: Sequence[SceneState],
    quarantined: Sequence[int],
) -> dict[str, str] | None:
    """Return `Manifest.hardware_scenes` of a dataset.

    Parameters
    ----------
    names
        Names of the arithmetic that made its scenes, as of `hardware_of`.
    numbers
        Numbers of its scenes.
    manifests, states
        Origins of the scenes; a staged one takes the place of one that was quarantined.
    quarantined
        Numbers of the scenes that nobody could make.

    """
    if len(names) < 2:  # noqa: PLR2004 - one made all
        return None
    makers = np.full(len(numbers), _NOBODY, np.int32)
    for manifest in manifests:
        held = manifest.hardware_scenes
        if held is None and len(manifest.hardware) > 1:
            return None  # of a release that does not say
        whole = manifest.scene_numbers
        for name in manifest.hardware:
            for span in [whole] if held is None else ranges_of(held[name]):
                makers[span.start - numbers.start : span.stop - numbers.start] = names.index(name)
    for state in (state for state in states if not state.quarantined):
        makers[state.scene - numbers.start] = names.index(state.hardware)
    makers[[scene - numbers.start for scene in quarantined]] = _NOBODY
    return {name: _text(makers == k, numbers.start) for k, name in enumerate(names)}


def ranges_of(text: str) -> tuple[range, ...]:
    """Return the ranges of scenes that a text `A:B,C:D` names.

    Raises
    ------
    ValueError
        It is no such text, or its ranges are empty or out of order.

    """
    if text == "":
        return ()
    if not isinstance(text, str) or not _RANGES.fullmatch(text):
        raise ValueError(f"expected ranges of scenes as in 0:6,8:9, got {str(text)[:40]!r}")
    spans = tuple(range(*map(int, span.split(":"))) for span in text.split(","))
    ends = [end for span in spans for end in (span.start, span.stop)]
    if any(later <= former for former, later in pairwise(ends)):
        raise ValueError(f"expected ranges that ascend with gaps, got {text[:40]!r}")
    return spans


def wrong_scene_hardware(
    held: Mapping[str, str], names: Sequence[str], numbers: range, quarantined: Sequence[int]
) -> Iterator[str]:
    """Yield what is wrong in a manifest's `hardware_scenes`.

    It must name the arithmetic that `hardware` names, and each scene once that is not quarantined.
    """
    if not isinstance(held, dict) or sorted(held) != list(names):
        yield f"hardware_scenes: expected an object with the keys {list(names)}, got {held!r}"
        return
    times = np.zeros(len(numbers), np.int32)
    for name, text in held.items():
        try:
            spans = ranges_of(text)
        except ValueError as error:
            yield f"hardware_scenes: {name!r}: {error}"
            return
        if spans and not (numbers.start <= spans[0].start and spans[-1].stop <= numbers.stop):
            yield f"hardware_scenes: {name!r}: expected scenes of {numbers}, got {text[:40]!r}"
            return
        for span in spans:
            times[span.start - numbers.start : span.stop - numbers.start] += 1
    times[[scene - numbers.start for scene in quarantined]] += 1
    wrong = np.flatnonzero(times != 1)
    if wrong.size:
        yield f"hardware_scenes: scene {numbers.start + wrong[0]} is named {times[wrong[0]]} times"


def _text(chosen: np.ndarray, first: int) -> str:
    """Return the numbers at which an array of booleans is true as ranges, from `first` on."""
    edges = np.flatnonzero(np.diff(chosen, prepend=False, append=False)) + first
    return ",".join(f"{start}:{stop}" for start, stop in edges.reshape(-1, 2).tolist())
