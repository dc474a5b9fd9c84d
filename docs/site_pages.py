"""Pages of the documentation's site that are made of the code: API, commands, format, project.

`docs/conf.py` writes them into `docs/reference/` before each build; git ignores that folder.
"""

from __future__ import annotations

import importlib
import inspect
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

ROOT = Path(__file__).resolve().parents[1]
FOLDER = "reference"
"""Folder of the generated pages, below docs/."""
LINKS = {"../schemas": "/reference/format.md"}
"""Links out of docs/ that lead to a generated page instead."""
MODULES = {
    "internav_data": "What most programs need; importing it imports nothing else.",
    "internav_data.dataset": "Tables, files, manifest, loader and streams of datasets.",
    "internav_data.records": "Frozen dataclasses that all rooms share, and random streams.",
    "internav_data.generation": "Datasets, houses and episodes from a seed.",
    "internav_data.verification": "The independent validator.",
    "internav_data.world": "A house that is being acted in.",
    "internav_data.physics": "Settling and pushing as pure functions, and their engines.",
    "internav_data.envs": "Gymnasium environments.",
    "internav_data.views": "Pictures, replays and videos.",
    "internav_data.evaluation": "Metrics, reference policies and tables.",
    "internav_data.camp": "CaMP and its baselines.",
    "internav_data.viewer": "The page of a dataset.",
    "internav_data.interop": "Other programs' places and formats.",
}
"""Modules with public imports, and what each is; a name is documented where it comes first."""
PROGRAMS = {
    "internav-data": "internav_cli.data:cli",
    "internav-gen": "internav_cli.main:cli",
    "camp-train": "internav_cli.camp_train:command",
    "camp-eval": "internav_cli.camp_eval:cli",
}
"""Programs and their click commands."""
PROJECT = {
    "ARCHITECTURE.md": "architecture.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
}
"""Pages of the repository's root, and their names on the site."""


def write(docs: Path) -> None:
    """Write all generated pages below a folder of pages; what has not changed keeps its time."""
    folder = docs / FOLDER
    folder.mkdir(exist_ok=True)
    for name, text in pages().items():
        path = folder / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def pages() -> dict[str, str]:
    """Return the generated pages by file name."""
    texts = {"api.md": api(), "commands.md": commands(), "format.md": schemas()}
    for source, name in PROJECT.items():
        texts[name] = _moved((ROOT / source).read_text(encoding="utf-8"))
    return texts


def api() -> str:
    """Return the page of the public imports, each by autodoc at its first place."""
    parts = ["# Python API", "Public imports, each where it is to be imported from."]
    seen: dict[int, str] = {}
    for module, words in MODULES.items():
        parts += [f"## {module}", words]
        parts += _members(module, seen)
    return "\n\n".join(parts) + "\n"


def _members(name: str, seen: dict[int, str]) -> Iterator[str]:
    module = importlib.import_module(name)
    again = []
    for member in sorted(module.__all__, key=lambda each: (each.isupper(), each.lower())):
        value = getattr(module, member)
        if not (inspect.isclass(value) or inspect.isfunction(value)):
            continue  # numbers, tables and aliases of types
        if id(value) in seen:
            again.append(f"`{member}` ({seen[id(value)]})")
            continue
        seen[id(value)] = name
        yield _directive(name, member, value)
    if again:
        yield f"Documented above: {', '.join(again)}."


def _directive(module: str, name: str, value: Any) -> str:  # noqa: ANN401 - any public name
    kind, options = "autofunction", ""
    if inspect.isclass(value):
        kind, options = "autoclass", "   :members:\n"
    return f"```{{eval-rst}}\n.. {kind}:: {module}.{name}\n{options}```"


def commands() -> str:
    """Return the page of the programs, by sphinx-click."""
    parts = ["# Commands", "Every program has `--help`; these pages are made of the same texts."]
    for program, place in PROGRAMS.items():
        parts.append(
            f"```{{eval-rst}}\n.. click:: {place}\n   :prog: {program}\n   :nested: full\n```"
        )
    return "\n\n".join(parts) + "\n"


def schemas() -> str:
    """Return the page of all columns and keys, from the JSON Schemas."""
    words = (
        "Every column of the tables and every key of the files, from the JSON Schemas that "
        "`internav-gen schema` prints. [The format](../dataset.md) defines the terms."
    )
    parts = ["# Columns and keys", words]
    for name in ("episodes", "scenes", "assets", "manifest", "stats"):
        schema = json.loads((ROOT / "schemas" / f"{name}.schema.json").read_text())
        rows = ["| name | type | |", "|---|---|---|"]
        rows += [f"| `{path}` | {kind} | {words} |" for path, kind, words in _keys(schema)]
        first = schema.get("description", "").split("\n\n")[0]
        parts += [f"## {name}", " ".join(first.split()), "\n".join(rows)]
    return "\n\n".join(parts) + "\n"


def _keys(schema: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str, str]]:
    """Yield path, type and description of each key, depth first."""
    for name, value in schema.get("properties", {}).items():
        kind, inner = _kind(value)
        words = " ".join(str(value.get("description", "")).split()).replace("|", "\\|")
        yield f"{prefix}{name}", kind, words
        if inner is not None:
            yield from _keys(inner, f"{prefix}{name}.")


def _kind(value: Mapping[str, Any]) -> tuple[str, Mapping[str, Any] | None]:
    """Return a schema's type in words, and the schema of its members if it has any."""
    if "anyOf" in value:
        kinds = [_kind(each) for each in value["anyOf"]]
        inner = next((schema for _, schema in kinds if schema is not None), None)
        return " or ".join(kind for kind, _ in kinds), inner
    if "enum" in value:
        return " or ".join("null" if each is None else str(each) for each in value["enum"]), None
    kind = value.get("type", "any")
    if isinstance(kind, list):
        kind = " or ".join(kind)
    if "array" in kind:
        item, inner = _kind(value.get("items", {}))
        return kind.replace("array", f"list of {item}"), inner
    return kind, value if "properties" in value else None


def _moved(text: str) -> str:
    """Return a page of the root for the folder of the generated ones: its links lead elsewhere."""
    text = text.replace("](docs/", "](../")
    for source, name in PROJECT.items():
        text = text.replace(f"]({source}", f"]({name}")
    return text
