"""Lets the tests of this folder import their hand-made houses."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(autouse=True)
def _no_waiting_for_the_disk(monkeypatch):
    """A hundred small datasets are written; none of them has to survive a power cut."""
    monkeypatch.setattr("os.fsync", lambda _: None)
    monkeypatch.setattr("internav_data.dataset.metadata_files.metadata_blobs", lambda *_: {})
