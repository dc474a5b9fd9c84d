"""Sums whose last bits are those of every Python."""

import ast
import math
from pathlib import Path

import pytest

import internav_data
from internav_data.core.arithmetic import plain_sum

ROOT = Path(internav_data.__file__).parent
ROOMS = (
    "records", "geometry", "catalog", "houses", "navigation", "physics", "world", "planner",
    "episodes",
)  # fmt: skip
"""Rooms whose results are data."""
TENTHS = [0.1] * 10


def test_numbers_are_added_from_left_to_right():
    assert plain_sum(TENTHS) == 0.9999999999999999 != math.fsum(TENTHS)
    assert (plain_sum([]), plain_sum([1, 2]), plain_sum(iter([0.5]))) == (0, 3, 0.5)


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_whose_results_are_data_calls_the_builtin(room):
    """Since 3.12 `sum` compensates floats: houses were others on 3.11 than on later Pythons.

    Of whole numbers its sums are the same: those of lengths and counts may call it.
    """
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sorted((ROOT / room).rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "sum"
        if not ast.unparse(node).startswith("sum(map(len, ")
    ]
    assert found == []
