"""Sphinx configuration of the documentation's site: `make docs`.

Pages are those of this folder, and those that `site_pages.py` writes into `reference/` from the
code before each build.
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import re
import sys
import typing
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).parent))

import site_pages

from internav_data import __version__

if TYPE_CHECKING:
    import click
    from sphinx.application import Sphinx

project = "internav-data"
author = "The internav authors"
project_copyright = author
release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_click",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["study/*.json"]
html_theme = "furo"
html_title = f"internav-data {release}"
html_static_path: list[str] = []
html_copy_source = False
html_show_sphinx = False
highlight_language = "none"  # of blocks that name none: examples of commands
smartquotes = False  # options begin with two hyphens

default_role = "code"  # docstrings write `names` as Markdown does
myst_enable_extensions = ["colon_fence"]
myst_heading_anchors = 3
napoleon_numpy_docstring = True
napoleon_google_docstring = False
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
add_module_names = False
suppress_warnings = [
    "myst.header",  # tables of the study are parts of a page on GitHub, pages here
    "ref.python",  # words of numpy's style that are names of several fields
]


def written(app: Sphinx) -> None:
    """Write the generated pages."""
    site_pages.write(Path(app.srcdir))


def leads_into_the_site(_app: Sphinx, _name: str, text: list[str]) -> None:
    """Turn links that lead out of this folder on GitHub into links to pages of the site."""
    for link, page in site_pages.LINKS.items():
        text[0] = text[0].replace(f"]({link})", f"]({page})")


def parts_of_the_study(_app: Sphinx, name: str, text: list[str]) -> None:
    """Give tables that belong to the study a title, and no place in the contents."""
    if name.startswith("study/"):
        text[0] = f"---\norphan: true\n---\n\n# The study: {name.rpartition('/')[2]}\n\n{text[0]}"


def as_written(_app: Sphinx, context: click.Context, lines: list[str]) -> None:
    """Show the examples below a command's help with their own spaces and hyphens."""
    text = inspect.cleandoc(context.command.epilog or "").replace("\b\n", "")
    lines[:] = ["::", "", *(f"   {line}".rstrip() for line in text.splitlines()), ""]


def options_as_typed(_app: Sphinx, _context: click.Context, lines: list[str]) -> None:
    """Name an option's value by the option, not by the parameter of our function."""
    for number, line in enumerate(lines):
        named = re.sub(r"^(\.\. option:: --([a-z-]+)) <[a-z_]+>$", r"\1 <\2>", line)
        lines[number] = re.sub(r":default: ``'(.*)'``", r":default: ``\1``", named)


def attribute_as_written(
    _app: Sphinx, what: str, _name: str, _value: object, _options: object, lines: list[str]
) -> None:
    """Undo numpy style's reading of "Noun: words." below an attribute as its type and text."""
    kind = next((k for k, line in enumerate(lines) if line.startswith(":type: ")), None)
    if what in {"attribute", "property"} and kind is not None:
        lines[0] = f"{lines[kind].removeprefix(':type: ')}: {lines[0]}"
        del lines[kind]


def without_bounds(_app: Sphinx) -> None:
    """Leave the bounds out of the settings' types, as Sphinx would print them field by field."""
    for module in map(importlib.import_module, site_pages.MODULES):
        for value in (getattr(module, name) for name in module.__all__):
            if dataclasses.is_dataclass(value) and "Annotated[" in str(value.__annotations__):
                types = typing.get_type_hints(value)
                value.__annotations__ = types
                value.__init__.__annotations__ = types | {"return": None}


def setup(app: Sphinx) -> None:
    """Connect what happens before a build and when a page is read."""
    app.connect("builder-inited", written)
    app.connect("builder-inited", without_bounds)
    app.connect("autodoc-process-docstring", attribute_as_written)
    app.connect("sphinx-click-process-options", options_as_typed)
    app.connect("source-read", leads_into_the_site)
    app.connect("source-read", parts_of_the_study)
    app.connect("sphinx-click-process-epilog", as_written)
