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


def uses_of_the_builtin(source):
    """Lines in which `sum` is called or handed on, but for sums of lengths: those are whole."""
    tree = ast.parse(source)
    lengths = {
        id(node.func)
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and ast.unparse(node).startswith("sum(map(len, ")
    }
    return [
        node.lineno
        for node in ast.walk(tree)
        if (isinstance(node, ast.Name) and node.id == "sum" and id(node) not in lengths)
        or (isinstance(node, ast.Attribute) and ast.unparse(node) == "builtins.sum")
    ]


@pytest.mark.parametrize("room", ROOMS)
def test_no_room_whose_results_are_data_uses_the_builtin(room):
    """Since 3.12 `sum` compensates floats: houses were others on 3.11 than on later Pythons."""
    paths = sorted((ROOT / room).rglob("*.py"))
    assert paths
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in paths
        for line in uses_of_the_builtin(path.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_the_rule_sees_the_builtin_however_it_is_used():
    used = [
        "sum(a)",
        "x = map(sum, rows)",
        "reduce(f, key=sum)",
        "builtins.sum(a)",
        "sum(map(f, a))",
    ]
    assert [uses_of_the_builtin(source) for source in used] == [[1]] * len(used)
    free = ["plain_sum(a)", "a.sum()", "np.sum(a)", "sum(map(len, a))", "fsum(a)"]
    assert [uses_of_the_builtin(source) for source in free] == [[]] * len(free)
