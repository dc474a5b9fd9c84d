"""Lazy imports: names of a package whose modules are imported when a name is first used.

Needs the standard library alone, so that the package's root can use it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from internav_data.core.extras import EXTRAS, missing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping


def lazy_imports(
    package: str, names: Mapping[str, Iterable[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the functions `__getattr__` and `__dir__` of a package (PEP 562).

    A name must differ from the package's modules: once a module is imported, it hides a lazy name
    that is spelt like it.

    Parameters
    ----------
    package
        Package that offers the names, its `__name__`.
    names
        Names by the module that defines them, relative to the package: `{"run": ["generate"]}`.

    Raises
    ------
    ModuleNotFoundError
        By `__getattr__`: a package is missing; of an extra's, the message names the extra.

    Examples
    --------
    >>> getattr_, dir_ = lazy_imports("xml", {"dom.minidom": ["parseString"]})
    >>> getattr_("parseString").__module__
    'xml.dom.minidom'

    """
    homes = {name: module for module, listed in names.items() for name in listed}

    def __getattr__(name: str) -> Any:  # noqa: ANN401, N807 - the package's own method
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        try:
            return getattr(import_module(f"{package}.{homes[name]}"), name)
        except ModuleNotFoundError as error:
            if error.name in EXTRAS:
                raise missing(error.name) from error
            raise

    def __dir__() -> list[str]:  # noqa: N807 - the package's own method
        return sorted({*vars(import_module(package)), *homes})

    return __getattr__, __dir__
