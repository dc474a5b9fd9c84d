import http.client
import json
import socket
import threading
import time

import pytest

from internav_data.records.errors import InternavError, UsageError
from internav_data.viewer import ViewedDataset, ViewerServer
from internav_data.viewer.episode_index import EpisodeIndex
from internav_data.viewer.routes import failure
from internav_data.viewer.server import host_names, open_server


@pytest.fixture(scope="module")
def server(viewed):
    with ViewerServer(viewed) as made:
        thread = threading.Thread(target=made.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        yield made
        made.shutdown()
        thread.join()


def ask(server, path="/api/dataset", method="GET", body=None, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1], timeout=30)
    connection.putrequest(method, path, skip_host=True)
    port = server.server_address[1]
    given = {"Host": f"127.0.0.1:{port}"} | {k.replace("_", "-"): v for k, v in headers.items()}
    for name, value in given.items():
        if value is not None:
            connection.putheader(name, value)
    connection.endheaders(body)
    response = connection.getresponse()
    content = response.read()
    connection.close()
    return response, content


def test_the_page_and_its_modules_are_served(server):
    response, page = ask(server, "/")
    assert response.status == 200
    policy = response.getheader("Content-Security-Policy")
    assert "default-src 'none'" in policy
    assert "unsafe-inline'" not in policy.split("script-src")[1].split(";")[0]
    assert b"http://" not in page.replace(b"http://www.w3.org", b"")
    assert b"https://" not in page
    for name in ("main", "map", "player"):
        response, module = ask(server, f"/static/{name}.js")
        assert (response.status, response.getheader("Content-Type")[:15]) == (
            200,
            "text/javascript",
        )
        assert b"https://" not in module


@pytest.mark.parametrize("host", ["localhost:{port}", "[::1]:{port}", "LOCALHOST:{port}"])
def test_names_of_this_machine_are_answered(server, host):
    response, _ = ask(server, Host=host.format(port=server.server_address[1]))
    assert response.status == 200


@pytest.mark.parametrize(
    "host",
    ["evil.example", "evil.example:{port}", "127.0.0.1", "127.0.0.1.nip.io:{port}", "", None],
)
def test_other_hosts_are_refused(server, host):
    """A page whose name was made to resolve to this machine sends its own name (DNS rebinding)."""
    given = None if host is None else host.format(port=server.server_address[1])
    response, content = ask(server, Host=given)
    assert response.status == 403
    assert "scenes" not in content.decode()


def test_a_browser_names_port_80_by_leaving_it_out():
    assert {"127.0.0.1", "localhost", "localhost:80"} < host_names(80)
    assert "localhost" not in host_names(8437)


def test_nobody_else_reaches_it(server):
    assert server.server_address[0] == "127.0.0.1"
    response, _ = ask(server)
    assert response.getheader("Access-Control-Allow-Origin") is None
    assert response.getheader("Cross-Origin-Resource-Policy") == "same-origin"


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "HEAD"])
def test_only_get(server, method):
    response, _ = ask(server, method=method)
    assert response.status in {405, 501}


def test_bodies_and_long_addresses_are_refused(server):
    response, _ = ask(server, body=b"abc", Content_Length="3")
    assert response.status == 400
    response, content = ask(server, "/" + "x" * 6000)
    assert (response.status, "4096" in content.decode()) == (414, True)
    response, _ = ask(server, "/" + "x" * 70000)
    assert response.status == 414


@pytest.mark.parametrize(
    "path", ["/../manifest.json", "/..%2fmanifest.json", "/%00", "/api/episode/%ff/0"]
)
def test_no_path_leads_out(server, path):
    response, content = ask(server, path)
    assert response.status == 404
    assert "error" in json.loads(content)


def test_a_visitor_who_leaves_ends_nothing(server):
    for _ in range(3):
        with socket.create_connection(server.server_address) as connection:
            connection.sendall(b"GET /api/statistics HTTP/1.1\r\nHost: 127.0.0.1\r\n")
    assert ask(server)[0].status == 200


def test_its_end_waits_for_answers_but_for_no_visitor(viewed, monkeypatch):
    """A thread that the interpreter ends within arrow aborts the process."""
    entered, ended = threading.Event(), threading.Event()

    def slow(*_):
        entered.set()
        time.sleep(0.3)
        ended.set()
        return failure(404, "none")

    monkeypatch.setattr("internav_data.viewer.server.respond", slow)
    with ViewerServer(viewed) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        idle = socket.create_connection(server.server_address)
        asks = socket.create_connection(server.server_address)
        port = server.server_address[1]
        asks.sendall(f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
        assert entered.wait(20.0)
        server.shutdown()
        thread.join()
        before = time.monotonic()
    assert ended.is_set()
    assert time.monotonic() - before < 10.0, "it waited for the idle visitor"
    idle.close()
    asks.close()


def test_reading_ends_with_the_page(folder):
    """At a million episodes the columns take a minute: Ctrl-C does not wait for them."""
    viewed = ViewedDataset(folder)
    asked = []

    def ended():
        asked.append(len(asked))
        return len(asked) > 1

    manifest = viewed.dataset.manifest
    with pytest.raises(InternavError, match="the page was ended"):
        EpisodeIndex.read(viewed.dataset.store, manifest, ended)
    assert len(asked) == 2
    with viewed.warming():
        assert len(viewed.index) == 36
    assert not [t for t in threading.enumerate() if t.name == "viewer-warm"]


def test_a_taken_port_is_said_and_the_default_one_gives_way(server, viewed, monkeypatch):
    taken = server.server_address[1]
    with pytest.raises(UsageError, match=rf"--port {taken}: another program listens there"):
        ViewerServer(viewed, taken)
    monkeypatch.setattr("internav_data.viewer.server.PORT", taken)
    with open_server(viewed, None) as other:
        assert other.server_address[1] != taken
