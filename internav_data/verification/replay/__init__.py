"""Level `physics`: settling, outcomes and experts, replayed and checked by slower means.

A push and a fall are pure functions of plain data that the generator, the environments and the
validator share by design (`internav_data.world`): they are solved again, in another process and
after another history. Everything that follows from the resulting poses (distances, which object
carries which, the agent's clearance) is derived by this package's own geometry. No other module
of `verification` may import the world, and none `internav_data.episodes`.
"""

from internav_data.verification.replay.checked_scene import CheckedScene
from internav_data.verification.replay.episodes import replay_episode

__all__ = ["CheckedScene", "replay_episode"]
