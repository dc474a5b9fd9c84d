"""A disk that is full while a run is trained: one line, and what was there stays whole."""

import errno
import json
from dataclasses import replace

import pytest

pytest.importorskip("torch")

import safetensors

from internav_data.camp import checkpoint, logging
from internav_data.camp.checkpoint import read
from internav_data.camp.config import from_mapping, preset
from internav_data.camp.run import begin, resume
from internav_data.camp.train import Request
from internav_data.core import storage
from internav_data.records.errors import InternavError

SMALL = {
    "network": {"image_size": 16, "hidden": 8},
    "ppo": {"num_envs": 2, "num_minibatches": 1, "num_steps": 4, "update_epochs": 1},
    "stages": {"total_timesteps": 48},
    "run": {"max_steps": 12, "checkpoint_every": 2, "validation_episodes": 0},
}
FULL_AFTER = 3
"""Rows after which nothing can be written: one more than a checkpoint knows of."""
FULL = OSError(errno.ENOSPC, "No space left on device")


class Disk:
    """Fails once it is full, wherever something of a name is written."""

    def __init__(self, monkeypatch, name):
        self.full, self._name = False, name
        self._rows = 0
        self._write_all, self._sync = logging.write_all, storage.sync
        self._save_file = checkpoint.save_file
        monkeypatch.setattr(logging, "write_all", self.write_all)
        monkeypatch.setattr(storage, "sync", self.sync)
        monkeypatch.setattr(checkpoint, "save_file", self.save_file)

    def row(self, _):
        self._rows += 1
        self.full = self._rows >= FULL_AFTER

    def fails_at(self, path):
        return self.full and self._name in str(path)

    def write_all(self, file, data):
        if self.fails_at(file.name):
            file.write(data[: len(data) // 2])
            raise FULL
        self._write_all(file, data)

    def sync(self, path):
        if self.fails_at(path):
            raise FULL
        self._sync(path)

    def save_file(self, tensors, path):
        if self.fails_at(path):
            path.write_bytes(b"half")
            raise safetensors.SafetensorError("I/O error: No space left on device (os error 28)")
        self._save_file(tensors, path)


@pytest.mark.parametrize(
    "name",
    ["log.jsonl", "events.out", "weights.safetensors", ".checkpoint.json", ".checkpoints.json"],
)
def test_a_full_disk_is_one_line_and_the_run_goes_on_from_its_last_checkpoint(
    scenes, tmp_path, monkeypatch, name
):
    disk, out = Disk(monkeypatch, name), tmp_path / "run"
    config = from_mapping(preset("small"), SMALL, "test")
    request = Request(scenes, out, "ppo", config, ("all",), callback=disk.row)
    with pytest.raises(InternavError, match="No space left on device") as caught:
        begin(request)
    assert "\n" not in str(caught.value)
    assert "go on by --resume: the last checkpoint is whole" in str(caught.value)
    assert str(out) in str(caught.value)
    assert read(out).progress["environment_steps"] == 16
    rows = [json.loads(line) for line in (out / "log.jsonl").read_text().splitlines()]
    assert len(rows) in {FULL_AFTER, FULL_AFTER + 1}
    assert not list(out.rglob("*.tmp"))
    disk.full = False
    resume(replace(request, callback=lambda _: None), {})
    assert read(out).progress["environment_steps"] == 40


def test_tensorboard_reads_what_a_run_wrote(tmp_path):
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    with logging.MetricsLogger(tmp_path) as log:
        log.write({"step": 8, "ppo": {"loss": 0.5}, "stage": "main"})
        log.write({"step": 16, "ppo": {"loss": 0.25}, "update": 2})
    found = accumulator.EventAccumulator(str(tmp_path / "tensorboard"))
    found.Reload()
    assert [(each.step, each.value) for each in found.Scalars("ppo/loss")] == [(8, 0.5), (16, 0.25)]
    assert [(each.step, each.value) for each in found.Scalars("update")] == [(16, 2.0)]
