"""Count Python source: lines of code, comments, functions and the room of a file.

Shared by `check_language.py` and `size.py`. A line of code holds at least one token that is neither
a comment nor a docstring; blank lines do not count.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

ROOT = Path(__file__).resolve().parents[1]
"""Root of the repository."""
PACKAGE = "internav_data"
"""Name of the package's folder."""
FOLDERS = ("cli", "tests", "benchmarks", "docs", "examples")
"""Folders beside the package; each counts as one room."""

Function = ast.FunctionDef | ast.AsyncFunctionDef

_PRAGMA = re.compile(r"#\s*(?:noqa|type:|pragma|fmt:|pylint|!)", re.IGNORECASE)
# Tokens without text of their own: a line with nothing else is blank or a comment.
_EMPTY_TOKENS = frozenset(
    {
        tokenize.COMMENT,
        tokenize.NL,
        tokenize.NEWLINE,
        tokenize.INDENT,
        tokenize.DEDENT,
        tokenize.ENCODING,
        tokenize.ENDMARKER,
    }
)


def python_files(paths: Iterable[Path]) -> list[Path]:
    """Return the Python files among `paths` and in the folders among them, sorted.

    Raises
    ------
    FileNotFoundError
        A path does not exist.
    """
    files: set[Path] = set()
    for path in paths:
        if not path.exists():
            raise FileNotFoundError(f"{path}: no such file or folder")
        files.update(path.rglob("*.py") if path.is_dir() else [path])
    return sorted(files)


def room_of(path: Path) -> str:
    """Return the first folder below `internav_data`, or the folder beside it that holds `path`.

    Modules directly in the package belong to the room `internav_data`.
    """
    resolved = path.resolve()
    inside = resolved.is_relative_to(ROOT)
    parts = (resolved.relative_to(ROOT) if inside else resolved).parts[:-1]
    if PACKAGE in parts:
        below = parts[len(parts) - parts[::-1].index(PACKAGE) :]
        return below[0] if below else PACKAGE
    # The outermost one: `tests/cli` belongs to the tests.
    return next((part for part in parts if part in FOLDERS), parts[-1] if parts else ".")


def docstring_nodes(tree: ast.AST) -> Iterator[ast.Constant]:
    """Yield the strings that stand as statements: docstrings, including those of attributes."""
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            yield node.value


def code_lines(source: str, tree: ast.AST) -> frozenset[int]:
    """Return the numbers of the lines that hold code, counted from 1."""
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type not in _EMPTY_TOKENS:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in docstring_nodes(tree):
        lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return frozenset(lines)


def comment_count(source: str) -> int:
    """Return the number of comments, without directives to tools (`noqa`, `type:`, `fmt:`)."""
    return sum(
        token.type == tokenize.COMMENT and not _PRAGMA.match(token.string)
        for token in tokenize.generate_tokens(io.StringIO(source).readline)
    )


def function_lengths(tree: ast.AST, lines: frozenset[int]) -> list[tuple[Function, int]]:
    """Return every function, nested ones included, and its lines of code.

    Parameters
    ----------
    tree
        Syntax tree of the module.
    lines
        Lines of code of the module, from `code_lines`.
    """
    return [
        (node, len(lines.intersection(range(node.lineno, (node.end_lineno or node.lineno) + 1))))
        for node in ast.walk(tree)
        if isinstance(node, Function)
    ]
