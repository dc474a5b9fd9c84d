"""Table of the physics engines, each in a module of its own behind the protocol `Engine`.

To add one, write its module and add a row to `ENGINES`; `internav_data.physics.engines.protocol`
lists its methods and the figures that it states.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal, get_args

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.physics.engines.protocol import Engine

EngineName = Literal["bullet", "mujoco"]
DEFAULT_ENGINE: Final[EngineName] = "bullet"
"""Name of the engine that is taken where none is named."""


def _bullet() -> Engine:
    from internav_data.physics.engines.bullet import bullet  # noqa: PLC0415 - pybullet is imported when used

    return bullet()


def _mujoco() -> Engine:
    from internav_data.physics.engines.mujoco import mujoco_engine  # noqa: PLC0415 - imported when used

    return mujoco_engine()


ENGINES: Final[dict[str, Callable[[], Engine]]] = {"bullet": _bullet, "mujoco": _mujoco}
"""Function by engine name that returns this process's engine. It returns the same object every
time, for results are cached by engine.

The result cache believes no entry once a source file of physics has changed, or a library that the
engine names. An engine from elsewhere must change its `build` with its results."""
MODULES: Final = {"bullet": "pybullet", "mujoco": "mujoco"}
"""Module that an engine is built on, by the engine's name."""


def second_engine(name: str) -> EngineName:
    """Return the name of the engine that is asked for a second opinion beside another one."""
    names: tuple[EngineName, ...] = get_args(EngineName)
    return next(other for other in names if other != name)
