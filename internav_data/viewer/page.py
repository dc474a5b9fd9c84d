"""The HTML of the page, from `static/`: as the server sends it, or with all that it needs inside.

Modules import each other by bare names (`viewer/map`), which the page's import map resolves: to the
server's addresses, or to the modules' own text where the page is a file. So nothing is bundled.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
from functools import cache
from typing import TYPE_CHECKING, Final

from internav_data.viewer.routes import MODULES, static_text
from internav_data.views.curves import COLOURS as SERIES
from internav_data.views.episodes import FIXED, GOAL, PICKABLE, PUSHABLE, START
from internav_data.views.plan import INK, PAPER

if TYPE_CHECKING:
    from collections.abc import Mapping

    from internav_data.records import RGB

_AGENT: Final[RGB] = (196, 36, 112)
_PATH: Final[RGB] = (150, 70, 150)
_GHOST: Final[RGB] = (120, 84, 10)
_PALETTE: Final[Mapping[str, RGB]] = {
    "paper": PAPER,
    "ink": INK,
    "start": START,
    "goal": GOAL,
    "push": PUSHABLE,
    "pick": PICKABLE,
    "fixed": FIXED,
    "agent": _AGENT,
    "path": _PATH,
    "ghost": _GHOST,
}
"""Colours of the page that are those of the pictures."""


def style_text() -> str:
    """Return the style sheet, with the colours of the pictures as its variables."""
    names = {name: "#{:02x}{:02x}{:02x}".format(*rgb) for name, rgb in _PALETTE.items()}
    names |= {f"series-{k}": colour for k, colour in enumerate(SERIES, 1)}
    variables = "".join(f"--{name}:{colour};" for name, colour in names.items())
    return f":root{{{variables}}}\n{static_text('style.css')}"


def _page(imports: Mapping[str, str], embedded: str = "", title: str = "internav-data") -> str:
    return (
        static_text("index.html")
        .replace("<!--style-->", f"<style>{style_text()}</style>")
        .replace("<!--title-->", html.escape(title))
        .replace(
            "<!--importmap-->",
            f'<script type="importmap">{json.dumps({"imports": imports})}</script>',
        )
        .replace("<!--embedded-->", embedded)
    )


@cache
def served_page() -> tuple[str, str]:
    """Return the server's page and its content security policy.

    The policy lets scripts of this server run and two in the page, by their digests: the import map
    and the one that starts the page.
    """
    page = _page({f"viewer/{name}": f"/static/{name}.js" for name in MODULES})
    scripts = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
        for text in _inline_scripts(page)
    )
    policy = (
        f"default-src 'none'; script-src 'self' {scripts}; style-src 'unsafe-inline'; "
        "img-src 'self' data:; connect-src 'self'; frame-src 'self'; base-uri 'none'; "
        "form-action 'none'; frame-ancestors 'none'"
    )
    return page, policy


def _inline_scripts(page: str) -> list[str]:
    parts = page.split("<script")[1:]
    return [part.split(">", 1)[1].split("</script>", 1)[0] for part in parts]


def page_with(answers: Mapping[str, str], title: str) -> str:
    """Return the page as one file.

    Parameters
    ----------
    answers
        Answers by the address of their request: JSON, or a data URL of a picture.
    title
        Title of the page.
    """
    imports = {f"viewer/{name}": _data_url(static_text(f"{name}.js")) for name in MODULES}
    # "</" would end the script, and "<!--" begin a comment in it.
    text = json.dumps(answers, ensure_ascii=False).replace("<", "\\u003c")
    embedded = f'<script type="application/json" id="embedded">{text}</script>'
    return _page(imports, embedded, title)


def _data_url(module: str) -> str:
    return f"data:text/javascript;base64,{base64.b64encode(module.encode()).decode()}"
