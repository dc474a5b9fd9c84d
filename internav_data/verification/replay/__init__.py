"""Level `physics`: settling, outcomes and experts, played again and judged by slower means.

What a push or a fall leads to is a pure function of plain data that the generator, environments and
the validator share by design (`internav_data.world`): it is asked again, in another process and
after another history. What follows from where things lie then (distances, what carries what, where
the agent may be) is judged by this package's own geometry. No other module of `verification` may
import the world, and none `internav_data.episodes`.
"""

from internav_data.verification.replay.checked_scene import CheckedScene
from internav_data.verification.replay.episodes import replay_episode

__all__ = ["CheckedScene", "replay_episode"]
