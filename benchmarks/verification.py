"""Rate of validation: episodes/s a core at each level, JSON on stdout.

    python benchmarks/verification.py [--dataset DIR] [--scenes 24] [--out FILE]

Without a dataset one of so many scenes x 10 episodes is generated first. One process; seconds are
processor time, so that other work on the machine counts little; each level runs those before it.
Exits 1 if the dataset is not valid.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from internav_data.generation import GenerationConfig, generate
from internav_data.verification import LEVELS, validate

EPISODES_A_SCENE = 10


def measure(dataset: Path) -> dict[str, Any]:
    """Validate a dataset at each level and say how long it took."""
    validate(dataset, "physics", sample=1)  # imports and caches are not what is measured
    out: dict[str, Any] = {}
    before = 0.0
    for level in LEVELS:
        begin = time.process_time()
        findings = validate(dataset, level)
        seconds = time.process_time() - begin
        rows = findings.checked["rows"]
        out[level] = {
            "ok": findings.ok,
            "checked": findings.checked,
            "seconds": round(seconds, 3),
            "seconds_of_this_level_alone": round(seconds - before, 3),
            "rows_per_second": round(rows / seconds, 1),
        }
        before = seconds
    episodes = out["geometry"]["checked"].get("episodes", 0)
    for level in LEVELS:
        out[level]["episodes_per_second_a_core"] = round(episodes / out[level]["seconds"], 1)
    return out


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dataset", type=Path, help="a dataset; none: one is generated")
    parser.add_argument("--scenes", type=int, default=24)
    parser.add_argument("--out", type=Path, help="write the JSON here too")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        dataset = options.dataset
        if dataset is None:
            dataset = Path(folder) / "dataset"
            config = GenerationConfig(episodes_per_scene=EPISODES_A_SCENE)
            generate(dataset, config, options.scenes, workers=1)
        result = measure(dataset)
    text = json.dumps({"benchmark": "verification", "levels": result}, indent=2)
    if options.out:
        options.out.write_text(text + "\n", encoding="utf-8")
    print(text)
    return 0 if all(level["ok"] for level in result.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
