"""A state machine over generate, kill, resume, extend, delete, corrupt, another config, merge and
validate, against a model: the bytes of runs in one piece.

A case is a seed: five runs of twenty steps.
"""

from __future__ import annotations

import functools
import shutil
from collections import Counter
from typing import TYPE_CHECKING, ClassVar

import hypothesis
from campaign import Row
from fault_points import FaultPoints, mark_of
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)
from stub_runs import (
    OTHER,
    STRANGERS,
    check_readable,
    contents,
    difference,
    forked,
    made,
    merged,
    scratch,
    whole,
    whole_contents,
)

from internav_data.core.storage import write_atomically
from internav_data.dataset import has_manifest, load_dataset
from internav_data.records.errors import InternavError
from internav_data.verification import validate

if TYPE_CHECKING:
    from pathlib import Path

MAX_SCENES, RUNS, STEPS = 5, 5, 20
_MANIFEST = "manifest.json"


class Folder(RuleBasedStateMachine):
    """A folder and what it must hold."""

    totals: ClassVar[Counter[str]] = Counter()
    """Runs, steps and kills that really happened; `run_machine` counts them anew."""

    def __init__(self) -> None:
        super().__init__()
        self.place = scratch("states")
        self.out = self.place / "d"
        self.steps = -1  # the first is `begin`

    @invariant()
    def count(self):
        """Count a step: hypothesis asks after each."""
        self.steps += 1

    @initialize()
    def begin(self):
        """Hold nothing: no scenes, no damage, nothing half done."""
        self.held, self.killed, self.strange = 0, False, False
        self.damaged: dict[str, bytes] = {}

    def teardown(self):
        self.totals.update(runs=1, steps=self.steps)
        shutil.rmtree(self.place)

    @property
    def files(self):
        """Contents of the folder without strangers' files."""
        files = contents(self.out)
        if self.strange:
            assert {name: files.pop(name) for name in STRANGERS} == STRANGERS
        return files

    def _is_whole(self, scenes):
        differences = difference(self.files, whole_contents(scenes))
        assert not differences, f"expected the {scenes} scenes of a run in one piece: {differences}"
        self.held, self.killed, self.damaged = scenes, False, {}

    def _ends_with(self, scenes):
        """Check what a run of so many scenes left that was not killed."""
        self.held = max(scenes, self.held)
        later = [
            name for name in self.files if name.endswith(".work") and _scene(name) >= self.held
        ]
        if self.killed and later:  # finished ones beyond those asked for are kept, unharmed
            assert check_readable(self.out, whole(MAX_SCENES)) == self.held
        else:
            self._is_whole(self.held)

    @rule(scenes=st.integers(1, MAX_SCENES))
    def generate(self, scenes):
        """Make, resume, extend or mend a dataset."""
        before, broken = contents(self.out), _MANIFEST in self.damaged
        try:
            made(self.out, scenes)
        except InternavError as error:
            lost = self.killed and "would be lost" in str(error)
            if not lost and not broken:
                raise
            assert not difference(contents(self.out), before), "a refused run changed something"
            return
        assert not broken, "a damaged manifest was believed"
        self._ends_with(scenes)

    @rule(scenes=st.integers(1, MAX_SCENES), share=st.floats(0, 1))
    @precondition(lambda self: not self.damaged)
    def kill(self, scenes, share):
        """Kill a run at a call that changes the disk."""
        calls = 20 + 100 * max(0, scenes - self.held)

        def run():
            FaultPoints(self.out, int(share * calls), "SIGKILL").install()
            made(self.out, scenes)

        outcome = forked(run)
        killed = outcome == "killed by SIGKILL"
        assert killed or not outcome or "would be lost" in outcome, outcome
        assert mark_of(self.out).exists() == killed, "a kill, and no fault point was reached"
        mark_of(self.out).unlink(missing_ok=True)
        if killed:
            self.totals["kills"] += 1
            self.killed = True
            self.held = max(self.held, check_readable(self.out, whole(MAX_SCENES)))
        elif not outcome:
            self._ends_with(scenes)

    @rule(scenes=st.integers(1, MAX_SCENES))
    @precondition(lambda self: self.held)
    def another_config(self, scenes):
        """Try another config in the same folder."""
        before = contents(self.out)
        try:
            made(self.out, scenes, OTHER)
        except InternavError:
            assert not difference(contents(self.out), before), "a refused run changed something"
        else:
            raise AssertionError("another config went into the folder of this one")

    @rule(number=st.integers(0, 99), cut=st.booleans(), at=st.floats(0, 1, exclude_max=True))
    @precondition(lambda self: self.held and not self.damaged and not self.killed)
    def corrupt(self, number, cut, at):
        """Delete a file of the dataset, or flip one of its bits."""
        files = {name: data for name, data in self.files.items() if data is not None}
        name = sorted(files)[number % len(files)]
        place = int(at * len(files[name]))
        self.damaged = {name: files[name]}
        if cut and name != _MANIFEST:
            (self.out / name).unlink()
        else:
            data = bytearray(files[name])
            data[place] ^= 1 << number % 8
            (self.out / name).write_bytes(bytes(data))

    @rule()
    @precondition(lambda self: self.damaged)
    def restore(self):
        """Put the file back that was damaged."""
        for name, data in self.damaged.items():
            write_atomically(self.out / name, data)
        self.damaged = {}

    @rule()
    @precondition(lambda self: self.held or self.killed)
    def check_files(self):
        """Find the damage, and nothing else."""
        if not has_manifest(self.out):
            return
        named = {finding.file for finding in validate(self.out, "files").found}
        # Files of a commit that was cut off are expected; a stranger's among the data is named.
        strangers = {name for name in STRANGERS if self.strange and name.startswith("data/")}
        assert named == set(self.damaged) | strangers, named

    @rule()
    @precondition(lambda self: self.held)
    def load(self):
        """Read the first scenes, or be refused."""
        try:
            assert len(load_dataset(self.out).to_table()) > 0
            check_readable(self.out, whole(MAX_SCENES))
        except InternavError:
            assert self.damaged

    @rule(cut=st.integers(1, MAX_SCENES - 1))
    def merge(self, cut):
        """Join two parts into the folder, which may hold the first scenes already."""
        before = contents(self.out)
        try:
            merged([_part(0, cut), _part(cut, MAX_SCENES)], self.out)
        except InternavError:
            if not self.killed and not self.damaged and not self.held:
                raise
            if not self.killed:
                assert not difference(contents(self.out), before), "a refused merge changed it"
            return
        if self.killed:  # what a killed `generate` left in .work/ goes with the next `generate`
            assert check_readable(self.out, whole(MAX_SCENES)) == MAX_SCENES
            self.held = MAX_SCENES
        else:
            self._is_whole(MAX_SCENES)

    @rule()
    @precondition(lambda self: self.held and not self.strange)
    def strangers(self):
        """Put files of somebody else beside the dataset."""
        for name, data in STRANGERS.items():
            write_atomically(self.out / name, data)
        self.strange = True

    @rule()
    def remove(self):
        """Remove the folder."""
        shutil.rmtree(self.out, ignore_errors=True)
        self.begin()


def _scene(name: str) -> int:
    """Return the number of a staged scene; -1 for the folder of all."""
    return int(name[-11:-5]) if name[-11:-5].isdigit() else -1


@functools.cache
def _part(first: int, end: int) -> Path:
    folder = scratch("part") / "d"
    made(folder, range(first, end))
    return folder


def run_machine(seed: int, runs: int, steps: int) -> Counter[str]:
    """Run the state machine with a seed; return how many runs, steps and kills there were."""
    profile = settings(
        max_examples=runs,
        stateful_step_count=steps,
        database=None,
        deadline=None,
        phases=[Phase.generate],  # shrinking takes longer than finding
        report_multiple_bugs=False,
        suppress_health_check=list(HealthCheck),
    )
    machine = hypothesis.seed(seed)(type(f"Folder{seed}", (Folder,), {"totals": Counter()}))
    run_state_machine_as_test(machine, settings=profile)
    return machine.totals


def run(key: str, _folder: Path):
    """Run five runs of a seed."""
    return dict(run_machine(int(key), RUNS, STEPS))


ROW = Row("states", lambda: map(str, range(200 // RUNS)), run)
