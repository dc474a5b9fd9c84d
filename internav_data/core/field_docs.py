"""Docstrings of the fields of dataclasses, read from their source."""

from __future__ import annotations

import ast
import inspect
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping


_KNOWN: dict[type[Any], tuple[str, Mapping[str, str]]] = {}
"""What was read of each class: parsing a source takes 10 ms, and a commit asks 60 times."""


def descriptions(cls: type[Any]) -> Mapping[str, str]:
    """Return the docstrings below a dataclass's fields, by name; none where there is no source."""
    return _read(cls)[1]


def class_description(cls: type[Any]) -> str:
    """Return a class's docstring, under `python -OO` too; empty where there is no source."""
    return _read(cls)[0]


def _read(cls: type[Any]) -> tuple[str, Mapping[str, str]]:
    if cls not in _KNOWN:
        found = _definition(cls)
        text = "" if found is None else ast.get_docstring(found) or ""
        _KNOWN[cls] = text, MappingProxyType(_notes([] if found is None else found.body))
    return _KNOWN[cls]


def _definition(cls: type[Any]) -> ast.ClassDef | None:
    try:
        source = inspect.cleandoc(inspect.getsource(cls))
    except (OSError, TypeError):
        return None
    # `ast.parse` drops docstrings under `python -OO` since Python 3.14.
    tree = compile(source, cls.__name__, "exec", ast.PyCF_ONLY_AST, optimize=0)
    first = tree.body[0] if isinstance(tree, ast.Module) else None
    return first if isinstance(first, ast.ClassDef) else None


def _notes(body: list[ast.stmt]) -> dict[str, str]:
    notes = {}
    for field, after in pairwise(body):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(after, ast.Expr)
            and isinstance(after.value, ast.Constant)
        ):
            notes[field.target.id] = inspect.cleandoc(str(after.value.value))
    return notes
