"""Environments in processes of their own: how they start and end."""

import contextlib
import signal
import subprocess
import sys
import textwrap
import time

import numpy as np
import psutil
import pytest
from gymnasium.spaces import Box

from internav_data.core.processes import GRACE_S
from internav_data.envs import InterNavProcesses, InterNavVectorEnv, Sensor
from internav_data.envs.tasks import InteractiveNavigation
from internav_data.physics.registry import solver_counts
from internav_data.records.errors import InternavError, UsageError
from internav_data.world.actions import Action

LIMIT_S = 120.0
SCRIPT = """
import sys
import gymnasium, numpy as np
from internav_data.envs import InterNavProcesses, Sensor
{own}
env = InterNavProcesses(2, sys.argv[1], 2, 16{more})
print(sorted(env.reset(seed=1)[0]), flush=True)
{then}
"""
OWN = """
def space(size):
    return gymnasium.spaces.Box(0.0, 1.0, (1,), np.float32)
def write(run, frames, out):
    out[...] = 1.0
"""
MORE = ', sensors=["goal", Sensor("mine", space, write)]'


def script(tmp_path, small, own="", more="", then=""):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT.format(own=own, more=more, then=then))
    return [sys.executable, str(path), str(small)]


def ran(words):
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=LIMIT_S)


def test_a_script_needs_no_main_guard_and_ends_without_closing(tmp_path, small):
    done = ran(script(tmp_path, small))
    assert (done.returncode, done.stderr) == (0, "")
    assert "'rgb'" in done.stdout


def test_a_scripts_own_sensors_need_the_guard_and_it_is_asked_for(tmp_path, small):
    words = script(tmp_path, small, OWN, MORE)
    done = ran(words)
    assert done.returncode == 1
    assert 'below `if __name__ == "__main__":`' in done.stderr.splitlines()[-1]
    path = tmp_path / "script.py"
    head, tail = path.read_text().split("env = ")
    body = textwrap.indent(f"env = {tail}", "    ")
    path.write_text(f'{head}\nif __name__ == "__main__":\n{body}\n')
    done = ran(words)
    assert (done.returncode, done.stdout, done.stderr) == (0, "['goal', 'mine']\n", "")


def test_what_cannot_be_sent_is_refused(small):
    sensor = Sensor("mine", lambda _: Box(0.0, 1.0, (1,)), lambda *_: None)
    with pytest.raises(UsageError, match="cannot be sent to another process"):
        InterNavProcesses(2, small, 2, 16, sensors=[sensor])


def children(process):
    return psutil.Process(process.pid).children()


@pytest.mark.parametrize("signum", [signal.SIGKILL, signal.SIGTERM])
def test_processes_end_with_a_script_that_is_killed(tmp_path, small, signum):
    words = script(tmp_path, small, then="sys.stdin.read()")
    parent = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert parent.stdout.readline()
    processes = children(parent)
    assert len(processes) == 2
    parent.send_signal(signum)
    assert parent.wait(LIMIT_S) == -signum
    assert psutil.wait_procs(processes, LIMIT_S)[1] == []


def test_a_process_that_is_killed_is_named(small):
    env = InterNavProcesses(2, small, 2, 16)
    env.reset(seed=1)
    # Not by process ids: they wrap, and the resource tracker of multiprocessing is a child, too.
    env._processes[1].process.kill()  # noqa: SLF001
    with pytest.raises(InternavError, match="process 2 of 2 was killed by SIGKILL"):
        env.step([0, 0])
    began = time.monotonic()
    env.close()
    assert time.monotonic() - began < LIMIT_S


def test_closed_environments_say_so(small):
    env = InterNavProcesses(2, small, 2, 16)
    env.reset(seed=1)
    env.close()
    for ask in (env.reset, env.state, env.action_masks, lambda: env.step([0, 0])):
        with pytest.raises(UsageError, match="they were closed"):
            ask()


@pytest.mark.parametrize("bad", [0, 1])
def test_after_a_refused_reset_it_is_known_who_has_begun_anew(small, bad):
    env = InterNavProcesses(2, small, 2, 16, autoreset_mode="Disabled")
    with contextlib.closing(env):
        env.reset(seed=1)
        env.step([Action.DONE] * 2)
        ids = [None, None]
        ids[bad] = "nowhere"
        with pytest.raises(UsageError, match="no episode 'nowhere'"):
            env.reset(options={"episode_id": ids})
        with pytest.raises(UsageError, match=f"environment {bad} is done"):
            env.step([0, 0])
        env.reset(options={"reset_mask": np.arange(2) == bad})
        env.step([0, 0])


def test_no_answer_is_taken_for_that_of_a_later_call(small, monkeypatch):
    env = InterNavProcesses(2, small, 2, 16)
    env.reset(seed=1)
    with monkeypatch.context() as patch:
        patch.setattr(env, "_answers", interrupt)  # Ctrl-C in a notebook
        with pytest.raises(KeyboardInterrupt):
            env.step([0, 0])
    for ask in (env.reset, env.state, lambda: env.step([0, 0])):
        with pytest.raises(InternavError, match="interrupted before process 1 of 2 had answered"):
            ask()
    began = time.monotonic()
    env.close()
    assert time.monotonic() - began < GRACE_S, "each process ends when it is asked to"


def interrupt(*_):
    raise KeyboardInterrupt


def test_seeds_that_are_not_given_are_those_of_one_process(small):
    def begun(env):
        with contextlib.closing(env):
            first = env.reset(seed=[5, None, None, 7])[1]["episode_id"].tolist()
            return [first, env.reset()[1]["episode_id"].tolist(), env.state()]

    def begun_late(env):
        """Reset a part that has no seed when it begins."""
        with contextlib.closing(env):
            env.reset(seed=5, options={"reset_mask": np.array([True, False, False, False])})
            env.reset(options={"reset_mask": np.array([False, False, True, True])})
            return env.reset()[1]["episode_id"].tolist()

    for each in (begun, begun_late):
        assert each(InterNavProcesses(4, small, 2, 16)) == each(InterNavVectorEnv(4, small, 16))


@pytest.mark.parametrize("mode", ["Disabled", "SameStep"])
def test_metrics_that_are_whole_in_some_environments_keep_the_fractions_of_others(small, mode):
    given = {"image_size": 16, "task": Ratio, "autoreset_mode": mode}
    alone, processes = InterNavVectorEnv(4, small, **given), InterNavProcesses(4, small, **given)
    with contextlib.closing(alone), contextlib.closing(processes):
        firsts = set()
        for seed in range(8):
            for env in (alone, processes):
                env.reset(seed=seed)
            ratios = [ratio(slot.run.world) for slot in alone.slots]
            firsts.add(ratios[0])
            for env in (alone, processes):
                info = env.step(np.full(4, Action.DONE))[4]
                info = info["final_info"] if mode == "SameStep" else info
                np.testing.assert_array_equal(info["metrics"]["ratio"], ratios)
        assert firsts == {0, 0.75}


class Ratio(InteractiveNavigation):
    """The main task, with a metric that is the whole number 0 in some episodes."""

    name = "ratio"

    def metrics(self):
        return {**super().metrics(), "ratio": ratio(self.world)}


def ratio(world):
    return 0 if sum(world.goal) % 2 else 0.75


def test_the_pushes_of_all_processes_are_counted(small):
    actions = np.random.default_rng(0).integers(12, size=(40, 4))
    before = solver_counts()
    alone = InterNavVectorEnv(4, small, 16)
    with contextlib.closing(alone), contextlib.closing(InterNavProcesses(4, small, 2, 16)) as env:
        for each in (alone, env):
            each.reset(seed=0)
            for row in actions:
                each.step(row)
        asked, solved = env.solver_counts().asked, env.solver_counts().solved
        assert asked == alone.solver_counts().asked - before.asked
        assert 0 < solved <= asked
