"""Pictures: houses and episodes from above, assets in perspective, contact sheets."""

from internav_data.views.plan import draw_house, house_line
from internav_data.views.sheets import contact_sheet, write_png
from internav_data.views.tasks import draw_episode, episode_lines

__all__ = [
    "contact_sheet",
    "draw_episode",
    "draw_house",
    "episode_lines",
    "house_line",
    "write_png",
]
