import io

import pytest

from internav_data.core.progress import clock
from internav_data.generation.progress import GenerationProgress


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def wait(monkeypatch):
    """A clock that stands still but for this function, which moves it on by some seconds."""
    now = [1000.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])

    def wait(seconds):
        now[0] += seconds

    return wait


def test_durations_as_people_read_them():
    texts = [clock(seconds) for seconds in (0.4, 59.4, 60, 200, 3599, 3660, 90_000)]
    assert texts == [
        "0 s",
        "59 s",
        "1 min 00 s",
        "3 min 20 s",
        "59 min 59 s",
        "1 h 01 min",
        "25 h 00 min",
    ]


def started(stream):
    progress = GenerationProgress(stream)
    progress.begin(scenes=100, done=40, episodes_left=600)
    return progress


def test_the_line_has_rate_and_remaining_time(wait):
    progress = started(None)
    wait(10.0)
    for _ in range(10):
        progress.scene(10, expected=10)
    progress.scene(0, expected=10)
    line = progress.line()
    assert line.startswith("51/100 scenes (51%), 10.0 episodes/s, 49 s left, 1 quarantined")


def test_a_first_run_that_compiles_says_so(wait):
    progress = started(None)
    wait(2.0)
    assert "compiling" not in progress.line()
    wait(18.0)
    assert "compiling" in progress.line()


def test_a_terminal_gets_one_line_that_renews_itself(wait):
    stream = Terminal()
    progress = started(stream)
    wait(1.0)
    progress.tick()
    wait(0.1)
    progress.tick()
    assert stream.getvalue() == "\r40/100 scenes (40%)", "not more often than five times a second"
    progress.log("scene-000007 is quarantined")
    assert stream.getvalue().endswith("\r" + " " * 19 + "\rscene-000007 is quarantined\n")


def test_a_file_gets_a_plain_line_now_and_then(wait):
    stream = io.StringIO()
    progress = started(stream)
    wait(1.0)
    progress.tick()
    assert stream.getvalue() == ""
    wait(60.0)
    progress.tick()
    progress.end()
    assert stream.getvalue().count("\n") == 1
    assert "\r" not in stream.getvalue()


def test_silence_without_a_stream(wait, capsys):
    progress = started(None)
    wait(100.0)
    assert not progress.due()
    progress.tick()
    progress.log("nothing")
    progress.end()
    assert capsys.readouterr() == ("", "")
