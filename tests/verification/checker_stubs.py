"""Setups of the validator's workers in tests; imported by name in their processes."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

STARTED = "STUB_STARTED"
"""Environment variable: folder in which each unit that is begun leaves a file."""


def hanging(_units):
    """Units that take for ever."""

    def check(number):
        (Path(os.environ[STARTED]) / str(number)).touch()
        time.sleep(600)

    return check


def dying(_units):
    """Units that kill their process."""

    def check(_number):
        os.kill(os.getpid(), signal.SIGKILL)

    return check
