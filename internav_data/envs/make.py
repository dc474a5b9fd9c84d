"""Vector environments in this process or in several."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from internav_data.dataset.location import MINI
from internav_data.envs.tasks import TaskConfig
from internav_data.envs.vector import InterNavVectorEnv

if TYPE_CHECKING:
    from pathlib import Path

    from gymnasium.vector import VectorEnv

    from internav_data.dataset import Dataset
    from internav_data.records import Episode


def make_vector(
    num_envs: int,
    dataset: str | Path | Dataset[Episode] = MINI,
    workers: int = 0,
    max_episode_steps: int | None = None,
    **arguments: Any,  # noqa: ANN401 - those of `InterNavVectorEnv`
) -> VectorEnv[Any, Any, Any]:
    """Make a vector environment: in this process, or (workers > 0) in that many others.

    Parameters
    ----------
    num_envs, dataset, **arguments
        Arguments of `InterNavVectorEnv`; without a dataset, the one that ships with the package.
    workers
        Number of processes.
    max_episode_steps
        Gymnasium's name for a limit of steps: the smaller of it and `max_steps` holds.
    """
    if max_episode_steps is not None:
        arguments["max_steps"] = min(
            max_episode_steps, arguments.get("max_steps", TaskConfig().max_steps)
        )
    if workers:
        from internav_data.envs.processes import InterNavProcesses  # noqa: PLC0415 - when asked for

        return InterNavProcesses(num_envs, dataset, workers, **arguments)
    return InterNavVectorEnv(num_envs, dataset, **arguments)
