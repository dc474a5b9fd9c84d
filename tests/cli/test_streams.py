"""Streams that are closed, full or of a narrow encoding: the right exit code and no traceback."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
STATS = f"{Path(sys.executable).parent}/internav-gen stats {ROOT}/tests/data/dataset-10"
REFUSED = f"{Path(sys.executable).parent}/camp-eval --compare /nowhere"


def shell(line, **options):
    done = subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, timeout=120, check=False, **options
    )
    assert "Traceback" not in done.stderr
    assert "this is a bug" not in done.stderr
    return done


@pytest.mark.parametrize("streams", [">&-", "2>&-", "2>/dev/full", "<&- >&- 2>&-"])
def test_streams_that_take_nothing_change_no_exit_code(streams):
    assert shell(f"{STATS} {streams}").returncode == 0
    assert shell(f"{REFUSED} {streams}").returncode == 2


def test_a_full_device_is_named_in_a_line():
    done = shell(f"{STATS} > /dev/full")
    assert done.returncode == 1
    errors = [line for line in done.stderr.splitlines() if not line.startswith("dataset: ")]
    assert errors == ["internav-gen: No space left on device"]


def test_a_working_directory_that_is_gone_is_no_bug(tmp_path):
    (tmp_path / "gone").mkdir()
    done = shell(f"rmdir {tmp_path}/gone; {STATS}", cwd=tmp_path / "gone")
    assert done.returncode == 0


@pytest.mark.parametrize(
    ("encoding", "printed"), [("latin-1", "latin-1"), ("cp1251", "cp1251"), ("ascii", "utf-8")]
)
def test_a_narrow_encoding_prints_question_marks(encoding, printed):
    """But for ASCII: click takes it for a mistake, and writes UTF-8."""
    command = f"{STATS.partition(' ')[0]} generate --print-config"
    whole = shell(f"PYTHONIOENCODING=utf-8 {command}", encoding="utf-8").stdout
    assert not whole.isascii()
    done = shell(f"PYTHONIOENCODING={encoding} {command}", encoding=printed)
    assert done.returncode == 0
    assert done.stdout == whole.encode(printed, errors="replace").decode(printed)


def test_without_docstrings_schemas_and_settings_are_the_same(tmp_path):
    command = f"{sys.executable} -OO {STATS.partition(' ')[0]}"
    assert shell(f"{command} schema --out {tmp_path}/schemas").returncode == 0
    for path in (ROOT / "schemas").iterdir():
        assert (tmp_path / "schemas" / path.name).read_bytes() == path.read_bytes()
    usual = shell(f"{STATS.partition(' ')[0]} generate --print-config")
    assert shell(f"{command} generate --print-config").stdout == usual.stdout != ""
