"""Folder of the dataset that commands and `load_dataset` take when none is named."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

DEFAULT_FOLDER = "internav-dataset"
"""Default folder, in the current directory."""
FOLDER_VARIABLE = "INTERNAV_DATASET"
"""Environment variable that names another default folder; empty counts as unset."""


def dataset_folder(given: str | Path | None = None) -> Path:
    """Return the folder that was named, else the default one; it need not exist."""
    if given is not None:
        return Path(given)
    return Path(os.environ.get(FOLDER_VARIABLE) or DEFAULT_FOLDER)


def origin(given: str | Path | None) -> str:
    """Return the reason for which `dataset_folder` took its folder; empty if it was named."""
    if given is not None:
        return ""
    if os.environ.get(FOLDER_VARIABLE):
        return f"named by {FOLDER_VARIABLE}"
    return f"the default; {FOLDER_VARIABLE} names another"


def making_command(folder: Path) -> str:
    """Return the command line that makes a small dataset in a folder."""
    out = "" if folder == dataset_folder() else f" --out {shlex.quote(str(folder))}"
    return f"internav-gen generate --scenes 120{out}"
