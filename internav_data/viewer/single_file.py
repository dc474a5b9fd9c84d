"""The page as one file: a sample of the episodes, with what the page may ask about them.

Videos of outcomes are those of the map: the camera's pictures would be half of the file.
"""

from __future__ import annotations

import base64
import gzip
import json
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from internav_data.core.storage import write_atomically
from internav_data.records.errors import InternavError, UsageError
from internav_data.viewer.page import page_with
from internav_data.viewer.routes import respond

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from internav_data.viewer.viewed import ViewedDataset

MAX_SAMPLE: Final = 200
"""Largest number of episodes in a file: one takes about 1.3 MB."""


def write_page(viewed: ViewedDataset, path: Path, count: int) -> int:
    """Write the page with a sample of the episodes, spread evenly over the dataset.

    Parameters
    ----------
    viewed
        The dataset.
    path
        File to write, atomically.
    count
        Number of episodes; all, where the dataset has fewer.

    Returns
    -------
    Number of episodes in the file.

    Raises
    ------
    UsageError
        The dataset has no episode, or more than `MAX_SAMPLE` are asked for.
    InternavError
        An episode cannot be read, or the file cannot be written.
    """
    if not 1 <= count <= MAX_SAMPLE:
        raise UsageError(f"a page holds 1 to {MAX_SAMPLE} episodes, got {count}")
    if not len(viewed.dataset):
        raise UsageError(f"{viewed.dataset.path}: has no episodes to show")
    total = len(viewed.index)
    rows = np.unique(np.linspace(0, total - 1, min(count, total)).round().astype(np.int64))
    episodes = [viewed.index.summary(int(row)) for row in rows]
    facts = viewed.facts() | {"episodes": len(episodes)}
    answers: dict[str, Any] = {"/api/dataset": facts, "/api/episodes": episodes}
    answers["/api/statistics"] = _json(viewed, "/api/statistics")
    for episode in episodes:
        answers.update(_answers(viewed, f"/api/episode/{episode['scene_id']}/{episode['index']}"))
    answers["/view3d"] = _viewer()
    try:
        write_atomically(path, page_with(answers, f"{facts['name']} · internav-data").encode())
    except OSError as error:
        raise InternavError(f"{path}: cannot be written: {error.strerror}") from error
    return len(episodes)


def _answers(viewed: ViewedDataset, base: str) -> Iterator[tuple[str, Any]]:
    """Yield the answers about an episode by their addresses."""
    facts = _json(viewed, base)
    yield base, facts
    for name in ("thumbnail", "floor"):
        yield f"{base}/{name}", _picture(viewed, f"{base}/{name}")
    model = base64.b64decode(viewed.model(facts["scene_id"], facts["index"]))
    yield f"{base}/model", base64.b64encode(gzip.compress(model, 9, mtime=0)).decode("ascii")
    if facts["expert"] is not None:
        play = _json(viewed, f"{base}/play")
        yield f"{base}/play", play
        for step in range(len(play["moments"])):
            yield f"{base}/play/{step}", _picture(viewed, f"{base}/play/{step}")
    for obstacle in facts["obstacles"]:
        for outcome in obstacle["outcomes"] or ():
            if outcome["video"]:
                url = f"{base}/obstacle/{obstacle['number']}/{outcome['action']}"
                yield url, _json(viewed, url)


def _viewer() -> dict[str, str]:
    from internav_data.viewer.scene3d import MARK, viewer_template  # noqa: PLC0415

    return {"page": viewer_template(), "mark": MARK}


def _answer(viewed: ViewedDataset, url: str) -> bytes:
    response = respond(viewed, url)
    if response.status != 200:  # noqa: PLR2004 - OK
        raise InternavError(json.loads(response.body)["error"])
    return response.body


def _json(viewed: ViewedDataset, url: str) -> Any:  # noqa: ANN401 - what JSON can hold
    return json.loads(_answer(viewed, url))


def _picture(viewed: ViewedDataset, url: str) -> str:
    return f"data:image/webp;base64,{base64.b64encode(_answer(viewed, url)).decode('ascii')}"
