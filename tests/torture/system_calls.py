"""System calls of a command that change files below a folder, as strace sees them.

What `FaultPoints` counts is compared with them: a call that Python's hooks miss would never fail
in the campaign.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

_KINDS = {
    "open": "open", "openat": "open", "creat": "open",
    "rename": "rename", "renameat": "rename", "renameat2": "rename",
    "unlink": "unlink", "unlinkat": "unlink", "rmdir": "rmdir",
    "mkdir": "mkdir", "mkdirat": "mkdir",
    "link": "link", "linkat": "link", "symlink": "symlink", "symlinkat": "symlink",
    "truncate": "truncate", "ftruncate": "truncate", "chmod": "chmod", "fchmodat": "chmod",
    "fsync": "fsync", "fdatasync": "fsync",
    "write": "write", "writev": "write", "pwrite64": "write", "pwritev": "write",
    "sendfile": "write", "copy_file_range": "write", "fallocate": "write", "msync": "write",
}  # fmt: skip
_CALL = re.compile(r"^(?:\d+ +)?(\w+)\((.*)$")
_CHANGES = re.compile(r"O_WRONLY|O_RDWR|O_CREAT|O_TRUNC")


def strace() -> str | None:
    """Return the path of strace; None where there is none."""
    return shutil.which("strace")


def system_calls(script: str, folder: Path) -> list[tuple[str, str]]:
    """Run Python code; return kind and path below a folder of each call that changes one there."""
    log = folder.with_name(f"{folder.name}.strace")
    command = [
        *(str(strace()), "-f", "-y", "-s", "0", "-e", f"trace={','.join(_KINDS)}"),
        *("-o", str(log), sys.executable, "-c", script),
    ]
    subprocess.run(command, check=True, env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"})
    root = f"{os.path.realpath(folder)}/"
    found = []
    for line in log.read_text().splitlines():
        call = _CALL.match(line)
        path = _path(call[1], call[2], root) if call else None
        if path is not None:
            found.append((_KINDS[call[1]], path))
    log.unlink()
    return found


def _path(name: str, rest: str, root: str) -> str | None:
    """Return the path below a folder that a call changes; None if it changes nothing there."""
    if _KINDS[name] == "open" and not _CHANGES.search(rest):
        return None
    if _KINDS[name] in {"write", "fsync"} or name == "ftruncate":
        found = re.match(r"\d+<([^>]*)>", rest)
    else:
        found = re.search(r'"([^"]*)"', rest)
    path = found[1] if found else ""
    return path.removeprefix(root) if path.startswith(root) else None
