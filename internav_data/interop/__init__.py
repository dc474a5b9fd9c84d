"""Importers and exporters: other programs' places and formats."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports

if TYPE_CHECKING:
    from internav_data.interop.hub import UploadPlan, plan_upload, upload

__all__ = ["UploadPlan", "plan_upload", "upload"]

__getattr__, __dir__ = lazy_imports(__name__, {"hub": ["UploadPlan", "plan_upload", "upload"]})
