"""Pictures and pages of records for notebooks, drawn by functions that rooms above register.

Records import nothing, so they cannot draw themselves: `_repr_png_` and `_repr_html_` ask here.
`internav_data.views` registers its functions when it is imported, and the package's root imports it
with the first public name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

_PAINTERS: dict[tuple[str, str], Callable[[Any], Any]] = {}


def register_display(name: str, form: str, paint: Callable[[Any], Any]) -> None:
    """Register the function that shows records of a class.

    Parameters
    ----------
    name
        Name of the class.
    form
        `png`, of which the function returns bytes, or `html`, of which it returns text.
    paint
        Function of a record. It raises ModuleNotFoundError where it lacks a package: then the
        record is shown by its `repr`.
    """
    _PAINTERS[name, form] = paint


def displayed(record: object, form: str) -> Any:  # noqa: ANN401 - bytes or text by form
    """Return a record as `png` bytes or `html` text; None where nothing can draw it."""
    paint = _PAINTERS.get((type(record).__name__, form))
    if paint is None:
        return None
    try:
        return paint(record)
    except ModuleNotFoundError:
        return None
