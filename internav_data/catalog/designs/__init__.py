"""Designs: how each type of thing looks. One function a type draws on a sketch pad.

A design gets the sketch, width, depth and height in metres and dice for its choices; `fitted`
stretches the drawing to the asked size, so that a design may be a little off.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from internav_data.catalog.sampling import UniformSampler
    from internav_data.catalog.shapes import Sketch

    Design = Callable[[Sketch, float, float, float, UniformSampler], None]
