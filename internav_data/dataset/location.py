"""Folders of datasets by name: the default one, and the small one that ships with the package."""

from __future__ import annotations

import os
import shlex
from pathlib import Path

DEFAULT_FOLDER = "internav-dataset"
"""Default folder, in the current directory."""
FOLDER_VARIABLE = "INTERNAV_DATASET"
"""Environment variable that names another default folder; empty counts as unset."""
MINI = "mini"
"""Name of the dataset that ships with the package: 40 scenes, up to 10 episodes each."""
MINI_FOLDER = Path(__file__).with_name(MINI)
"""Folder of the dataset `MINI`; nothing writes there but `make mini`."""


def dataset_folder(given: str | Path | None = None) -> Path:
    """Return the folder that was named, else the default one; it need not exist."""
    if given is not None:
        return Path(given)
    return Path(os.environ.get(FOLDER_VARIABLE) or DEFAULT_FOLDER)


def folder_to_read(given: str | Path | None = None) -> Path:
    """Return the folder that a reader opens: `dataset_folder`, or `MINI_FOLDER` for `MINI`.

    A folder of one's own that is called `mini` comes first.
    """
    folder = dataset_folder(given)
    return MINI_FOLDER if str(folder) == MINI and not folder.exists() else folder


def origin(given: str | Path | None) -> str:
    """Return the reason for which a command took its folder; empty if it was named."""
    if given == MINI_FOLDER:
        return "ships with internav-data"
    if given is not None:
        return ""
    if os.environ.get(FOLDER_VARIABLE):
        return f"named by {FOLDER_VARIABLE}"
    return f"the default; {FOLDER_VARIABLE} names another"


def making_command(folder: Path) -> str:
    """Return the command line that makes a small dataset in a folder."""
    out = "" if folder == dataset_folder() else f" --out {shlex.quote(str(folder))}"
    return f"internav-gen generate --scenes 120{out}"
