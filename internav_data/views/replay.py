"""Replays: frames of a video with the agent's camera, the map, and each action in words.

`replay_story` plays an episode and cuts it into shots, `replay_painters` draws the parts of a
frame, and `Replay` puts them together.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from internav_data.records.errors import UsageError
from internav_data.views.notebook import replay_html
from internav_data.views.replay_painters import (
    CameraPainter,
    Footer,
    Header,
    MapPainter,
    title_card,
)
from internav_data.views.replay_story import Moment, Shot, Story, play, shots
from internav_data.world import HouseModel
from internav_data.world.config import DEFAULT_WORLD

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from internav_data.core.typing import Image
    from internav_data.records import RGB, Asset, Episode, House
    from internav_data.world.config import WorldConfig

    Panel = Callable[["Moment"], Image]


SIZE: Final = 480
"""Pixels a side of the camera's picture."""
FPS: Final = 12.0
DEFAULTS: Final = {"mp4": (SIZE, FPS), "gif": (360, 8.0)}
"""Camera size and frames a second by kind of video; GIFs are smaller, as they hold more bytes."""
SIZES: Final = (160, 1080)
"""Smallest and largest size of the camera's picture."""
_PAPER: Final[RGB] = (250, 249, 246)
_EDGE: Final = 0.02
"""Gaps between pictures, as a share of the camera's picture."""


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """A played episode, ready to be drawn."""

    story: Story
    title: str
    """Name of the policy, for the title card."""

    @classmethod
    def of(
        cls,
        house: House | HouseModel,
        episode: Episode,
        assets: Mapping[str, Asset],
        actions: Sequence[int] | None = None,
        *,
        title: str | None = None,
        config: WorldConfig = DEFAULT_WORLD,
    ) -> Self:
        """Play an episode, to draw it any number of times; parameters as in `replay_frames`."""
        model = house if isinstance(house, HouseModel) else HouseModel.of(house)
        who = title or ("expert" if actions is None else "given actions")
        return cls(play(model, episode, assets, actions, config), who)

    def __repr__(self) -> str:
        episode = self.story.episode.episode_id
        end = "reaches the goal" if self.success else "misses the goal"
        return f"Replay({episode!r}, {self.title}, {self.steps} actions, {end})"

    def _repr_html_(self) -> str:
        """Return the replay as a GIF for a notebook."""
        return replay_html(self)

    @property
    def success(self) -> bool:
        """Whether the episode ends with Done at the goal."""
        return self.story.success

    @property
    def steps(self) -> int:
        """Number of actions that were played."""
        return self.story.moments[-1].step

    def frames(
        self, *, size: int = SIZE, fps: float = FPS, panel: Panel | None = None
    ) -> Iterator[Image]:
        """Draw the replay as frames (h, w, 3) uint8; parameters as in `replay_frames`.

        Raises
        ------
        UsageError
            The size or the rate is out of bounds, or the panel is not a picture of that size.
        """
        if not SIZES[0] <= size <= SIZES[1]:
            raise UsageError(
                f"a replay's camera has {SIZES[0]} to {SIZES[1]} pixels a side, got {size}"
            )
        if not 1.0 <= fps <= 60.0:
            raise UsageError(f"a replay has 1 to 60 frames a second, got {fps}")
        return self._frames(size, fps, panel)

    def _frames(self, size: int, fps: float, panel: Panel | None) -> Iterator[Image]:
        story = self.story
        painter = _Painter(story, size, panel)
        card = title_card(story, self.title, size)
        for k, shot in enumerate(shots(story, fps)):
            frame = painter.draw(shot, card if k == 0 else None)
            for _ in range(shot.frames):
                yield frame


def replay_frames(
    house: House | HouseModel,
    episode: Episode,
    assets: Mapping[str, Asset],
    actions: Sequence[int] | None = None,
    *,
    size: int = SIZE,
    fps: float = FPS,
    panel: Panel | None = None,
    title: str | None = None,
    config: WorldConfig = DEFAULT_WORLD,
) -> Iterator[Image]:
    """Play an episode and draw it: camera, map, words.

    Parameters
    ----------
    house
        The episode's house or its model.
    episode, assets
        The episode, and the assets of its obstacles by asset_id.
    actions
        Numbers of actions; -1 waits. The stored expert's by default.
    size
        Pixels a side of the camera's picture.
    fps
        Frames a second of the video: moves and slides are drawn in between.
    panel
        Function that is called once for each moment (the start, then after each action) and
        returns a picture (size, w, 3) uint8 RGB of constant width, drawn beside the map.
    title
        Name of the policy, for the title card.
    config
        Settings of the world: those of the episode's dataset.

    Yields
    ------
    (h, w, 3) uint8 RGB, all of one size; a frame that stays is the same array again.

    Raises
    ------
    UsageError
        No expert, an unknown action, another house's episode, a size or rate out of bounds.
    """
    made = Replay.of(house, episode, assets, actions, title=title, config=config)
    return made.frames(size=size, fps=fps, panel=panel)


class _Painter:
    """Composer of a frame from the pictures of a shot."""

    def __init__(self, story: Story, size: int, panel: Panel | None) -> None:
        self._size, self._gap = size, max(4, 2 * round(size * _EDGE / 2.0))
        self._camera_painter, self._map = CameraPainter(story, size), MapPainter(story, size)
        self._panel, self._beside = panel, self._side(story.moments[0], panel)
        self._moment = story.moments[0]
        width = size + self._map.size[0] + 3 * self._gap
        if self._beside is not None:
            width += self._beside.shape[1] + self._gap
        width += width % 2
        self._header, self._footer = Header(story, width, size), Footer(story, width, size)
        height = self._header.height + size + self._footer.height
        self._blank: Image = np.empty((height + height % 2, width, 3), np.uint8)
        self._blank[:] = _PAPER

    def _side(self, moment: Moment, panel: Panel | None) -> Image | None:
        if panel is None:
            return None
        picture = panel(moment)
        if picture.shape[0] != self._size or picture.ndim != 3 or picture.dtype != np.uint8:
            raise UsageError(
                f"a replay's panel: expected a picture ({self._size}, w, 3) of uint8, got "
                f"{picture.shape} of {picture.dtype}"
            )
        return picture

    def draw(self, shot: Shot, card: Image | None) -> Image:
        frame, gap = self._blank.copy(), self._gap
        if self._panel is not None and shot.moment is not self._moment:
            self._beside, self._moment = self._side(shot.moment, self._panel), shot.moment
        pictures = [self._camera_painter.draw(shot) if card is None else card, self._map.draw(shot)]
        if self._beside is not None:
            pictures.append(self._beside)
        top, left = self._header.height, gap
        frame[:top] = self._header.draw(shot)
        for picture in pictures:
            wide = picture.shape[1]
            frame[top : top + self._size, left : left + wide] = picture
            left += wide + gap
        bottom = top + self._size
        frame[bottom : bottom + self._footer.height] = self._footer.draw(shot)
        return frame
