"""A run answers the first signal in order, and ends at the second."""

import signal
import subprocess
import sys

import pytest

from internav_data.core.interrupts import Interrupts

RUN = """
import time
from internav_data.core.interrupts import Interrupts
with Interrupts() as stop:
    print("begun", flush=True)
    while not stop():
        time.sleep(0.01)
    print("saving", flush=True)
    time.sleep(60.0)
"""


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_second_signal_ends_a_process_at_once(signum):
    with subprocess.Popen([sys.executable, "-c", RUN], stdout=subprocess.PIPE, text=True) as run:
        for line in ("begun\n", "saving\n"):
            assert run.stdout.readline() == line
            run.send_signal(signum)
        try:
            assert run.wait(timeout=30) == 128 + signum
        finally:
            run.kill()


def test_a_signal_that_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    try:
        with Interrupts() as stop:
            signal.raise_signal(signal.SIGHUP)
            assert not stop()
            signal.raise_signal(signal.SIGTERM)
            assert stop.signum == signal.SIGTERM
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
