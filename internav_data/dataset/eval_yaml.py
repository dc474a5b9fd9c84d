"""eval.yaml: the tasks that Hugging Face's evaluation results of a dataset refer to.

The format is that of https://huggingface.co/docs/hub/eval-results: a model repository states its
scores in `.eval_results/*.yaml` by the dataset's name and a `task_id` of this file. A dataset
becomes a benchmark with a leaderboard once the hub has put it on its list.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from internav_data.dataset.manifest import Manifest

FRAMEWORK: Final = "internav-data"
"""Name of the program that measures: `camp-eval`."""
TASKS: Final = {
    "success_rate": "SR: share of episodes that end within reach of the goal by Done",
    "spl": "SPL: success weighted by the length of the path",
    "sts": "STS: success weighted by the number of steps",
    "fdt": "FDT: mean final distance to the target, metres; less is better",
}
"""Metric by task id, as `camp-eval` prints it; one leaderboard each."""


def eval_text(manifest: Manifest) -> str:
    """Return eval.yaml of a dataset: a task for each metric, on the test split if there is one."""
    splits = [split for split in ("test", "val", "train") if manifest.of("episodes", split)]
    lines = [
        "name: Interactive navigation episodes",
        "description: >",
        "  An agent reaches a goal in a furnished house; obstacles block or lengthen its path,",
        "  and it may push them aside or carry them away. Measured by camp-eval RUN DATASET.",
        f"evaluation_framework: {FRAMEWORK}",
        "",
        "tasks:",
    ]
    for task, meaning in TASKS.items():
        lines += [f"  - id: {task}  # {meaning}", "    config: episodes"]
        lines.append(f"    split: {splits[0] if splits else 'test'}")
    return "\n".join(lines) + "\n"
