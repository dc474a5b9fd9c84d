"""Systems that lack what POSIX has: each use has another way, or one line that says so."""

import fcntl
import os
import platform
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import worker_stubs

from internav_data.core import machine, processes, storage, worker_pool
from internav_data.core.holders import lock_holder
from internav_data.core.machine import available_cores, memory_gib, user_id
from internav_data.core.messages import Failed, Recipe
from internav_data.core.storage import FolderStore, LockedError, sync, write_atomically
from internav_data.core.temporary import sweep_folders
from internav_data.core.worker_pool import WorkerPool
from internav_data.records.errors import UsageError

NO_POSIX = """
import os, signal, sys
import ctypes, mmap, multiprocessing.connection, socket, sqlite3, subprocess, tempfile, uuid
import click
from types import SimpleNamespace
for module, names in (
    (os, "sched_getaffinity geteuid getuid sysconf major minor register_at_fork memfd_create "
         "O_NOFOLLOW O_NONBLOCK O_NOCTTY fork setsid killpg"),
    (signal, "SIGHUP SIGKILL pthread_sigmask SIG_BLOCK SIG_UNBLOCK SIG_SETMASK"),
):
    for name in names.split():
        if hasattr(module, name):
            delattr(module, name)
os.process_cpu_count = os.cpu_count  # which asks sched_getaffinity where that was
sys.modules["fcntl"] = sys.modules["resource"] = None
sys.modules["msvcrt"] = SimpleNamespace(locking=lambda *_: None, LK_NBLCK=2)
real = os.open
def opened(path, *given, **named):
    if os.path.isdir(path):
        raise PermissionError(13, "Permission denied", str(path))
    return real(path, *given, **named)
os.open = opened
from internav_data.core import machine
machine.WINDOWS = True
from internav_cli.main import main
main()
"""
"""Commands on a system that lacks what Windows lacks."""
HEAVY = "import cv2, numba, platformdirs, pyarrow.parquet, scipy.spatial"
"""Packages that ask for POSIX where they are imported, as this is no Windows after all."""


@pytest.fixture
def windows(monkeypatch, tmp_path):
    """A system without POSIX's locks, folders that can be opened, and pipes to children."""
    held = {}

    def locking(descriptor, mode, size):
        assert (mode, size) == (2, 1)
        place = os.fstat(descriptor).st_ino
        if held.get(place, descriptor) != descriptor:
            raise PermissionError(13, "Permission denied")
        held[place] = descriptor

    real = os.open

    def opened(path, flags, *mode):
        if Path(path).is_dir():
            raise PermissionError(13, "Permission denied", str(path))
        return real(path, flags, *mode)

    for module in (processes, storage, worker_pool):
        monkeypatch.setattr(module, "WINDOWS", True)
    monkeypatch.setattr(os, "open", opened)
    monkeypatch.setitem(sys.modules, "msvcrt", SimpleNamespace(locking=locking, LK_NBLCK=2))
    monkeypatch.setitem(sys.modules, "fcntl", None)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return held


def test_a_folder_is_locked_by_a_file_that_stands_for_it(windows, tmp_path, monkeypatch):
    monkeypatch.setattr(storage, "_ENDING_S", 0.0)
    one, other = FolderStore(tmp_path / "one"), FolderStore(tmp_path / "other")
    with one.lock("busy"), other.lock("busy"):
        assert list(one.root.iterdir()) == []
        # By whatever name: a path with a link in it is the same folder.
        (tmp_path / "link").symlink_to(one.root)
        with pytest.raises(LockedError, match="busy"), FolderStore(tmp_path / "link").lock("busy"):
            pass
    windows.clear()
    with one.lock("busy"):
        pass


def test_files_are_written_and_synced_where_no_folder_can_be(windows, tmp_path):
    write_atomically(tmp_path / "file", b"bytes")
    sync(tmp_path)
    assert (tmp_path / "file").read_bytes() == b"bytes"


def test_a_pool_works_in_this_process(windows, tmp_path):
    with WorkerPool(2, Recipe(worker_stubs.square, 1)) as pool:
        assert [(r.task, r.value) for r in pool.run(range(3))] == [(0, 1), (1, 2), (2, 5)]
        assert pool.processes == ()
        assert [r.value for r in pool.run(iter(range(9)), lambda: False)] == []
    with pytest.raises(UsageError, match=r"duck\.obj is no mesh"):
        list(WorkerPool(2, Recipe(worker_stubs.refusing, "duck.obj")).run([1]))
    (failed,) = WorkerPool(2, Recipe(worker_stubs.troubled, str(tmp_path))).run([7])
    assert isinstance(failed, Failed)


def test_a_process_of_its_own_is_refused_in_a_line(windows):
    with pytest.raises(UsageError, match="Windows: ask for one worker, or use WSL"):
        processes.Child(worker_stubs.square)


def test_what_a_system_does_not_tell_is_done_without(monkeypatch, tmp_path):
    for name in ("sched_getaffinity", "sysconf", "geteuid", "major"):
        monkeypatch.delattr(os, name)
    assert available_cores() == os.cpu_count()
    assert memory_gib() is None
    assert user_id() == 0
    sweep_folders()
    with (tmp_path / "file").open("wb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert lock_holder(file.fileno()) == ""


def command(folder, *words, code=NO_POSIX):
    return subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False,
        cwd=folder,
    )  # fmt: skip


@pytest.mark.parametrize(("words", "code"), [(["--help"], 0), (["schema"], 0), (["stats"], 5)])
def test_commands_run_without_what_posix_alone_has(tmp_path, words, code):
    done = command(tmp_path, *words)
    assert done.returncode == code, done.stderr
    assert len(done.stderr.splitlines()) <= 2, done.stderr


@pytest.mark.slow
def test_a_dataset_has_the_bytes_that_it_has_elsewhere(tmp_path):
    words = ["generate", "--scenes", "2", "--episodes-per-scene", "2", "--rooms", "1", "--out"]
    here = [sys.executable, "-c", "from internav_cli.main import main; main()", *words, "here"]
    subprocess.run(here, cwd=tmp_path, check=True, capture_output=True)
    code = HEAVY + NO_POSIX
    there = command(tmp_path, *words, "there", code=code)
    assert there.returncode == 0, there.stderr
    names = [{p.relative_to(f): p.read_bytes() for p in f.rglob("*") if p.is_file()}
             for f in (tmp_path / "here", tmp_path / "there")]  # fmt: skip
    assert names[0] == names[1]
    for name in ("validate", "stats"):
        said = command(tmp_path, name, "there", code=code)
        assert said.returncode == 0, said.stderr


FREED = """
import sys
import psutil
from internav_data.core.machine import keep_freed_memory
print(keep_freed_memory() if sys.argv[1] == "keep" else "")
before = psutil.Process().memory_info().rss
blocks = [b"x" * (4 << 20) for _ in range(16)]
del blocks
print(psutil.Process().memory_info().rss - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="a setting of glibc")
def test_memory_that_is_freed_can_be_kept_for_its_next_use():
    def ran(word):
        words = [sys.executable, "-c", FREED, word]
        return subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()

    done, kept = ran("keep")
    (given_back,) = ran("give back")
    assert done == "True"
    assert int(kept) > 60 << 20
    assert int(given_back) < 20 << 20


def test_signals_that_end_a_command_are_those_that_there_are():
    assert machine.END_SIGNALS == (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
