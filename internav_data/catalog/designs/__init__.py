"""Designs of asset types: one function a type draws an asset on a sketch pad.

A design gets the sketch, the width, depth and height in metres and a sampler for its choices.
`Sketch.fitted` stretches the drawing to exactly that size, so that a design may be a little off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch

    Design = Callable[[Sketch, float, float, float, UniformSampler], None]
