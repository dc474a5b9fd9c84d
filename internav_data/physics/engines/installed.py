"""Engines that can run here: those whose library is installed, and the line for one that is not."""

from __future__ import annotations

from importlib.util import find_spec

from internav_data.core.extras import install_command
from internav_data.physics.engines import ENGINES, MODULES
from internav_data.records.errors import MissingEngineError, UsageError


def available_engines() -> tuple[str, ...]:
    """Return the names of the engines whose library is installed; none is imported."""
    return tuple(name for name in ENGINES if _is_installed(name))


def require_engine(name: str, where: str = "", *, switchable: bool = False) -> None:
    """Check that an engine is known and its library installed; nothing is imported.

    Parameters
    ----------
    name
        Name of the engine.
    where
        Folder of the dataset that needs it, with which the error begins; empty for none.
    switchable
        Whether another engine would do as well: the error then names one that is installed.

    Raises
    ------
    UsageError
        No engine has this name.
    MissingEngineError
        Its library is not installed; the message has the command that installs it.

    """
    place = f"{where}: " if where else ""
    if name not in ENGINES:
        raise UsageError(
            f"{place}no physics engine is called {name!r}; known are {', '.join(ENGINES)}"
        )
    if _is_installed(name):
        return
    remedy, others = install_command(MODULES[name]), available_engines()
    if not others:
        line = f"{place}no physics engine is installed; for {name}, which is asked for: {remedy}"
    else:
        line = f"{place}the physics engine {name} is not installed: {remedy}"
        if switchable:
            line += f"; --physics {others[0]} is installed here and makes other data"
    raise MissingEngineError(line)


def _is_installed(name: str) -> bool:
    module = MODULES.get(name)
    return module is None or find_spec(module) is not None
