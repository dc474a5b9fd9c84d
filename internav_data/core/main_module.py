"""Objects of the user's script, in a process that did not run it.

A class or function of `__main__` travels by name: whoever receives it must have the script. So the
script runs once in the receiver too, under another name, as multiprocessing's spawn has it; but
only where something of it was really sent.
"""

from __future__ import annotations

import pickle
from multiprocessing import spawn
from multiprocessing.reduction import ForkingPickler
from typing import Any

from internav_data.records.errors import UsageError

_importing = False


def dumped(given: object) -> tuple[bytes, dict[str, Any] | None]:
    """Return an object pickled, and how to run this process's script if it refers to it.

    Raises
    ------
    UsageError
        Something in the object cannot be pickled, or this process is itself running the script
        on behalf of another.
    """
    if _importing:
        raise UsageError(
            "workers: this script starts processes when it is imported; put that below "
            '`if __name__ == "__main__":`, or your sensors into a module of their own'
        )
    try:
        sent = bytes(ForkingPickler.dumps(given))
    except (AttributeError, TypeError, pickle.PicklingError) as error:
        raise UsageError(
            f"workers: an argument cannot be sent to another process ({error}); functions and "
            "classes of a module can, lambdas and local ones cannot"
        ) from error
    if b"__main__" not in sent:
        return sent, None
    script = spawn.get_preparation_data("worker")
    script.pop("authkey", None)  # a secret of multiprocessing's own, of no use here
    return sent, script


def loaded(sent: bytes, script: dict[str, Any] | None) -> Any:  # noqa: ANN401 - any object
    """Return an object that `dumped` pickled in another process; run its script first if need be.

    Raises
    ------
    UsageError
        The script starts processes when it is run, or has no such name.
    """
    global _importing  # noqa: PLW0603 - a fact about the process
    if script is not None:
        _importing = True
        try:
            spawn.prepare(script)
        finally:
            _importing = False
    try:
        return pickle.loads(sent)  # noqa: S301 - from our own parent
    except AttributeError as error:
        raise UsageError(
            f"workers: an argument is known to this process only ({error}); define it in a module"
        ) from error
