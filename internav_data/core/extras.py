"""Third-party packages by the extra that installs them, and the hint where one is missing."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Final

EXTRAS: Final = {
    "numpy": "",
    "pyarrow": "",
    "click": "generate",
    "mujoco": "generate",
    "numba": "generate",
    "networkx": "generate",
    "cv2": "generate",
    "platformdirs": "generate",
    "scipy": "generate",
    "shapely": "generate",
    "trimesh": "generate",
    "pybullet": "bullet",
    "coacd": "meshes",
    "rtree": "meshes",
    "gymnasium": "train",
    "safetensors": "train",
    "torch": "train",
    "tensorboard": "tensorboard",
    "huggingface_hub": "hub",
    "ray": "ray",
}
"""Extra that installs each module on every machine; none for what every installation has."""
DISTRIBUTIONS: Final = {"cv2": "opencv-python-headless", "mujoco": "mujoco-core"}
"""Names of modules at the package index, where they differ."""


def install_command(module: str) -> str:
    """Return the command that installs a module: the extra that brings it, if one does."""
    extra = EXTRAS.get(module)
    if extra is None:
        return f"pip install {module}"
    return f"pip install 'internav-data[{extra}]'" if extra else "pip install internav-data"


def missing(module: str | None) -> ModuleNotFoundError:
    """Return the error of a missing module, with the command that installs it."""
    module = (module or "a module").partition(".")[0]
    hint = f"{module} is missing: {install_command(module)}"
    return ModuleNotFoundError(hint, name=module)


def require(*modules: str) -> None:
    """Check that modules of extras are installed; none is imported.

    Raises
    ------
    ModuleNotFoundError
        One is missing; the message has the command that installs it.
    """
    for module in modules:
        if find_spec(module) is None:
            raise missing(module)
