"""What `doctor` finds on machines that this one is not."""

from __future__ import annotations

import platform
import sys
from types import SimpleNamespace

import pytest

from internav_data.generation.diagnostics import examine
from internav_data.physics import engines


def absent(module):
    def load():
        raise ModuleNotFoundError(f"{module} is missing", name=module)

    return load


def found(tmp_path, beginning):
    return [check for check in examine(tmp_path) if f"{check.name} ".startswith(beginning)]


@pytest.mark.parametrize(
    ("default", "states", "remedies"),
    [
        (
            "bullet",
            ["warning", "good"],
            ["ask for --physics mujoco, or: pip install 'internav-data[bullet]'", ""],
        ),
        ("mujoco", ["warning", "good"], ["pip install 'internav-data[bullet]'", ""]),
    ],
)
def test_one_engine_is_enough(tmp_path, monkeypatch, default, states, remedies):
    other = SimpleNamespace(build="mujoco 4")
    table = {"bullet": absent("pybullet"), "mujoco": lambda: other}
    monkeypatch.setattr(engines, "ENGINES", table)
    monkeypatch.setattr(engines, "DEFAULT_ENGINE", default)
    checks = found(tmp_path, "engine ")
    assert [check.state for check in checks] == states
    assert [check.remedy for check in checks] == remedies
    assert [check.name.endswith("(the default)") for check in checks] == [
        name == default for name in table
    ]


def test_no_engine_is_bad(tmp_path, monkeypatch):
    table = {"bullet": absent("pybullet"), "mujoco": absent("mujoco")}
    monkeypatch.setattr(engines, "ENGINES", table)
    checks = found(tmp_path, "engine ")
    assert [check.state for check in checks] == ["bad", "bad"]
    assert [check.remedy for check in checks] == [
        "pip install 'internav-data[bullet]'",
        "pip install 'internav-data[generate]'",
    ]


@pytest.mark.parametrize(
    ("system", "state", "words"),
    [
        ("Linux", "good", ""),
        ("Darwin", "warning", "macOS"),
        ("Windows", "warning", "one process makes all scenes"),
        ("FreeBSD", "warning", "a container"),
    ],
)
def test_systems_that_were_not_tried_are_named(tmp_path, monkeypatch, system, state, words):
    monkeypatch.setattr(platform, "system", lambda: system)
    (check,) = found(tmp_path, "platform ")
    assert check.state == state
    assert words in check.remedy


@pytest.mark.parametrize(("minor", "state"), [(11, "good"), (14, "good"), (15, "warning")])
def test_a_python_that_was_not_tried_is_named(tmp_path, monkeypatch, minor, state):
    monkeypatch.setattr(sys, "version_info", (3, minor, 0))
    (check,) = found(tmp_path, "Python ")
    assert check.state == state
    assert ("3.14" in check.remedy) == (state == "warning")
