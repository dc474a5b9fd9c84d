"""Docstrings of the fields of dataclasses, read from their source."""

from __future__ import annotations

import ast
import inspect
from itertools import pairwise
from typing import Any


def descriptions(cls: type[Any]) -> dict[str, str]:
    """Return the docstrings below a dataclass's fields, by name; none where there is no source."""
    try:
        tree = ast.parse(inspect.cleandoc(inspect.getsource(cls)))
    except (OSError, TypeError):
        return {}
    notes = {}
    body = tree.body[0].body if isinstance(tree.body[0], ast.ClassDef) else []
    for field, after in pairwise(body):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(after, ast.Expr)
            and isinstance(after.value, ast.Constant)
        ):
            notes[field.target.id] = inspect.cleandoc(str(after.value.value))
    return notes
