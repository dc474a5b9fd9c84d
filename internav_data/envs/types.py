"""Types shared by environments and their callers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from internav_data.core.typing import Bools, Floats

    Observations = Mapping[str, NDArray[Any]]
    """Observations of n environments by sensor: arrays (n, …)."""
    Actions = NDArray[np.int64]
    """Actions of n environments, (n,): 0 … 11, or -1 to wait."""
    Stepped = tuple[Observations, Floats, Bools, Bools, dict[str, Any]]
    """Result of `VectorEnv.step`: observations, rewards, terminated, truncated, infos."""
