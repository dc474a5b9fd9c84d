"""Text in Markdown: names that users chose stay text, whatever characters they hold."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Sequence

_SPECIAL: Final = re.compile(r"([\\`|<\[\]])")
"""Characters that end a cell, or begin code, HTML or a link."""


def escaped(text: str) -> str:
    """Return text of one line in which no character is Markdown's, HTML's or a terminal's."""
    line = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    return _SPECIAL.sub(r"\\\1", line)


def table_row(cells: Sequence[str]) -> str:
    """Return a row of a table; the cells are text, which is escaped."""
    return "| " + " | ".join(map(escaped, cells)) + " |"
