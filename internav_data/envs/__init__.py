"""Gymnasium environments over a dataset: `gymnasium.make("InterNav-v0", dataset=…)`.

Importing this registers the id (Gymnasium 1 loads no plugins by itself); so does
`gymnasium.make("internav_data.envs:InterNav-v0", …)`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import gymnasium

if TYPE_CHECKING:
    from internav_data.envs.auxiliary import AuxiliaryStart, auxiliary_starts
    from internav_data.envs.processes import InterNavProcesses
    from internav_data.envs.single import InterNavEnv
    from internav_data.envs.slot import EpisodeSnapshot
    from internav_data.envs.vector import InterNavVectorEnv

__all__ = [
    "AuxiliaryStart",
    "EpisodeSnapshot",
    "InterNavEnv",
    "InterNavProcesses",
    "InterNavVectorEnv",
    "auxiliary_starts",
    "register",
]

ENV_ID = "InterNav-v0"

_HOMES = {
    "AuxiliaryStart": "auxiliary",
    "EpisodeSnapshot": "slot",
    "InterNavEnv": "single",
    "InterNavProcesses": "processes",
    "InterNavVectorEnv": "vector",
    "auxiliary_starts": "auxiliary",
}


def register() -> None:
    """Tell Gymnasium about the environments; a second time changes nothing."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(
            id=ENV_ID,
            entry_point="internav_data.envs.single:InterNavEnv",
            vector_entry_point="internav_data.envs.make:make_vector",
        )


register()


def __getattr__(name: str) -> object:
    """Import what is asked for: registering needs none of it."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
