"""Mutants: one operator, constant, condition or call of a module changed; its tests must fail.

A case is a target and the number of a mutant: "manifest 17"; "manifest none" is the module as it
is, whose tests must pass. Mutants are drawn in an order of their own. Kernels run without numba:
it would take compiled ones of before from its cache.
"""

from __future__ import annotations

import ast
import functools
import importlib.abc
import importlib.machinery
import importlib.util
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from campaign import Row
from strategies import rng

ROOT = Path(__file__).resolve().parents[2]
LIMIT_S = 400
"""A mutant whose tests take longer is killed: it waits or loops."""


@dataclass(frozen=True)
class Target:
    """A module, and the tests that are to notice its mutants."""

    module: str
    tests: tuple[str, ...]
    functions: tuple[str, ...] = ()
    """Functions and classes that are changed; all if none is named."""
    drawn: int = 60
    """Number of mutants that are drawn."""


TARGETS = {
    "advantages": Target(
        "internav_data.camp.rollout", ("camp/test_advantages.py",), ("advantages",), 40
    ),
    "planar": Target("internav_data.geometry.planar", ("geometry/test_planar.py",), drawn=100),
    "metrics": Target("internav_data.evaluation.metrics", ("evaluation/test_metrics.py",)),
    "manifest": Target(
        "internav_data.dataset.manifest",
        ("dataset/test_manifest.py", "dataset/test_corruption.py"),
    ),
    "commit": Target(
        "internav_data.dataset.commit",
        ("dataset/test_commit.py", "dataset/test_strangers.py", "dataset/test_links.py"),
    ),
    "journal": Target("internav_data.dataset.journal", ("dataset/test_strangers.py",), drawn=20),
    "intent": Target("internav_data.camp.agents.hierarchy", ("camp/test_hierarchy.py",), drawn=100),
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
        self.said = ""
        self._within = not functions

    def _here(self, node: ast.AST, what: str) -> bool:
        if not self._within:
            return False
        self.count += 1
        if self.count - 1 != self.wanted:
            return False
        self.said = f"line {getattr(node, 'lineno', 0)}: {what}"
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
    tree = ast.parse(place_of(target).read_text())
    mutator = _Mutator(number, target.functions)
    tree = ast.fix_missing_locations(mutator.visit(tree))
    return tree, mutator.said, mutator.count


def place_of(target: Target) -> Path:
    return ROOT / f"{target.module.replace('.', '/')}.py"


class _Finder(importlib.abc.MetaPathFinder):
    """Gives out one module changed."""

    def __init__(self, target: Target, number: int) -> None:
        self.target, self.number = target, number

    def find_spec(self, name, _path=None, _target=None):
        if name != self.target.module:
            return None
        return importlib.util.spec_from_file_location(
            name, place_of(self.target), loader=_Loader(self.target, self.number)
        )


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, target: Target, number: int) -> None:
        super().__init__(target.module, str(place_of(target)))
        self._mutant = (target, number)

    def get_code(self, _name):
        return compile(mutated(*self._mutant)[0], self.path, "exec")


def main() -> int:
    """Run a target's tests with a mutant, as the words of this command say."""
    import pytest

    target, number = TARGETS[sys.argv[1]], sys.argv[2]
    if number != "none":
        sys.meta_path.insert(0, _Finder(target, int(number)))
    tests = [str(ROOT / "tests" / name) for name in target.tests]
    options = ["-q", "-x", "-p", "no:cacheprovider", "-m", "not slow and not learning"]
    return int(pytest.main([*options, *tests]))


@functools.cache
def drawn(name: str) -> list[int]:
    """Return the numbers of the mutants of a target that are drawn, in order."""
    target = TARGETS[name]
    count = mutated(target, None)[2]
    return rng(0).permutation(count)[: target.drawn].tolist()


def cases():
    """Yield each module as it is, then its mutants; those of quick tests first."""
    for name in TARGETS:
        yield f"{name} none"
        yield from (f"{name} {number}" for number in drawn(name))


def run(key: str, folder: Path):
    """Run the tests of a target with a mutant; tell whether they fail."""
    name, number = key.split()
    target = TARGETS[name]
    said = "as it is" if number == "none" else mutated(target, int(number))[1]
    env = os.environ | {"TMPDIR": str(folder), "HYPOTHESIS_STORAGE_DIRECTORY": str(folder)}
    if "geometry" in target.module:
        env["NUMBA_DISABLE_JIT"] = "1"
    process = subprocess.Popen(
        [sys.executable, __file__, name, number],
        env=env,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        cwd=ROOT,
    )
    try:
        text, _ = process.communicate(timeout=LIMIT_S)
        code = process.returncode
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        text, code = process.communicate()[0], 1
    if number == "none":
        assert code == 0, f"tests fail without a mutant: {text[-1500:]}"
        return {"runs": 0}
    assert code in {0, 1, 2, 4}, f"code {code}: {text[-1500:]}"
    return {"runs": 1, "killed": int(code != 0), "mutant": f"{target.module} {said}"}


ROW = Row("mutants", cases, run)

if __name__ == "__main__":
    sys.exit(main())
