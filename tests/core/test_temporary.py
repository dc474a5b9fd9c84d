"""Temporary folders go with their process, or with the next one."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from internav_data.core import temporary

HOLD = """
import sys, time
from internav_data.core.temporary import process_folder
folder = process_folder()
(folder / "0.obj").touch()
print(folder, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(temporary, "_SETTLED_S", -1.0)
    return tmp_path


def holder(folder):
    """Start a process that holds a folder; return it and the folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD],
        env=os.environ | {"TMPDIR": str(folder)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    return process, Path(process.stdout.readline().strip())


def test_the_folder_of_a_killed_process_goes_with_the_next_one(folder):
    process, held = holder(folder)
    temporary.sweep_folders()
    assert any(held.iterdir()), "its process lives"
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert held.exists()
    temporary.sweep_folders()
    assert not any(folder.iterdir())


def test_a_folder_goes_with_its_process(folder):
    process, held = holder(folder)
    process.communicate("")
    assert not held.exists()


def test_only_old_folders_with_the_lock_of_a_process_are_removed(folder, monkeypatch):
    (folder / "internav-process-of-a-user").mkdir()
    (folder / "internav-process-of-a-user" / "thesis.tex").touch()
    (folder / "internav-process-link").symlink_to(folder / "internav-process-of-a-user")
    fresh = folder / "internav-process-fresh"
    fresh.mkdir()
    (fresh / "process.lock").touch()
    monkeypatch.setattr(temporary, "_SETTLED_S", 60.0)
    temporary.sweep_folders()
    assert len(list(folder.iterdir())) == 3
    hour_ago = time.time() - 3600
    os.utime(fresh / "process.lock", (hour_ago, hour_ago))
    temporary.sweep_folders()
    assert not fresh.exists()
    assert (folder / "internav-process-of-a-user" / "thesis.tex").exists()
