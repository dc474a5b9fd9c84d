"""Names of array types, for annotations only."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Bools: TypeAlias = NDArray[np.bool_]
    Costs: TypeAlias = NDArray[np.int32]
    """Costs of poses or nodes, in the unit that the planner states."""
    Floats: TypeAlias = NDArray[np.float64]
    Image: TypeAlias = NDArray[np.uint8]
    """Colours 0 … 255, RGB along the last axis."""
    Ints: TypeAlias = NDArray[np.int64]
    Ints32: TypeAlias = NDArray[np.int32]
    Masks: TypeAlias = NDArray[np.uint8]
    """Booleans as bytes, as kernels take them."""
    Singles: TypeAlias = NDArray[np.float32]
