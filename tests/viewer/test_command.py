"""`internav-gen view` as a user types it."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

PROGRAM = [sys.executable, "-c", "from internav_cli.main import main; main()", "view"]


def run(*words, **env):
    done = subprocess.run(
        [*PROGRAM, *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env=os.environ | env,
    )
    assert "Traceback" not in done.stderr
    return done


def one_line(done, code, *words):
    lines = [line for line in done.stderr.splitlines() if not line.startswith("dataset: ")]
    assert (done.returncode, len(lines)) == (code, 1), done.stderr
    assert all(word in lines[0] for word in words), lines[0]


@pytest.fixture
def started(folder):
    """A server in a process of its own, and its address."""
    environment = os.environ | {"BROWSER": "false", "DISPLAY": "", "WAYLAND_DISPLAY": ""}
    command = [*PROGRAM, str(folder), "--port", "0"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=environment)
    lines = []
    for line in process.stderr:
        lines.append(line)
        if found := re.match(r"(http://127\.0\.0\.1:\d+/) shows", line):
            yield process, found[1]
            break
    else:
        raise AssertionError(lines)
    process.kill()
    process.communicate()


def test_it_serves_until_ctrl_c_and_says_where_no_browser_is(started):
    process, url = started
    with urllib.request.urlopen(url + "api/dataset", timeout=60) as response:  # noqa: S310
        assert json.load(response)["episodes"] == 36
    said = process.stderr.readline()
    assert said.startswith("no browser was found: open http://127.0.0.1:")
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=60)
    assert process.returncode == 130
    assert rest.strip() == "internav-gen: interrupted"


def test_ctrl_c_while_it_warms_up_is_a_line(started):
    process, _ = started
    process.send_signal(signal.SIGINT)
    _, rest = process.communicate(timeout=60)
    assert process.returncode == 130, rest
    assert rest.splitlines()[-1] == "internav-gen: interrupted"


def test_a_taken_port_is_one_line(folder):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        one_line(run(folder, "--port", port, "--no-browser"), 2, f"--port {port}", "another")


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (["--port", 70000], 2, ["70000", "65535"]),
        (["--sample", 3], 2, ["--sample", "--html"]),
        (["--html", "x.html", "--port", 1], 2, ["--port", "leave --html out"]),
        (["--html", "x.html", "--sample", 1000], 2, ["1 to 200", "1000"]),
    ],
)
def test_wrong_options_are_one_line(folder, words, code, told):
    one_line(run(folder, *words), code, *told)


def test_no_dataset_a_cut_one_and_another_version_are_one_line(folder, tmp_path):
    one_line(run(tmp_path / "none"), 5, "no dataset here", "internav-gen generate")
    cut, newer = tmp_path / "cut", tmp_path / "newer"
    shutil.copytree(folder, cut)
    path = next(cut.glob("data/scenes/*.parquet"))
    path.write_bytes(path.read_bytes()[:-100])
    one_line(run(cut), 5, "truncated or edited")
    shutil.copytree(folder, newer)
    manifest = newer / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"format_version": 2', '"format_version": 9'))
    one_line(run(newer), 5, "format version 9", "upgrade")


def test_a_file_is_written_once(folder, tmp_path):
    page = tmp_path / "page.html"
    done = run(folder, "--html", page, "--sample", 1)
    assert done.returncode == 0, done.stderr
    assert f"wrote {page}: 1 episodes" in done.stderr
    assert page.stat().st_size > 700_000
    one_line(run(folder, "--html", page), 2, "is there already", "--force")
