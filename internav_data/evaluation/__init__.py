"""Metrics, reference policies, tables, statistics and reports; no torch."""

from __future__ import annotations

from typing import TYPE_CHECKING

from internav_data.core.lazy import lazy_imports

if TYPE_CHECKING:
    from internav_data.evaluation.evaluator import EvaluationConfig, Policy, evaluate
    from internav_data.evaluation.metrics import EpisodeResult, Summary, summary
    from internav_data.evaluation.reference_policies import reference_policy

__all__ = [
    "EpisodeResult",
    "EvaluationConfig",
    "Policy",
    "Summary",
    "evaluate",
    "reference_policy",
    "summary",
]

__getattr__, __dir__ = lazy_imports(
    __name__,
    {
        "evaluator": ["EvaluationConfig", "Policy", "evaluate"],
        "metrics": ["EpisodeResult", "Summary", "summary"],
        "reference_policies": ["reference_policy"],
    },
)
