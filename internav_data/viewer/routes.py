"""Answers to the page's requests, by path: what the server sends, and what one file holds."""

from __future__ import annotations

import html
import json
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qsl, unquote, urlsplit

from internav_data.core.extras import missing
from internav_data.records.errors import InternavError, MissingEngineError, UsageError
from internav_data.viewer.viewed import NoSuchEpisodeError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from internav_data.viewer.viewed import ViewedDataset

    Answer = Callable[[ViewedDataset, re.Match[str], Mapping[str, str]], "Response"]

MAX_URL: Final = 4096
"""Longest path with its query."""
MODULES: Final = (
    *("main", "data", "dom", "gallery", "episode", "map", "player", "statistics", "charts"),
)
"""JavaScript modules of the page, in `static/`."""
_MAX_FIELDS: Final = 32
_JSON: Final = "application/json; charset=utf-8"
_HTML: Final = "text/html; charset=utf-8"
_WEBP: Final = "image/webp"
_FRAME: Final = "/view3d"
_EPISODE: Final = r"/episode/(?P<scene>[\w.-]{1,64})/(?P<number>\d{1,9})"
_FRAME_POLICY: Final = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; connect-src data: blob:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'self'"
)


@dataclass(frozen=True, slots=True)
class Response:
    """Answer to a request."""

    status: int
    kind: str
    """Media type."""
    body: bytes
    policy: str | None = None
    """Content security policy, where it is not the page's."""


def respond(viewed: ViewedDataset, url: str) -> Response:
    """Return the answer to a GET request of a path with its query; errors are answers too."""
    try:
        return _respond(viewed, url)
    except ModuleNotFoundError as error:
        status, text = 501, str(missing(error.name))
    except MissingEngineError as error:
        status, text = 501, str(error)
    except NoSuchEpisodeError as error:
        status, text = 404, str(error)
    except UsageError as error:
        status, text = 400, str(error)
    except InternavError as error:
        status, text = 500, str(error)
    except Exception as error:  # noqa: BLE001 - one picture's fault is no reason to end the server
        status, text = 500, f"{type(error).__name__}: {error}; this is a bug"
    return failure(status, text, framed=_framed(url))


def _framed(url: str) -> bool:
    return url.startswith(_FRAME)


def failure(status: int, text: str, *, framed: bool = False) -> Response:
    """Return an answer that says in one line what is wrong; a frame shows it as it is."""
    line = " ".join(text.split())
    if framed:
        page = f'<body style="font:15px system-ui;color:#b3261a">{html.escape(line)}'
        return Response(status, _HTML, page.encode(), _FRAME_POLICY)
    return Response(status, _JSON, json.dumps({"error": line}).encode())


def _respond(viewed: ViewedDataset, url: str) -> Response:
    if len(url) > MAX_URL:
        return failure(414, f"the address is longer than {MAX_URL} characters")
    try:
        parts = urlsplit(url)
        query = dict(parse_qsl(parts.query, keep_blank_values=False, max_num_fields=_MAX_FIELDS))
    except ValueError as error:
        return failure(400, f"the address {url[:200]} cannot be read: {error}", framed=_framed(url))
    path = unquote(parts.path)
    for pattern, answer in _ROUTES:
        found = pattern.fullmatch(path)
        if found is not None:
            return answer(viewed, found, query)
    return failure(404, f"nothing at {path[:200]}: the page is at /")


def _json(value: Any) -> Response:  # noqa: ANN401 - what JSON can hold
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Response(200, _JSON, text.encode())


def _place(found: re.Match[str]) -> tuple[str, int]:
    return found["scene"], int(found["number"])


def _outcome(found: re.Match[str]) -> tuple[str, int, int, str]:
    return *_place(found), int(found["obstacle"]), found["action"]


def _picture(data: bytes) -> Response:
    return Response(200, _WEBP, data)


def _viewer(viewed: ViewedDataset, found: re.Match[str], _: Mapping[str, str]) -> Response:
    from internav_data.viewer.scene3d import MARK, viewer_template  # noqa: PLC0415

    page = viewer_template().replace(MARK, viewed.model(*_place(found)).decode())
    return Response(200, _HTML, page.encode(), _FRAME_POLICY)


@cache
def static_text(name: str) -> str:
    """Return the text of a file of the page."""
    return (files("internav_data.viewer") / "static" / name).read_text("utf-8")


def _module(_viewed: ViewedDataset, found: re.Match[str], _: Mapping[str, str]) -> Response:
    name = found["name"]
    if name not in MODULES:
        return failure(404, f"the page has no module {name!r}")
    return Response(200, "text/javascript; charset=utf-8", static_text(f"{name}.js").encode())


def _index(_viewed: ViewedDataset, _found: re.Match[str], _: Mapping[str, str]) -> Response:
    from internav_data.viewer.page import served_page  # noqa: PLC0415

    page, policy = served_page()
    return Response(200, _HTML, page.encode(), policy)


_OUTCOME: Final = rf"/api{_EPISODE}/obstacle/(?P<obstacle>\d{{1,4}})/(?P<action>\w{{1,20}})"
_ROUTES: Final[tuple[tuple[re.Pattern[str], Answer], ...]] = tuple(
    (re.compile(pattern), answer)
    for pattern, answer in (
        (r"/(?:index\.html)?", _index),
        (r"/static/(?P<name>\w+)\.js", _module),
        (r"/api/dataset", lambda v, _m, _q: _json(v.facts())),
        (r"/api/episodes", lambda v, _m, q: _json(v.episodes(q))),
        (r"/api/statistics", lambda v, _m, _q: _json(v.statistics())),
        (rf"/api{_EPISODE}", lambda v, m, _q: _json(v.episode(*_place(m)))),
        (rf"/api{_EPISODE}/neighbours", lambda v, m, q: _json(v.neighbours(*_place(m), q))),
        (rf"/api{_EPISODE}/thumbnail", lambda v, m, _q: _picture(v.thumbnail(*_place(m)))),
        (rf"/api{_EPISODE}/floor", lambda v, m, _q: _picture(v.floor(*_place(m)))),
        (rf"/api{_EPISODE}/play", lambda v, m, _q: _json(v.play(*_place(m)))),
        (
            rf"/api{_EPISODE}/play/(?P<step>\d{{1,5}})",
            lambda v, m, _q: _picture(v.play_picture(*_place(m), int(m["step"]))),
        ),
        (_OUTCOME, lambda v, m, _q: _json(v.video(*_outcome(m)))),
        (
            rf"{_OUTCOME}/(?P<frame>\d{{1,3}})",
            lambda v, m, _q: _picture(v.video_picture(*_outcome(m), int(m["frame"]))),
        ),
        (rf"{_FRAME}{_EPISODE}", _viewer),
    )
)
"""Answers by pattern of the path: GET alone, and nothing of the disk but what the dataset names."""
