import io

import pytest

from internav_data.core.progress import clock
from internav_data.generation.progress import GenerationProgress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_clock():
    told = [clock(seconds) for seconds in (0.4, 59.4, 60, 200, 3599, 3660, 90_000)]
    assert told == [
        "0 s",
        "59 s",
        "1 min 00 s",
        "3 min 20 s",
        "59 min 59 s",
        "1 h 01 min",
        "25 h 00 min",
    ]


@pytest.fixture
def begun(monkeypatch):
    """Make a progress that began some seconds ago, by a clock that stands still."""

    def make(stream, ago):
        wait(1000.0)
        progress = GenerationProgress(stream)
        progress.begin(scenes=100, done=40, episodes_left=600)
        wait(ago)
        return progress

    def wait(seconds):
        now[0] += seconds

    now = [0.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    make.wait = wait
    return make


def test_the_line_tells_speed_and_time_left(begun):
    progress = begun(None, 10.0)
    for _ in range(10):
        progress.scene(10, expected=10)
    progress.scene(0, expected=10)
    line = progress.line()
    assert line.startswith("51/100 scenes (51%), 10.0 episodes/s, 49 s left, 1 quarantined")


def test_a_first_run_that_compiles_says_so(begun):
    assert "compiling" not in begun(None, 2.0).line()
    assert "compiling" in begun(None, 20.0).line()


def test_a_terminal_gets_one_line_that_renews_itself(begun):
    stream = Terminal()
    progress = begun(stream, 1.0)
    progress.tick()
    progress.tick()
    assert stream.getvalue() == "\r40/100 scenes (40%)", "not more often than five times a second"
    progress.say("scene-000007 is quarantined")
    assert stream.getvalue().endswith("\r" + " " * 19 + "\rscene-000007 is quarantined\n")


def test_a_file_gets_a_plain_line_now_and_then(begun):
    stream = io.StringIO()
    progress = begun(stream, 1.0)
    progress.tick()
    assert stream.getvalue() == ""
    begun.wait(60.0)
    progress.tick()
    progress.end()
    assert stream.getvalue().count("\n") == 1
    assert "\r" not in stream.getvalue()


def test_silence_without_a_stream(begun, capfd):
    progress = begun(None, 100.0)
    progress.tick()
    progress.say("nothing")
    progress.end()
    assert capfd.readouterr() == ("", "")
