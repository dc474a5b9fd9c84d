"""The agent's numbers stand in one place, and the validator's own copies are the same."""

import ast
from pathlib import Path

import pytest

import internav_data
from internav_data.records.agent import AGENT, CLEARANCE_M, SPACING_M
from internav_data.verification import checked_lattice, interactions, shapes
from internav_data.verification.replay import expert_replay

PACKAGE = Path(internav_data.__file__).parent
COPIES = [
    (checked_lattice, "SPACING_M", AGENT.step_m),
    (checked_lattice, "RADIUS_M", AGENT.radius_m),
    (checked_lattice, "TOLERANCE_M", AGENT.tie_m),
    (checked_lattice, "KEEP_M", AGENT.clearance_m),
    (interactions, "SPACING_M", AGENT.step_m),
    (shapes, "STEP_OVER_M", AGENT.step_over_m),
    (shapes, "AGENT_HEIGHT_M", AGENT.height_m),
    (expert_replay, "REACH_M", AGENT.reach_m),
]


@pytest.mark.parametrize(("module", "name", "value"), COPIES)
def test_the_validators_copy_is_the_agents_number(module, name, value):
    assert getattr(module, name) == value


def test_constants_for_kernels_are_the_agents_numbers():
    assert AGENT.step_m == SPACING_M
    assert CLEARANCE_M == AGENT.clearance_m == 0.2 - 1e-6


def test_no_other_module_states_a_number_under_an_agents_name():
    """A constant that bears an agent's name holds a literal in `records.agent` alone."""
    names = {
        *("SPACING_M", "RADIUS_M", "CLEARANCE_M", "TOLERANCE_M", "LOWEST_M", "HIGHEST_M"),
        *("REACH_M", "CAMERA_M", "EYE_HEIGHT_M", "HORIZONS_DEG", "START_HORIZON_DEG"),
        *("FIELD_OF_VIEW_DEG", "AGENT_M", "AGENT_HEIGHT_M"),
    }
    found = []
    for path in PACKAGE.rglob("*.py"):
        if "verification" in path.parts:
            continue
        for node in ast.parse(path.read_text()).body:
            targets = node.targets if isinstance(node, ast.Assign) else []
            targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
            bare = {t.id.strip("_") for t in targets if isinstance(t, ast.Name)}
            if bare & names and isinstance(node.value, (ast.Constant, ast.Tuple)):
                found.append((path.name, *bare))
    assert found == []
