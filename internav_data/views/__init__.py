"""Pictures: houses and episodes from above, assets in perspective, contact sheets, replays."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports
from internav_data.records.display import register_display
from internav_data.views.notebook import episode_html, house_png

if TYPE_CHECKING:
    from internav_data.views.episodes import draw_episode, episode_lines
    from internav_data.views.plan import draw_house, house_line
    from internav_data.views.replay import Replay, replay_frames
    from internav_data.views.replay_actions import ActionList, read_actions
    from internav_data.views.replay_story import Moment
    from internav_data.views.sheets import contact_sheet, write_png
    from internav_data.views.video import video_format, write_video

__all__ = [
    "ActionList",
    "Moment",
    "Replay",
    "contact_sheet",
    "draw_episode",
    "draw_house",
    "episode_lines",
    "house_line",
    "read_actions",
    "replay_frames",
    "video_format",
    "write_png",
    "write_video",
]

register_display("House", "png", house_png)
register_display("Episode", "html", episode_html)

# A picture of a house needs neither physics nor camera.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "episodes": ["draw_episode", "episode_lines"],
        "plan": ["draw_house", "house_line"],
        "replay": ["Replay", "replay_frames"],
        "replay_actions": ["ActionList", "read_actions"],
        "replay_story": ["Moment"],
        "sheets": ["contact_sheet", "write_png"],
        "video": ["video_format", "write_video"],
    },
)
