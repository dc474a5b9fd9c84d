"""Child processes, in real ones."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
import worker_stubs

from internav_data.core import processes
from internav_data.core.processes import Child, end_if_orphaned, parent_is_gone

PARENT = """
import os, subprocess, sys, threading
def start():
    subprocess.Popen([sys.executable, "-c", {child!r}, str(os.getpid())])
{start}
sys.stdin.read()
"""
CHILD = """
import sys, time
from internav_data.core.processes import become_child, parent_is_gone
become_child(int(sys.argv[1]))
print("gone" if parent_is_gone() else "here", flush=True)
for _ in range(12000):  # not for ever: what it is there to show may fail
    time.sleep(0.01)
"""
LIMIT_S = 60.0


def started(start="start()"):
    """A parent that leads a process group, and its child, which is set up."""
    words = [sys.executable, "-c", PARENT.format(child=CHILD, start=start)]
    parent = subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert parent.stdout.readline() == "here\n"
    (child,) = psutil.Process(parent.pid).children()
    return parent, child


def ends(parent, child):
    parent.kill()
    parent.wait()  # without reading: the child has our pipe too
    left = psutil.wait_procs([child], LIMIT_S)[1]
    for process in left:
        process.kill()
    assert not left


def test_children_die_with_their_parent():
    parent, child = started()
    assert child.is_running()
    ends(parent, child)


@pytest.mark.parametrize("signum", [signal.SIGINT, signal.SIGTERM])
def test_children_leave_signals_of_the_group_to_their_parent(signum):
    answers = f"import signal; signal.signal({int(signum)}, lambda *_: os.write(1, b'parent\\n'))"
    parent, child = started(f"{answers}; start()")
    for _ in range(3):
        os.killpg(parent.pid, signum)
        assert parent.stdout.readline() == "parent\n"
    time.sleep(0.1)
    assert child.status() != psutil.STATUS_ZOMBIE
    ends(parent, child)


def test_the_end_of_the_thread_that_started_a_child_does_not_end_it():
    # The kernel looks at the thread only once the child has asked for its death to be told.
    work = "lambda: (start(), sys.stdin.readline())"
    parent, child = started(f"t = threading.Thread(target={work}); t.start(); t.join()")
    parent.stdin.write("end\n")
    parent.stdin.flush()
    time.sleep(0.3)
    assert child.status() != psutil.STATUS_ZOMBIE
    ends(parent, child)


def test_a_child_whose_parent_died_before_it_was_set_up_ends_at_once():
    done = subprocess.run(
        [sys.executable, "-c", CHILD, "1"],
        capture_output=True,
        text=True,
        check=False,
        timeout=LIMIT_S,
    )
    assert (done.returncode, done.stdout) == (1, "")


@pytest.mark.parametrize(
    ("killed", "cause"),
    [
        (False, "did not end within 0.5 s and was killed"),
        (True, "was killed by SIGKILL; the system may be short of memory"),
    ],
)
def test_a_child_that_had_to_be_killed_is_told_from_one_that_the_system_killed(
    monkeypatch, killed, cause
):
    monkeypatch.setattr(processes, "GRACE_S", 0.5)
    child = Child(worker_stubs.deaf)
    try:
        with pytest.raises(EOFError):
            child.pipe.recv()
        if killed:
            child.process.kill()
            child.process.wait()
        assert child.exit_cause() == cause
    finally:
        child.end(0.0)
        child.close()


def test_a_process_of_its_own_is_no_orphan():
    assert not parent_is_gone()
    end_if_orphaned()
