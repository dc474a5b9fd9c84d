"""Gymnasium environments over a dataset: `gymnasium.make("InterNav-v0", dataset=…)`.

Importing this registers the id (Gymnasium 1 loads no plugins by itself); so does
`gymnasium.make("internav_data.envs:InterNav-v0", …)`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.extras import missing
from internav_data.core.lazy import lazy_imports

try:
    import gymnasium
except ModuleNotFoundError as error:
    raise missing(error.name) from error

if TYPE_CHECKING:
    from internav_data.envs.auxiliary import AuxiliaryStart, auxiliary_starts
    from internav_data.envs.processes import InterNavProcesses
    from internav_data.envs.sensors import Sensor
    from internav_data.envs.single import InterNavEnv
    from internav_data.envs.slot import EpisodeSnapshot
    from internav_data.envs.vector import InterNavVectorEnv

__all__ = [
    "AuxiliaryStart",
    "EpisodeSnapshot",
    "InterNavEnv",
    "InterNavProcesses",
    "InterNavVectorEnv",
    "Sensor",
    "auxiliary_starts",
    "register",
]

ENV_ID = "InterNav-v0"


def register() -> None:
    """Register `InterNav-v0` with Gymnasium; a second call changes nothing."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(
            id=ENV_ID,
            entry_point="internav_data.envs.single:InterNavEnv",
            vector_entry_point="internav_data.envs.make:make_vector",
        )


register()

# Registering needs none of these.
__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "auxiliary": ["AuxiliaryStart", "auxiliary_starts"],
        "processes": ["InterNavProcesses"],
        "sensors": ["Sensor"],
        "single": ["InterNavEnv"],
        "slot": ["EpisodeSnapshot"],
        "vector": ["InterNavVectorEnv"],
    },
)
