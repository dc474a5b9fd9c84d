import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from scene_stubs import CATALOGUE, stub

from internav_data.core.storage import FolderStore, LockedError
from internav_data.dataset import open_staging, read_manifest
from internav_data.generation.config import GenerationConfig, load_config
from internav_data.generation.run import MAX_SCENES, generate, identity_for
from internav_data.records.errors import (
    CorruptDataError,
    InternavError,
    QuarantineError,
    UsageError,
)

CONFIG = load_config(overrides=["episodes_per_scene=3"])


def made(out, scenes, workers=1, config=CONFIG, progress=None, **orders):
    """Generate stub scenes; the journal lists every scene begun since the last call."""
    out.parent.mkdir(parents=True, exist_ok=True)
    (out.parent / "stub.json").write_text(json.dumps(orders))
    (out.parent / "journal").write_text("")
    return generate(out, config, scenes, workers, progress, assets=CATALOGUE, setup=stub)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The contents of datasets of so many scenes, each made in one go by one worker."""

    @functools.cache
    def of(scenes):
        out = tmp_path_factory.mktemp("whole") / "d"
        made(out, scenes)
        return contents(out)

    return of


def journal(out):
    path = out.parent / "journal"
    return sorted(int(line) for line in path.read_text().split()) if path.exists() else []


def contents(out):
    files = sorted(path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in files}


def test_a_dataset_is_made(tmp_path):
    report = made(tmp_path / "d", 5)
    assert (report.scenes, report.new_scenes, report.exit_code) == (5, 5, 0)
    assert report.episodes == report.new_episodes == 4 * 3 + 1, "scene 1 is test: a tenth"
    assert not (tmp_path / "d" / ".work").exists()
    assert read_manifest(tmp_path / "d").config["episodes_per_scene"] == 3


def test_the_same_bytes_for_any_workers_and_after_deaths(tmp_path, whole):
    made(tmp_path / "d", 12, workers=3, kill_once=[4, 9])
    assert contents(tmp_path / "d") == whole(12)
    assert journal(tmp_path / "d").count(4) == 2


def test_scenes_that_cannot_be_made_are_named(tmp_path):
    report = made(tmp_path / "d", 8, kill_always=[2], quarantine=[5])
    reasons = dict(report.quarantined)
    assert set(reasons) == {"scene-000002", "scene-000005"}
    assert "SIGKILL" in reasons["scene-000002"]
    assert reasons["scene-000005"] == "nothing can be blocked"
    assert report.exit_code == 4
    assert report.scenes == 8
    assert report.episodes == 5 * 3 + 1
    quarantined = read_manifest(tmp_path / "d").quarantined
    assert [(q.scene, q.died) for q in quarantined] == [(2, True), (5, False)]


def test_nothing_at_all_is_an_error(tmp_path):
    with pytest.raises(QuarantineError, match="none of 3 scenes could be made: nothing can be"):
        made(tmp_path / "few" / "d", 3, hopeless=True)
    with pytest.raises(QuarantineError, match="none of 20 scenes"):
        made(tmp_path / "many" / "d", 500, hopeless=True)
    assert not (tmp_path / "few" / "d" / "manifest.json").exists()


def started(out, scenes, **orders):
    """Start a generator over stub scenes in a process of its own, with two workers."""
    (out.parent / "stub.json").write_text(json.dumps(orders))
    script = Path(__file__).with_name("run_stub.py")
    return subprocess.Popen([sys.executable, script, out, str(scenes), "2"])


def killed(out, signum, scenes=60):
    """Start a generator over slow scenes and end it when some are done."""
    process = started(out, scenes, seconds=0.2)
    deadline = time.monotonic() + 300
    while len(list(out.rglob("scene-*.work"))) < 5 and time.monotonic() < deadline:
        time.sleep(0.02)
    process.send_signal(signum)
    code = process.wait(timeout=300)
    while any(map(runs, (out.parent / "workers").read_text().split())):
        time.sleep(0.02)  # workers whose parent was killed end the scene they are at
    return code


def test_workers_that_outlive_a_killed_run_spoil_no_other(tmp_path):
    out, other = tmp_path / "d", load_config(overrides=["episodes_per_scene=2", "seed=3"])
    made(tmp_path / "clean" / "d", 4, config=other)
    process = started(out, 60, seconds=4.0, outlives=True)
    while len(journal(out)) < 2:
        time.sleep(0.02)
    process.kill()
    process.wait()
    workers = (tmp_path / "workers").read_text().split()
    assert all(map(runs, workers)), "they are at their scenes"
    with pytest.raises(LockedError), FolderStore(out).lock(""):
        pass
    shutil.rmtree(out)
    made(out, 4, config=other)
    assert contents(out) == contents(tmp_path / "clean" / "d")
    shutil.rmtree(out)
    while any(map(runs, workers)):
        time.sleep(0.02)
    assert not out.exists()


def runs(pid):
    """Return whether a process exists and is no zombie, which nobody may collect in a container."""
    try:
        return psutil.Process(int(pid)).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@pytest.mark.parametrize("signum", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_finished_scenes_stay_after_a_kill(tmp_path, signum, whole):
    out = tmp_path / "d"
    code = killed(out, signum)
    assert code == (-signal.SIGKILL if signum == signal.SIGKILL else 128 + signum)
    finished = {int(path.stem[-6:]) for path in out.rglob("scene-*.work")}
    assert (out / "manifest.json").exists() == (signum != signal.SIGKILL)
    if signum != signal.SIGKILL:
        finished |= set(range(read_manifest(out).scenes))
    assert 5 <= len(finished) < 60
    report = made(out, 60)
    assert set(journal(out)) == set(range(60)) - finished
    assert report.new_scenes == 60 - len(finished)
    assert contents(out) == whole(60)


def test_a_damaged_manifest_is_not_extended(tmp_path):
    out = tmp_path / "d"
    made(out, 3)
    text = (out / "manifest.json").read_text()
    for old, new in (
        ('"table": "episodes"', '"table": "dpisodes"'),
        ('"scenes": 3', '"scenes": 0'),
    ):
        (out / "manifest.json").write_text(text.replace(old, new))
        before = contents(out)
        with pytest.raises(CorruptDataError, match="damaged or edited"):
            made(out, 5)
        assert contents(out) == before


def test_an_interrupt_is_answered_at_once(tmp_path):
    out = tmp_path / "d"
    process = started(out, 60, seconds=60.0)
    while len(journal(out)) < 2:
        time.sleep(0.02)
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=60) == 128 + signal.SIGINT
    assert time.monotonic() - began < 5.0, "2 s, and more on a busy machine"
    assert not any(map(runs, (tmp_path / "workers").read_text().split()))


def test_more_scenes_extend(tmp_path, whole):
    out = tmp_path / "d"
    made(out, 5)
    report = made(out, 12)
    assert journal(out) == list(range(5, 12))
    assert (report.scenes, report.new_scenes) == (12, 7)
    assert contents(out) == whole(12)


@pytest.mark.parametrize("scenes", [5, 3])
def test_no_more_scenes_change_nothing(tmp_path, scenes):
    out = tmp_path / "d"
    made(out, 5)
    before = contents(out)
    report = made(out, scenes)
    assert (report.scenes, report.new_scenes) == (5, 0)
    assert contents(out) == before
    assert not (out / ".work").exists()


def test_fewer_scenes_never_throw_work_away(tmp_path):
    out = tmp_path / "d"
    killed(out, signal.SIGKILL)
    with pytest.raises(UsageError, match=r"would be lost: ask for --scenes \d+ or more"):
        made(out, 2)


@pytest.mark.parametrize("finished", [True, False])
def test_another_config_is_refused(tmp_path, finished):
    out = tmp_path / "d"
    if finished:
        made(out, 3)
    else:
        killed(out, signal.SIGKILL)
    before = contents(out)
    other = load_config(overrides=["episodes_per_scene=3", "house.scale=1.5"])
    with pytest.raises(UsageError, match=r"another config.*scale"):
        made(out, 60, config=other)
    assert contents(out) == before


def test_a_folder_of_something_else_is_refused_and_left_alone(tmp_path):
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "thesis.tex").write_text("precious")
    with pytest.raises(UsageError, match="no dataset"):
        made(tmp_path / "d", 3)
    assert contents(tmp_path / "d") == {"thesis.tex": b"precious"}
    with pytest.raises(UsageError, match="is a file"):
        made(tmp_path / "d" / "thesis.tex", 3)


def test_two_generators_do_not_meet(tmp_path):
    (tmp_path / "d").mkdir()
    with (
        FolderStore(tmp_path / "d").lock(""),
        pytest.raises(LockedError, match="another internav-gen"),
    ):
        made(tmp_path / "d", 3)
    assert made(tmp_path / "d", 3).scenes == 3


def test_a_full_disk_loses_nothing(tmp_path):
    out = tmp_path / "d"
    with pytest.raises(
        InternavError, match=r"No space left on device \([\d,]+ bytes free\); "
    ) as caught:
        made(out, 12, workers=1, full=8)
    assert caught.value.exit_code == 1
    made(out, 12)
    assert not set(journal(out)) & {0, 1, 2, 3}


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_a_read_only_folder(tmp_path):
    (tmp_path / "d").mkdir(mode=0o555)
    with pytest.raises(InternavError, match="cannot write to"):
        made(tmp_path / "d", 3)


@pytest.mark.parametrize(("scenes", "workers"), [(0, 1), (-1, 1), (MAX_SCENES + 1, 1), (1, -1)])
def test_invalid_counts_are_refused(tmp_path, scenes, workers):
    with pytest.raises(UsageError):
        made(tmp_path / "d", scenes, workers=workers)
    assert not (tmp_path / "d").exists()


def test_a_config_that_never_worked_does_not_bind_the_folder(tmp_path):
    out = tmp_path / "d"
    with pytest.raises(QuarantineError):
        made(out, 3, hopeless=True)
    other = load_config(overrides=["episodes_per_scene=2"])
    assert made(out, 3, config=other).scenes == 3


def test_a_run_killed_before_its_first_scene_does_not_bind_the_folder(tmp_path):
    out = tmp_path / "d"
    open_staging(out, identity_for(load_config(overrides=["seed=5"]), CATALOGUE))
    assert made(out, 3).scenes == 3


@pytest.mark.parametrize("identity", [None, '{"of": "another"}'])
def test_a_work_folder_of_something_else_is_refused_and_left_alone(tmp_path, identity):
    work = tmp_path / "d" / ".work"
    work.mkdir(parents=True)
    (work / "thesis.tex").write_text("precious")
    if identity:
        (work / "identity.json").write_text(identity)
    before = contents(tmp_path / "d")
    with pytest.raises(InternavError, match=r"no dataset|move \.work/ away"):
        made(tmp_path / "d", 3)
    assert contents(tmp_path / "d") == before


def test_meshes_that_tip_over_are_named_before_anything_is_written(tmp_path):
    import trimesh

    meshes = tmp_path / "meshes"
    meshes.mkdir()
    pole = trimesh.creation.box((0.05, 0.05, 1.2))
    pole.apply_transform(trimesh.transformations.rotation_matrix(0.4, (1.0, 0.0, 0.0)))
    pole.export(meshes / "pole.obj")
    config = GenerationConfig(assets=(str(meshes),), episodes_per_scene=1)
    with pytest.raises(UsageError, match=r"1 of your meshes .*Pole_user_pole .*lay_flat"):
        generate(tmp_path / "out", config, 1, 1)
    assert not (tmp_path / "out" / "manifest.json").exists()
