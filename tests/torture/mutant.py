"""One mutant and the tests of its module: `python tests/torture/mutant.py manifest 17`.

It runs in an interpreter of its own that has imported nothing of the package, so that pytest is
the first to import the module, and gets the mutant. Hence this file imports the standard library
and pytest alone. "none" is the module as it is, compiled in the same way.
"""

from __future__ import annotations

import ast
import importlib.abc
import importlib.machinery
import importlib.util
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NOT_LOADED = 64
"""Exit code if the tests ran without the mutant. pytest's own codes are 0 to 5."""
_OPTIONS = (
    *("-q", "-x", "--tb=short", "-m", "not slow and not learning"),
    *("-p", "no:cacheprovider", "-p", "_hypothesis_pytestplugin", "--hypothesis-seed=0"),
)
"""Options of pytest, which loads no other plugin (`PYTEST_DISABLE_PLUGIN_AUTOLOAD`); with a seed,
a mutant that is killed once is killed each time."""


@dataclass(frozen=True)
class Target:
    """A module, and the tests that are to notice its mutants."""

    module: str
    tests: tuple[str, ...]
    """Files or tests below `tests/`, quick ones first: a mutant is dead with the first failure."""
    functions: tuple[str, ...] = ()
    """Functions and classes that are changed; all if none is named."""
    drawn: int = 60
    """Number of mutants that are drawn."""


_LABELS = (
    *("test_a_run_of_pushes_is_push", "test_pickup_rotations_and_drop_are_pick"),
    *("test_a_hand_back_may_be_a_step", "test_decisions_and_the_state_before_them"),
    *("test_the_eleventh_action_closes", "test_hrl_decides_at_every_step_and_never_waits"),
    *("test_labels_are_what_the_model_could_have_done",),
)
"""Tests of an expert's labels, among others that need a dataset."""
TARGETS = {
    "advantages": Target(
        "internav_data.camp.rollout", ("camp/test_advantages.py",), ("advantages",), 40
    ),
    "planar": Target("internav_data.geometry.planar", ("geometry/test_planar.py",), drawn=100),
    "metrics": Target("internav_data.evaluation.metrics", ("evaluation/test_metrics.py",)),
    "manifest": Target(
        "internav_data.dataset.manifest",
        (
            "dataset/test_manifest.py",
            "dataset/test_merging.py::test_a_part_is_a_dataset_that_says_so",
            "dataset/test_corruption.py",
        ),
    ),
    "commit": Target(
        "internav_data.dataset.commit",
        (
            "dataset/test_staging.py",
            "dataset/test_strangers.py",
            "dataset/test_links.py",
            "generation/test_parts.py::test_another_range_in_the_folder_of_a_part_is_refused",
            "dataset/test_commit.py",
        ),
    ),
    "journal": Target("internav_data.dataset.journal", ("dataset/test_strangers.py",), drawn=20),
    "intent": Target(
        "internav_data.camp.agents.hierarchy",
        (
            "camp/test_hierarchy.py",
            "camp/test_replayed_rollouts.py",
            *(f"camp/test_cloning.py::{name}" for name in _LABELS),
        ),
        drawn=100,
    ),
}
_COMPARISONS = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
_OPERATORS = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.BitOr: ast.BitAnd,
    ast.BitAnd: ast.BitOr, ast.FloorDiv: ast.Mult, ast.Mod: ast.Mult, ast.LShift: ast.RShift,
}  # fmt: skip
_CALLS = {"min": "max", "max": "min", "any": "all", "all": "any"}


class _Mutator(ast.NodeTransformer):
    """Changes the place of one number in a module; counts them all."""

    def __init__(self, wanted: int | None, functions: tuple[str, ...]) -> None:
        self.wanted, self.functions = wanted, functions
        self.count = 0
        self.description = ""
        self._within = not functions

    def _here(self, node: ast.AST, change: str) -> bool:
        if not self._within:
            return False
        self.count += 1
        if self.count - 1 != self.wanted:
            return False
        self.description = f"line {getattr(node, 'lineno', 0)}: {change}"
        return True

    def _function(self, node):
        before, self._within = self._within, self._within or node.name in self.functions
        node.body = [self.visit(each) for each in node.body]  # neither signature nor decorators
        self._within = before
        return node

    visit_FunctionDef = _function  # noqa: N815 - by the name of its node

    def visit_ClassDef(self, node):
        node.body = [
            self.visit(each) if isinstance(each, ast.FunctionDef) else each for each in node.body
        ]
        return node

    def visit_Module(self, node):
        kinds = (ast.FunctionDef, ast.ClassDef)
        node.body = [self.visit(each) if isinstance(each, kinds) else each for each in node.body]
        return node

    def visit_Raise(self, node):
        return ast.Pass() if self._here(node, "raise left out") else node

    def visit_JoinedStr(self, node):
        return node

    def visit_AnnAssign(self, node):
        if node.value is not None:
            node.value = self.visit(node.value)
        return node

    def visit_Expr(self, node):
        if isinstance(node.value, ast.Constant):  # a docstring
            return node
        if isinstance(node.value, ast.Call) and self._here(node, "call left out"):
            return ast.Pass()
        return self.generic_visit(node)

    def visit_If(self, node):
        for value in (True, False):
            if self._here(node, f"if {value}"):
                node.test = ast.Constant(value)
                return node
        return self.generic_visit(node)

    def visit_Compare(self, node):
        new = _COMPARISONS.get(type(node.ops[0]))
        if new and self._here(node, f"{type(node.ops[0]).__name__} to {new.__name__}"):
            node.ops[0] = new()
            return node
        return self.generic_visit(node)

    def visit_BinOp(self, node):
        new = _OPERATORS.get(type(node.op))
        if new and self._here(node, f"{type(node.op).__name__} to {new.__name__}"):
            node.op = new()
            return node
        return self.generic_visit(node)

    def visit_BoolOp(self, node):
        if self._here(node, "and for or, or for and"):
            node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
            return node
        return self.generic_visit(node)

    def visit_UnaryOp(self, node):
        if isinstance(node.op, ast.Not | ast.Invert | ast.USub) and self._here(node, "no not"):
            return node.operand
        return self.generic_visit(node)

    def visit_Call(self, node):
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name in _CALLS and self._here(node, f"{name} to {_CALLS[name]}"):
            node.func.id = _CALLS[name]
            return node
        return self.generic_visit(node)

    def visit_Constant(self, node):
        value = node.value
        if isinstance(value, bool) and self._here(node, f"{value} turned round"):
            return ast.Constant(not value)
        if type(value) in {int, float} and self._here(node, f"{value} + 1"):
            return ast.Constant(value + 1)
        return node


def mutated(target: Target, number: int | None) -> tuple[ast.Module, str, int]:
    """Return a module with one change, a description of it, and the number of changes there are."""
    tree = ast.parse(source_of(target).read_text())
    mutator = _Mutator(number, target.functions)
    tree = ast.fix_missing_locations(mutator.visit(tree))
    return tree, mutator.description, mutator.count


def source_of(target: Target) -> Path:
    """Return the path of a target's module."""
    return ROOT / f"{target.module.replace('.', '/')}.py"


class MutantFinder(importlib.abc.MetaPathFinder):
    """Finds one module, as a mutant; `executed` says whether anybody imported it."""

    def __init__(self, target: Target, number: int | None) -> None:
        self.target, self.number = target, number
        self.executed = False

    def find_spec(self, name, _path=None, _target=None):
        if name != self.target.module:
            return None
        source = source_of(self.target)
        return importlib.util.spec_from_file_location(name, source, loader=_Loader(self))


class _Loader(importlib.machinery.SourceFileLoader):
    """Executes a mutant in place of the module's source and of its compiled file."""

    def __init__(self, finder: MutantFinder) -> None:
        super().__init__(finder.target.module, str(source_of(finder.target)))
        self._finder = finder

    def get_code(self, _name):
        tree, _, _ = mutated(self._finder.target, self._finder.number)
        return compile(tree, self.path, "exec")

    def exec_module(self, module):
        self._finder.executed = True  # before: a mutant may fail while it is imported
        super().exec_module(module)


def main() -> int:
    """Run the tests of a target with a mutant; return pytest's exit code or `NOT_LOADED`."""
    name, number = sys.argv[1:]
    target = TARGETS[name]
    package = target.module.partition(".")[0]
    assert package not in sys.modules, f"{package} was imported before its mutant was there"
    finder = MutantFinder(target, None if number == "none" else int(number))
    sys.meta_path.insert(0, finder)
    code = pytest.main([*_OPTIONS, *(str(ROOT / "tests" / test) for test in target.tests)])
    return int(code) if finder.executed else NOT_LOADED


if __name__ == "__main__":
    sys.exit(main())
