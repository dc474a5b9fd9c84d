"""A dataset behind the page: opened once, its pictures and plays made when they are asked for."""

from __future__ import annotations

import contextlib
import hashlib
import json
import threading
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from internav_data.core.locks import ThreadLock
from internav_data.core.lru import LRUCache
from internav_data.dataset import load_dataset
from internav_data.dataset.stats import PAPER, compute_stats
from internav_data.records.errors import CorruptDataError, UsageError
from internav_data.viewer.episode_filter import MAX_PAGE, EpisodeFilter, page_of_query
from internav_data.viewer.episode_index import EpisodeIndex

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from pathlib import Path

    from internav_data.records import Episode, House
    from internav_data.viewer.expert_play import ExpertPlay
    from internav_data.viewer.outcome_video import OutcomeVideo
    from internav_data.viewer.pictures import ThumbnailPainter

PICTURE_BYTES: Final = 12 << 20
"""Bytes of finished pictures in memory: some 700 thumbnails."""
_ROW_GROUP_BYTES: Final = 8 << 20
_FILES: Final = 3
_HOUSES: Final = 12
_PLAYS: Final = 2
"""Played experts, and videos of outcomes, in memory."""


class NoSuchEpisodeError(UsageError):
    """Episode that the dataset does not have."""


class ViewedDataset:
    """Dataset of which a page shows statistics, a gallery and episodes; threads share it.

    Parameters
    ----------
    path
        Folder of the dataset.

    Raises
    ------
    CorruptDataError
        There is no dataset, or one of another version, or files are missing or cut short.
    """

    def __init__(self, path: Path) -> None:
        self.dataset = load_dataset(path)
        self.dataset.limit_caches(_ROW_GROUP_BYTES, _FILES, _HOUSES)
        self._index: EpisodeIndex | None = None
        self._ended = threading.Event()
        """Set where nobody waits for the columns any more."""
        self._reading = ThreadLock()
        """Held while the columns are read: the first page does not wait for it."""
        self._lock = ThreadLock()
        self._drawing = ThreadLock()
        self._pictures: LRUCache[tuple[Any, ...], bytes] = LRUCache(PICTURE_BYTES, weigh=len)
        self._plays: LRUCache[str, ExpertPlay] = LRUCache(_PLAYS)
        self._videos: LRUCache[tuple[str, int, str], OutcomeVideo] = LRUCache(_PLAYS)

    @property
    def index(self) -> EpisodeIndex:
        """Columns to filter by, read at the first use."""
        with self._reading:
            if self._index is None:
                dataset = self.dataset
                self._index = EpisodeIndex.read(dataset.store, dataset.manifest, self._ended.is_set)
            return self._index

    @contextlib.contextmanager
    def warming(self) -> Iterator[None]:
        """Read the columns and import what draws pictures in a thread, while a block runs.

        The block's end stops the reading, also that of a request, and waits for the thread: one
        that the interpreter ends within arrow aborts the process.
        """
        self._ended.clear()
        thread = threading.Thread(target=self._warm, name="viewer-warm")
        thread.start()
        try:
            yield
        finally:
            self._ended.set()
            thread.join()

    def _warm(self) -> None:
        try:
            _ = self._thumbnails, self.index
        except Exception:  # noqa: BLE001 - whoever asks for it is told, where it is missing
            return

    @property
    def ready(self) -> bool:
        """Whether the columns have been read."""
        return self._index is not None

    def facts(self) -> dict[str, Any]:
        """Return what the page says of the dataset."""
        manifest = self.dataset.manifest
        counts = manifest.counts.values()
        catalog = manifest.config.get("catalog")
        hidden = isinstance(catalog, dict) and catalog.get("attributes") == "hidden"
        return {
            "name": self.dataset.path.name,
            "scenes": sum(count.scenes for count in counts),
            "episodes": sum(count.episodes for count in counts),
            "splits": {name: count.episodes for name, count in manifest.counts.items()},
            "seed": manifest.seed,
            "made_by": f"{manifest.generator} {manifest.generator_version}",
            "format": manifest.format_version,
            "version": self.dataset.digest[:12],
            "quarantined": len(manifest.quarantined),
            "hidden_attributes": hidden,
        }

    def episodes(self, query: Mapping[str, str]) -> dict[str, Any]:
        """Return a page of the episodes that a query's conditions keep.

        Counts by value are null while the columns are still being read; a page without conditions
        does not wait for them.

        Raises
        ------
        UsageError
            A condition is unknown or wrong.
        """
        chosen = EpisodeFilter.of_query(query)
        offset, limit = page_of_query(query)
        if chosen.empty and not self.ready:
            total = len(self.dataset)
            shown = self.dataset[offset : offset + limit]
            rows = [_summary(episode) for episode in shown]
            return {"total": total, "offset": offset, "episodes": rows, "counts": None}
        index = self.index
        kept = index.select(chosen)
        return {
            "total": len(kept),
            "offset": offset,
            "episodes": [index.summary(int(row)) for row in kept[offset : offset + limit]],
            "counts": index.counts(chosen),
        }

    def neighbours(self, scene_id: str, number: int, query: Mapping[str, str]) -> dict[str, Any]:
        """Return an episode's place among those that a query keeps, and the ones beside it."""
        index, kept = self.index, self.index.select(EpisodeFilter.of_query(query))
        row = index.row_of(scene_id, number)
        places = (kept == row).nonzero()[0]
        place = int(places[0]) if len(places) else None

        def at(position: int) -> dict[str, Any] | None:
            return index.summary(int(kept[position])) if 0 <= position < len(kept) else None

        return {
            "total": len(kept),
            "place": place,
            "before": None if place is None else at(place - 1),
            "after": at(0) if place is None else at(place + 1),
        }

    def episode(self, scene_id: str, number: int) -> dict[str, Any]:
        """Return an episode as its page shows it (see `episode_facts`)."""
        from internav_data.viewer.episode_facts import episode_facts  # noqa: PLC0415

        house, episode = self._at(scene_id, number)
        return episode_facts(house, episode, self.dataset.assets)

    def thumbnail(self, scene_id: str, number: int) -> bytes:
        """Return an episode's picture for the gallery, WebP."""

        def draw() -> bytes:
            house, episode = self._at(scene_id, number)
            return self._thumbnails.draw(house, episode, self.dataset.assets)

        return self._picture(("thumbnail", scene_id, number), draw)

    def floor(self, scene_id: str, number: int) -> bytes:
        """Return the picture below an episode's map, WebP."""
        from internav_data.viewer.pictures import draw_floor  # noqa: PLC0415

        def draw() -> bytes:
            return draw_floor(*self._at(scene_id, number), self.dataset.assets)

        return self._picture(("floor", scene_id, number), draw)

    def play(self, scene_id: str, number: int) -> dict[str, Any]:
        """Return the expert's moments (see `ExpertPlay`)."""
        with self._drawing:
            return self._play(scene_id, number).moments()

    def play_picture(self, scene_id: str, number: int, step: int) -> bytes:
        """Return the camera's picture after some of the expert's actions, WebP."""

        def draw() -> bytes:
            return self._play(scene_id, number).picture(step)

        return self._picture(("play", scene_id, number, step), draw)

    def video(self, scene_id: str, number: int, obstacle: int, action: str) -> dict[str, Any]:
        """Return the video of an outcome from above; obstacles count from 1."""
        return self._video(scene_id, number, obstacle, action).keyframes()

    def video_picture(
        self, scene_id: str, number: int, obstacle: int, action: str, frame: int
    ) -> bytes:
        """Return one of the camera's pictures of an outcome, WebP."""

        def draw() -> bytes:
            return self._video(scene_id, number, obstacle, action).picture(frame)

        return self._picture(("video", scene_id, number, obstacle, action, frame), draw)

    def model(self, scene_id: str, number: int) -> bytes:
        """Return the house with an episode's obstacles as base64 of a GLB."""
        from internav_data.viewer.scene3d import glb_text, house_glb  # noqa: PLC0415

        def make() -> bytes:
            glb = house_glb(*self._at(scene_id, number), self.dataset.assets)
            return glb_text(glb).encode()

        return self._picture(("model", scene_id, number), make)

    @cached_property
    def _stats(self) -> dict[str, Any]:
        """Statistics that lie beside the data; computed where there are none, or damaged ones."""
        store = self.dataset.store
        for file in self.dataset.manifest.metadata or ():
            if file.path == "stats.json":
                with contextlib.suppress(OSError, ValueError):
                    content = store.read(file.path)
                    if hashlib.sha256(content).hexdigest() == file.sha256:
                        stored: dict[str, Any] = json.loads(content)
                        return stored
        return compute_stats(self.dataset)

    def statistics(self) -> dict[str, Any]:
        """Return statistics of the dataset, and histograms of its columns."""
        with self._lock:
            stats = self._stats
        counts = self.index.counts(EpisodeFilter())
        return {"stats": stats, "counts": counts, "paper_rooms": [list(span) for span in PAPER]}

    @cached_property
    def _thumbnails(self) -> ThumbnailPainter:
        from internav_data.viewer.pictures import ThumbnailPainter  # noqa: PLC0415

        return ThumbnailPainter()

    def _picture(self, key: tuple[Any, ...], draw: Callable[[], bytes]) -> bytes:
        # One at a time: buffers of pictures are most of the memory that drawing takes.
        with self._drawing:
            return self._pictures.get(key, draw)

    def _play(self, scene_id: str, number: int) -> ExpertPlay:
        from internav_data.viewer.expert_play import ExpertPlay  # noqa: PLC0415
        from internav_data.world.config import WorldConfig  # noqa: PLC0415

        house, episode = self._at(scene_id, number)
        config = WorldConfig.of_dataset(self.dataset.manifest.config)
        return self._plays.get(
            episode.episode_id, lambda: ExpertPlay(house, episode, self.dataset.assets, config)
        )

    def _video(self, scene_id: str, number: int, obstacle: int, action: str) -> OutcomeVideo:
        from internav_data.viewer.outcome_video import OutcomeVideo  # noqa: PLC0415

        house, episode = self._at(scene_id, number)
        assets = self.dataset.assets
        return self._videos.get(
            (episode.episode_id, obstacle, action),
            lambda: OutcomeVideo(house, episode, assets, obstacle - 1, action),
        )

    def _at(self, scene_id: str, number: int) -> tuple[House, Episode]:
        """Return a house and one of its episodes.

        Raises
        ------
        NoSuchEpisodeError
            There is no such episode.
        CorruptDataError
            A file is damaged, or its rows are others than its columns said.
        """
        row = self._row(scene_id, number)
        with self._lock:
            episode: Episode = self.dataset[row]
            if (episode.scene_id, episode.index) != (scene_id, number):
                raise CorruptDataError(
                    f"{self.dataset.path}: row {row} is {episode.episode_id}, expected "
                    f"{scene_id}/{number:04d}: the dataset was made anew; start the viewer again"
                )
            return self.dataset.scene(scene_id), episode

    def _row(self, scene_id: str, number: int) -> int:
        if not self.ready:  # the first page is there before the columns are
            for first, episode in enumerate(self.dataset[:MAX_PAGE]):
                if (episode.scene_id, episode.index) == (scene_id, number):
                    return first
        row = self.index.row_of(scene_id, number)
        if row is None:
            raise NoSuchEpisodeError(
                f"{self.dataset.path}: no episode {scene_id}/{number:04d}; it has "
                f"{len(self.dataset)} episodes in {len(self.dataset.scene_ids)} scenes"
            )
        return row


def _summary(episode: Episode) -> dict[str, Any]:
    """Return what a gallery says of an episode, as `EpisodeIndex.summary` does."""
    return {
        "scene_id": episode.scene_id,
        "index": episode.index,
        "split": episode.split,
        "rooms": episode.room_count,
        "mode": episode.mode,
        "sealed": episode.sealed,
        "obstacles": episode.obstacle_count,
        "distance": round(episode.shortest_path_m, 4),
        "types": sorted({obstacle.type for obstacle in episode.obstacles}),
    }
