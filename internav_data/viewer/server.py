"""Server of the page on this machine alone: GET requests that name it as 127.0.0.1 or localhost."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import socket
import sys
import threading
import webbrowser
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import TYPE_CHECKING, Any, Final

import pyarrow as pa

from internav_data.core.locks import ThreadLock
from internav_data.records.errors import UsageError
from internav_data.viewer.routes import Response, failure, respond

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.viewer.viewed import ViewedDataset

HOST: Final = "127.0.0.1"
PORT: Final = 8437
"""Port where none is asked for; another free one if it is taken."""
_HTTP_PORT: Final = 80
_TIMEOUT_S: Final = 30.0
"""Longest wait for a request on a connection, seconds."""
_HEADERS: Final = {
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}
_POLICY: Final = "default-src 'none'"
_MALLOC: Final = {
    "M_MMAP_THRESHOLD": (-3, 1 << 18),
    "M_TRIM_THRESHOLD": (-1, 1 << 18),
    "M_ARENA_MAX": (-8, 2),
}
"""Parameters of glibc's mallopt(3), with bytes or a number."""


class ViewerServer(ThreadingHTTPServer):
    """HTTP server of one dataset's page, bound to `HOST`.

    A page of another site whose name was made to resolve to this machine (DNS rebinding) sends that
    name as the request's host, and is refused.

    Raises
    ------
    UsageError
        The port is taken, or may not be taken by this user.
    """

    daemon_threads = False
    """Whoever closes the server waits for its threads: one that the interpreter ends within arrow
    aborts the process."""
    allow_reuse_address = True

    def __init__(self, viewed: ViewedDataset, port: int = 0) -> None:
        self.viewed = viewed
        self._connections: set[socket.socket] = set()
        self._lock = ThreadLock()
        try:
            super().__init__((HOST, port), _Handler)
        except (OSError, OverflowError) as error:
            raise UsageError(_refusal(port, error)) from error
        self.hosts = host_names(self.server_address[1])
        """Values of the header Host that are answered."""

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.server_address[1]}/"

    def process_request(self, request: Any, client_address: Any) -> None:  # noqa: ANN401 - as typed there
        """Answer a connection in a thread of its own."""
        with self._lock:
            self._connections.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:  # noqa: ANN401
        """Close a connection."""
        with self._lock:
            self._connections.discard(request)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Say nothing of a connection that broke: the browser has closed a page."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)

    def server_close(self) -> None:
        """Break all connections and wait for the threads: for none that waits for a request."""
        with self._lock:
            for connection in self._connections:
                with contextlib.suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)
        super().server_close()


def host_names(port: int) -> frozenset[str]:
    """Return the values of the header Host that name this machine; browsers leave port 80 out."""
    names = (HOST, "localhost", "[::1]")
    bare = names if port == _HTTP_PORT else ()
    return frozenset([*(f"{name}:{port}" for name in names), *bare])


def _refusal(port: int, error: Exception) -> str:
    if getattr(error, "errno", None) == errno.EADDRINUSE:
        return f"--port {port}: another program listens there; choose another port, or leave it out"
    reason = getattr(error, "strerror", None) or error
    return f"--port {port}: cannot listen there ({reason}); choose one from 1024 to 65535"


class _Handler(BaseHTTPRequestHandler):
    """Handler of one connection."""

    server: ViewerServer
    protocol_version = "HTTP/1.1"
    timeout = _TIMEOUT_S
    server_version, sys_version = "internav-view", ""

    def do_GET(self) -> None:
        hosts = self.headers.get_all("Host") or []
        if len(hosts) != 1 or hosts[0].lower() not in self.server.hosts:
            self._send(failure(403, f"this server answers as {HOST} and localhost alone"))
        elif self.headers.get("Content-Length", "0") != "0" or "Transfer-Encoding" in self.headers:
            self.close_connection = True
            self._send(failure(400, "a request with a body: expected none"))
        else:
            self._send(respond(self.server.viewed, self.path))

    def _send(self, response: Response) -> None:
        try:
            self.send_response(response.status)
            for name, value in _HEADERS.items():
                self.send_header(name, value)
            self.send_header("Content-Security-Policy", response.policy or _POLICY)
            self.send_header("Content-Type", response.kind)
            self.send_header("Content-Length", str(len(response.body)))
            self.end_headers()
            self.wfile.write(response.body)
        except (ConnectionError, TimeoutError):
            self.close_connection = True  # whoever asked has turned the page

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:
        """Answer a request that is none of ours, as one of another method, by one line."""
        del explain
        self.close_connection = True
        self._send(failure(code, message or "expected a GET request"))

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - http.server's name
        """Log nothing: requests are a page's own."""


def open_server(viewed: ViewedDataset, port: int | None) -> ViewerServer:
    """Return a server on a port; without one on `PORT`, or on any that is free.

    Raises
    ------
    UsageError
        The port that was asked for is taken.
    """
    if port is not None:
        return ViewerServer(viewed, port)
    try:
        return ViewerServer(viewed, PORT)
    except UsageError:
        return ViewerServer(viewed, 0)


def serve(
    viewed: ViewedDataset,
    port: int | None = None,
    *,
    browser: bool = True,
    say: Callable[[str], object] = print,
) -> None:
    """Serve a dataset's page until the process is interrupted.

    Parameters
    ----------
    viewed
        The dataset.
    port
        Port to listen on, 0 for any free one.
    browser
        Whether to open the user's browser.
    say
        Function that is told the address, and whether a browser was found.

    Raises
    ------
    UsageError
        The port is taken.
    """
    _spare_memory()
    with open_server(viewed, port) as server, viewed.warming():
        say(f"{server.url} shows the dataset; Ctrl-C ends it")
        if browser:
            threading.Thread(target=_open, args=(server.url, say), daemon=True).start()
        server.serve_forever(poll_interval=0.2)


def _spare_memory() -> None:
    """Have glibc give pictures' buffers back, and threads share heaps: 100 MB less.

    Each request has a thread of its own, and arrow's allocator and glibc's a heap for each.
    """
    pa.set_memory_pool(pa.system_memory_pool())
    with contextlib.suppress(OSError, AttributeError, TypeError):  # another C library
        mallopt = ctypes.CDLL(None).mallopt
        for parameter, value in _MALLOC.values():
            mallopt(parameter, value)


def _open(url: str, say: Callable[[str], object]) -> None:
    try:
        opened = webbrowser.open(url)
    except webbrowser.Error:
        opened = False
    if not opened:
        say(f"no browser was found: open {url} in one on this machine")
