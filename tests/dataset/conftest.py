"""A small look-alike dataset, written once, copied by tests that damage it."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

_ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(_ROOT / "tests"), str(_ROOT / "benchmarks")]


@pytest.fixture(scope="session")
def dataset_folder(tmp_path_factory):
    """130 scenes of 6 episodes: several row groups, all three splits."""
    from synthetic import write_synthetic

    folder = tmp_path_factory.mktemp("dataset") / "small"
    write_synthetic(folder, 130, 6, full=True)
    return folder


@pytest.fixture
def damaged_folder(dataset_folder, tmp_path):
    """A copy that a test may spoil."""
    return shutil.copytree(dataset_folder, tmp_path / "copy")
