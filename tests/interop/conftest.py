"""A copy of the dataset that ships, to be spoilt."""

from __future__ import annotations

import shutil

import pytest

from internav_data.dataset.location import MINI_FOLDER


@pytest.fixture
def shipped(tmp_path):
    return shutil.copytree(MINI_FOLDER, tmp_path / "shipped")
