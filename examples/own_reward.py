"""Train `ppo` on a reward of one's own: here interactions have a price.

python examples/own_reward.py data/mine runs/frugal stages.total_timesteps=100000
"""

import sys
from pathlib import Path

from internav_data.camp.config import config_of
from internav_data.camp.run import begin
from internav_data.camp.train import Request
from internav_data.envs.tasks import InteractiveNavigation
from internav_data.world import StepResult
from internav_data.world.actions import INTERACTION_KINDS


class FrugalNavigation(InteractiveNavigation):
    """The main task, where a push, a pickup or a drop costs as much as five steps."""

    name = "frugal"
    PRICE = 0.05

    def step(self, result: StepResult) -> tuple[float, bool]:
        """Return the main task's reward less the price, and whether the episode ends."""
        reward, ended = super().step(result)
        if result.action.kind in INTERACTION_KINDS:
            reward -= self.PRICE
            self.statistics.reward -= self.PRICE  # logged as `episode/return`
        return reward, ended


if __name__ == "__main__":
    dataset, out, *settings = sys.argv[1:]
    config = config_of("small", overrides=settings)
    request = Request(Path(dataset), Path(out), "ppo", config, ("all",), task=FrugalNavigation)
    print("trained", begin(request).run)
