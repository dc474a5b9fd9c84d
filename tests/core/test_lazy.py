"""Lazy imports: nothing is imported before its name is used."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module

import pytest

PACKAGES = ("", ".camp", ".envs", ".episodes", ".generation", ".houses", ".views")
SHOP = """
from internav_data.core.lazy import lazy_imports

__all__ = ["apple"]
__getattr__, __dir__ = lazy_imports(__name__, {"fruit": ["apple", "pear"]})
"""


def test_modules_are_imported_at_the_first_use_of_a_name(tmp_path):
    package = tmp_path / "shop"
    package.mkdir()
    (package / "__init__.py").write_text(SHOP)
    (package / "fruit.py").write_text("apple, pear = 1, 2\n")
    code = """
import sys, shop
assert {"apple", "pear", "__all__"} <= set(dir(shop))
assert "shop.fruit" not in sys.modules
from shop import apple
assert (apple, shop.pear) == (1, 2)
assert "shop.fruit" in sys.modules
try:
    shop.plum
except AttributeError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(tmp_path)!r})\n{code}"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "module 'shop' has no attribute 'plum'\n"


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_there(package):
    pytest.importorskip("click", reason="the extra 'generate' is not installed")
    for needed in ("gymnasium", "torch", "safetensors"):
        pytest.importorskip(needed, reason="the extra 'train' is not installed")
    module = import_module(f"internav_data{package}")
    names = set(getattr(module, "__all__", ()))
    assert names <= set(dir(module))
    for name in names:
        assert getattr(module, name) is not module
