"""Datasets in a bucket, through moto's server: written, read, resumed, merged, and refused."""

from __future__ import annotations

import http.client
import json
import os
import pickle
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

pytest.importorskip("moto.server", reason="moto[server] is not installed (make test-interop)")

from click.testing import CliRunner
from internav_cli.main import cli
from moto.server import ThreadedMotoServer
from pyarrow import fs
from scene_stubs import CATALOGUE, InProcess, plain

from internav_data.core import object_store
from internav_data.core.object_store import ObjectStore
from internav_data.core.storage import FolderStore, LockedError, StoreError, store_of
from internav_data.dataset import load_dataset, read_manifest, shards
from internav_data.generation.config import load_config
from internav_data.generation.run import generate
from internav_data.records.errors import CorruptDataError, InternavError, UsageError
from internav_data.verification import validate

CONFIG = load_config(overrides=["episodes_per_scene=3"])
SCENES = 18
FEW = 6


@pytest.fixture(scope="module")
def server():
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        for name in [name for name in os.environ if name.startswith("AWS_")]:
            patch.delenv(name)
        patch.setenv("AWS_ACCESS_KEY_ID", "key")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        patch.setattr(object_store, "_MAX_ATTEMPTS", 1)
        patch.setattr(shards, "SCENES_PER_SHARD", {"episodes": 8, "scenes": 10})
        maker = fs.S3FileSystem(
            endpoint_override=f"{host}:{port}",
            scheme="http",
            region="us-east-1",
            allow_bucket_creation=True,
        )
        maker.create_dir("bucket")
        yield f"{host}:{port}"
    server.stop()


@pytest.fixture(scope="module")
def folder(server, tmp_path_factory):
    return made(tmp_path_factory.mktemp("folder") / "d")


@pytest.fixture(scope="module")
def few(server, tmp_path_factory):
    return content(made(tmp_path_factory.mktemp("few") / "d", FEW))


@pytest.fixture(scope="module")
def bucket(server):
    return made("s3://bucket/whole")


def made(out, scenes=SCENES, executor=None, setup=plain):
    generate(out, CONFIG, scenes, 1, None, CATALOGUE, executor or InProcess(), setup)
    return out


def content(place):
    store = store_of(place)
    return {name: store.read(name) for name in store.names()}


def test_a_dataset_in_a_bucket_is_that_in_a_folder(folder, bucket):
    assert content(bucket) == content(folder)
    ours, theirs = load_dataset(bucket), load_dataset(folder)
    assert repr(ours).startswith("Dataset('s3://bucket/whole', ")
    assert list(ours) == list(theirs)
    assert ours[7] == theirs[7]
    assert ours.scene("scene-000004") == theirs.scene("scene-000004")
    assert load_dataset(bucket, "train", [("index", "=", 1)])[3].index == 1
    again = pickle.loads(pickle.dumps(ours))  # noqa: S301 - our own
    assert again[3] == theirs[3]
    state = ours.iterable(seed=3)
    assert [e.episode_id for e in state] == [e.episode_id for e in theirs.iterable(seed=3)]


def test_worker_processes_write_into_it_and_a_failure_loses_nothing(server, folder):
    out = "s3://bucket/resumed/here"
    with pytest.raises(Exception, match="No space"):
        made(out, FEW, setup=stopping)
    assert any(name.endswith(".work") for name in store_of(out).names())
    made(out, FEW, "processes")
    made(out)
    assert content(out) == content(folder)


def stopping(payload):
    make = plain(payload)

    def work(scene):
        if scene == 4:
            raise OSError(28, "No space left on device")
        return make(scene)

    return work


def test_parts_in_buckets_and_folders_are_merged(server, folder, tmp_path):
    parts = [made("s3://bucket/parts/a", range(9)), made(tmp_path / "b", range(9, SCENES))]
    found = CliRunner().invoke(cli, ["merge", *map(str, parts), "--out", "s3://bucket/parts/all"])
    assert found.exit_code == 0, found.output
    assert f"s3://bucket/parts/all: {SCENES} scenes" in found.output
    assert content("s3://bucket/parts/all") == content(folder)


def test_commands_read_a_bucket(bucket, folder):
    found = CliRunner().invoke(cli, ["stats", bucket, "--json"])
    assert found.exit_code == 0, found.output
    assert json.loads(found.stdout) == json.loads(
        CliRunner().invoke(cli, ["stats", str(folder), "--json"]).stdout
    )
    assert f"dataset: {bucket}" in found.stderr
    refused = CliRunner().invoke(cli, ["upload", bucket, "--to", "me/it"])
    assert isinstance(refused.exception, UsageError)
    assert "upload sends a folder: copy the dataset into one" in str(refused.exception)


def test_a_bucket_is_validated_as_a_folder_is(bucket, folder):
    validated = validate(bucket, "geometry", workers=2).to_json()
    assert validated == validate(folder, "geometry").to_json()
    assert json.loads(validated)["checked"]["scenes"] == SCENES


def test_what_is_read_is_verified(bucket):
    store, damaged = store_of(bucket), ObjectStore("s3://bucket/damaged")
    for name in store.names():
        damaged.put(name, store.read(name))
    for file in read_manifest(store).of("episodes", "train")[:2]:
        data = bytearray(store.read(file.path))
        data[len(data) // 3] ^= 1
        damaged.put(file.path, bytes(data))
    with pytest.raises(CorruptDataError, match="damaged"):
        list(load_dataset(damaged))
    damaged.put("data/stranger.parquet", b"?")
    found = {finding.predicate for finding in validate(damaged, "files").found}
    assert found >= {"files.sha256", "files.unlisted"}
    damaged.remove("data/stranger.parquet")
    made(damaged)
    assert content(damaged) == content(bucket), "mended"


def test_a_row_group_is_one_request(server, bucket, proxy):
    dataset = load_dataset(bucket, "train")
    dataset[0]
    proxy.log.clear()
    _, end, _ = dataset.row_group_cache.group_of(0)
    dataset[end]  # of another file, or group
    dataset[end + 1]
    assert sum("GET" in line for line in proxy.log) <= 6, proxy.log
    proxy.log.clear()
    dataset[end]
    assert proxy.log == []


def test_a_folders_and_a_buckets_names(server):
    for given in ("s3://bucket/a/b", "s3://bucket/a/b/"):
        assert store_of(given) == ObjectStore("s3://bucket/a/b")
    from pathlib import Path

    assert store_of(Path("s3://bucket/a/b")) == ObjectStore("s3://bucket/a/b")
    assert store_of("s3x/a") == FolderStore(Path("s3x/a"))
    for empty in ("s3://", "s3:///a", "s3://bucket", "s3://bucket/"):
        with pytest.raises(UsageError, match="expected s3://bucket/prefix"):
            store_of(empty)


def test_one_process_of_a_machine_writes_at_a_time(bucket):
    store = store_of(bucket)
    again = store.lock("come back later")
    with store.lock("busy"), pytest.raises(LockedError, match="s3://bucket/whole: come back"):
        again.__enter__()


class Proxy(BaseHTTPRequestHandler):
    """Passes requests on to moto, but for those that a fault is stated for."""

    protocol_version = "HTTP/1.1"

    def answer(self):
        server = self.server
        server.log.append(f"{self.command} {self.path}")
        body = self.body()
        fault = server.fault(self.command, self.path)
        if fault == "cut":
            self.close_connection = True
            self.connection.close()
            return
        if fault:
            status, code = fault
            text = f"<Error><Code>{code}</Code><Message>{code}</Message></Error>".encode()
            self.reply(status, [("Content-Type", "application/xml")], text)
            return
        onward = http.client.HTTPConnection(server.behind)
        headers = {k: v for k, v in self.headers.items() if k.lower() != "transfer-encoding"}
        onward.request(self.command, self.path, body, headers | {"Content-Length": str(len(body))})
        got = onward.getresponse()
        self.reply(got.status, got.getheaders(), got.read())

    def body(self):
        if "chunked" not in self.headers.get("Transfer-Encoding", ""):
            return self.rfile.read(int(self.headers.get("Content-Length") or 0))
        blocks = []
        while size := int(self.rfile.readline().split(b";")[0], 16):
            blocks.append(self.rfile.read(size))
            self.rfile.readline()
        while self.rfile.readline().strip():
            pass
        return b"".join(blocks)

    def reply(self, status, headers, body):
        self.send_response_only(status)
        for name, value in headers:
            if name.lower() not in {"transfer-encoding", "connection", "content-length"}:
                self.send_header(name, value)
        length = {n.lower(): v for n, v in headers}.get("content-length", len(body))
        self.send_header("Content-Length", str(length if self.command == "HEAD" else len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    do_GET = do_HEAD = do_PUT = do_POST = do_DELETE = answer  # noqa: N815 - the base class's

    def log_message(self, *_):
        pass


@pytest.fixture
def proxy(server, monkeypatch):
    between = ThreadingHTTPServer(("127.0.0.1", 0), Proxy)
    between.behind, between.log, between.fault = server, [], lambda *_: None
    threading.Thread(target=between.serve_forever, daemon=True).start()
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{between.server_port}")
    yield between
    between.shutdown()
    between.server_close()


@pytest.mark.parametrize(
    ("method", "fault", "message"),
    [
        ("PUT", (403, "AccessDenied"), r"access is denied \(PutObject\): give these credentials"),
        ("PUT", (503, "SlowDown"), r"requests are throttled \(PutObject\): what is finished is"),
        ("PUT", "cut", r"the connection was lost \(PutObject\)"),
        ("HEAD", (403, "x"), r"access is denied \(HeadObject\)"),
        ("GET", (503, "SlowDown"), "requests are throttled"),
    ],
)
def test_faults_are_one_line_and_the_same_call_goes_on(proxy, few, method, fault, message):
    out = f"s3://bucket/faults/{method}-{fault[0]}"
    proxy.fault = lambda command, path: (
        fault if command == method and (method != "PUT" or "scene-000004" in path) else None
    )
    with pytest.raises(InternavError, match=message) as caught:
        made(out, FEW)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("s3://bucket/faults/")
    proxy.fault = lambda *_: None
    made(out, FEW)
    assert content(out) == few


def test_a_lost_connection_while_reading_is_not_damage(proxy, bucket):
    dataset = load_dataset(bucket, "train")
    proxy.fault = lambda command, _: "cut" if command == "GET" else None
    with pytest.raises(StoreError, match="connection was lost"):
        dataset[0]
    with pytest.raises(StoreError, match="connection was lost"):
        validate(bucket, "files")
    proxy.fault = lambda *_: None
    assert dataset[0] == load_dataset(bucket, "train")[0]


def test_a_bucket_that_is_not_there_is_one_line(server):
    with pytest.raises(StoreError, match="there is no such bucket"):
        made("s3://nobody-has-this/x", 3)


def test_where_nothing_is_there_is_no_dataset(server):
    with pytest.raises(CorruptDataError, match=r"s3://bucket/empty: no dataset here"):
        load_dataset("s3://bucket/empty")


def test_a_forked_process_reads_with_a_client_of_its_own(bucket):
    dataset = load_dataset(bucket, "train")
    first = dataset[0].episode_id
    ours, theirs = os.pipe()
    child = os.fork()
    if child == 0:
        os.write(theirs, dataset[0].episode_id.encode())
        os._exit(0)
    os.close(theirs)
    assert os.read(ours, 100).decode() == first
    os.waitpid(child, 0)
