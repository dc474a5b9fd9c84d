"""A hub of this process: it takes what huggingface_hub sends, and keeps it."""

from __future__ import annotations

import base64
import json
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


class FakeHub:
    """Repositories by name: {file: bytes}; requests as (method, path)."""

    def __init__(self):
        self.files = {}
        self.requests = []
        self.commits = []
        self.made = []
        self.refuses = False
        self.address = ""

    def answer(self, method, path, body):  # noqa: PLR0911 - one an address
        """Return status and JSON of a request."""
        self.requests.append((method, path))
        if self.refuses:
            return 403, {"error": "You don't have the rights to create a repository there"}
        if path == "/api/repos/create":
            self.made.append(json.loads(body))
            return 200, {"url": f"{self.address}/datasets/me/houses"}
        if path.endswith("/preupload/main"):
            named = [file["path"] for file in json.loads(body)["files"]]
            return 200, {
                "files": [
                    {"path": name, "uploadMode": "regular", "shouldIgnore": False, "oid": None}
                    for name in named
                ]
            }
        if "/commit/main" in path:
            return 200, self.commit([json.loads(line) for line in body.splitlines()])
        if "/tree/main" in path:
            return 200, [
                {"type": "file", "path": name, "size": len(data), "oid": "0"}
                for name, data in self.files.items()
            ]
        if path == "/api/validate-yaml":
            return 200, {"errors": [], "warnings": []}
        if "/revision/main" in path or path.startswith("/api/datasets/"):
            siblings = [{"rfilename": name} for name in self.files]
            return 200, {"id": "me/houses", "sha": "0" * 40, "siblings": siblings}
        return 404, {"error": path}

    def commit(self, lines):
        """Carry out the lines of a commit."""
        for line in lines:
            value = line["value"]
            if line["key"] == "header":
                self.commits.append(value["summary"])
            elif line["key"] == "file":
                self.files[value["path"]] = base64.b64decode(value["content"])
            elif line["key"] == "deletedFile":
                del self.files[value["path"]]
        url = f"{self.address}/datasets/me/houses/commit/{'0' * 40}"
        return {"commitUrl": url, "commitOid": "0" * 40, "success": True}


@contextmanager
def serving(hub):
    """Serve a hub at a free port of this machine; yield its address."""

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
            status, answer = hub.answer(self.command, self.path.partition("?")[0], body)
            data = json.dumps(answer).encode()
            self.send_response(status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        do_GET = do_POST  # noqa: N815 - http.server's name

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    hub.address = f"http://127.0.0.1:{server.server_port}"
    try:
        yield hub.address
    finally:
        server.shutdown()
        server.server_close()
