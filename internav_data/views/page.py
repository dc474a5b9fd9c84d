"""HTML page in one file: it fetches nothing and runs no script."""

from __future__ import annotations

import base64
import html
from typing import TYPE_CHECKING, Final

import cv2

from internav_data.core.storage import write_atomically
from internav_data.records.errors import InternavError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from internav_data.core.typing import Image

_STYLE: Final = """
:root{color-scheme:light}
body{font:15px/1.5 system-ui,sans-serif;color:#28292f;background:#faf9f6;margin:0 auto;
padding:1.5rem;max-width:1180px}
h1{font-size:1.5rem;margin:0 0 .3rem}h2{font-size:1.15rem;margin:2rem 0 .6rem}
h3{font-size:1rem;margin:0 0 .4rem}p{margin:.3rem 0;max-width:75ch}
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:13px;white-space:nowrap}
th,td{padding:.25rem .55rem;text-align:right;border-bottom:1px solid #e3e0d8}
th:first-child,td:first-child{text-align:left;position:sticky;left:0;background:#faf9f6}
th{font-weight:600;color:#55565e}tr.first th{text-align:center;border-left:1px solid #e3e0d8}
tr.ours td{font-weight:600}tr.paper td{color:#84858c;font-style:italic}
.note{color:#66676e;font-size:13px}
.row{display:flex;flex-wrap:wrap;gap:1.2rem}figure{margin:0;max-width:360px}
figure img{width:100%;height:auto;border:1px solid #e3e0d8;border-radius:4px}
figcaption{font-size:12.5px;color:#55565e}
svg.curve{width:360px;height:auto;background:#fff;border:1px solid #e3e0d8;border-radius:4px;
font:11px system-ui,sans-serif;fill:#55565e}
svg .grid{stroke:#eceae4}svg .title{font-size:13px;font-weight:600;fill:#28292f}
svg .left,svg .name{text-anchor:end}svg .below{text-anchor:middle}
"""


class Page:
    """Page of headings, paragraphs, tables and pictures in order."""

    def __init__(self, title: str) -> None:
        self._title = html.escape(title)
        self._parts: list[str] = [f"<h1>{self._title}</h1>"]

    def heading(self, text: str) -> None:
        """Begin a section."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def words(self, text: str, *, note: bool = False) -> None:
        """Write a paragraph."""
        kind = ' class="note"' if note else ""
        self._parts.append(f"<p{kind}>{html.escape(text)}</p>")

    def table(
        self,
        groups: Sequence[tuple[str, int]],
        headings: Sequence[str],
        rows: Sequence[tuple[str, Sequence[str]]],
    ) -> None:
        """Write a table.

        Parameters
        ----------
        groups
            Headings, each with the number of columns it spans; the first column has none. May be
            empty.
        headings
            Headings of all columns.
        rows
            CSS class of each row (ours, reference, paper), and its cells.
        """
        text = ['<div class="wide"><table><thead>']
        if groups:
            spans = "".join(f'<th colspan="{n}">{html.escape(text)}</th>' for text, n in groups)
            text.append(f'<tr class="first"><th></th>{spans}</tr>')
        text.append(_cells("th", headings, ""))
        text.append("</thead><tbody>")
        text += [_cells("td", cells, kind) for kind, cells in rows]
        self._parts.append("".join([*text, "</tbody></table></div>"]))

    def curves(self, pictures: Sequence[str]) -> None:
        """Lay out SVG pictures (of `curves_svg`) side by side; empty ones are left out."""
        shown = "".join(picture for picture in pictures if picture)
        self._parts.append(f'<div class="row">{shown}</div>')

    def pictures(self, captioned: Sequence[tuple[Image, str]]) -> None:
        """Lay out pictures (h, w, 3) uint8 RGB side by side, a caption below each."""
        shown = "".join(
            f'<figure><img alt="{html.escape(text)}" src="data:image/png;base64,{_png(image)}">'
            f"<figcaption>{html.escape(text)}</figcaption></figure>"
            for image, text in captioned
        )
        self._parts.append(f'<div class="row">{shown}</div>')

    def text(self) -> str:
        """Return the HTML of the page."""
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width,initial-scale=1">'
            f"<title>{self._title}</title><style>{_STYLE}</style></head>\n<body>"
            + "\n".join(self._parts)
            + "\n</body></html>\n"
        )

    def write(self, path: Path) -> None:
        """Write the page atomically."""
        write_atomically(path, self.text().encode())


def _cells(tag: str, cells: Sequence[str], kind: str) -> str:
    inner = "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells)
    return f'<tr class="{html.escape(kind)}">{inner}</tr>' if kind else f"<tr>{inner}</tr>"


def _png(image: Image) -> str:
    good, data = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))
    if not good:
        raise InternavError(f"a picture of shape {image.shape} cannot be written as PNG")
    return base64.b64encode(data.tobytes()).decode("ascii")
