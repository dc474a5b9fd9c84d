"""Draw a metric of training runs over their environment steps into one picture.

python examples/draw_curve.py runs/camp-0 runs/ppo-0 --out curve.png
python examples/draw_curve.py runs/camp-0 --metric episode/spl --out spl.png
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path

from internav_data.views import write_png
from internav_data.views.canvas import Canvas

WIDTH, HEIGHT = 1.6, 1.0
COLOURS = ((31, 111, 180), (196, 36, 111), (44, 154, 92), (217, 138, 0))
GREY, INK = (225, 225, 225), (60, 60, 60)


def points_of(run: Path, metric: str) -> list[tuple[float, float]]:
    """Return (environment steps, value) of a run's log; `a/b` is the value b of group a."""
    group, _, name = metric.partition("/")
    rows = [json.loads(line) for line in (run / "log.jsonl").read_text("utf-8").splitlines()]
    found = [(row["step"], row.get(group, {}).get(name)) for row in rows if "cloning" not in row]
    return [(step, value) for step, value in found if value is not None]


def ticks(max_steps: float) -> list[float]:
    """Return 0 and round numbers up to `max_steps`, seven of them at most."""
    size = 10.0 ** math.floor(math.log10(max_steps / 6))
    apart = next(times * size for times in (1, 2, 5, 10) if max_steps <= 6 * times * size)
    return [apart * k for k in range(int(max_steps / apart) + 1)]


def main() -> None:
    """Read the arguments and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--metric", default="episode/success")
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    curves = {run: points_of(run, options.metric) for run in options.runs}
    empty = [str(run) for run, points in curves.items() if not points]
    if empty:
        parser.error(f"{', '.join(empty)}: no {options.metric} in log.jsonl")
    steps = max(step for points in curves.values() for step, _ in points)
    top = max(1.0, *(value for points in curves.values() for _, value in points))

    canvas = Canvas((-0.2, -0.2), (WIDTH + 0.15, HEIGHT + 0.15), 900, (255, 255, 255))
    for k in range(6):
        y = HEIGHT * k / 5
        canvas.line([(0, y), (WIDTH, y)], GREY, 1)
        canvas.text((-0.09, y), f"{top * k / 5:.1f}", 11, INK)
    for tick in ticks(steps):
        canvas.text((WIDTH * tick / steps, -0.07), f"{tick / 1000:g}", 11, INK)
    canvas.text((WIDTH / 2, -0.15), "thousand environment steps", 11, INK)
    canvas.text((WIDTH / 2, HEIGHT + 0.08), options.metric, 13, INK)
    for k, (run, points) in enumerate(curves.items()):
        colour = COLOURS[k % len(COLOURS)]
        line = [(WIDTH * step / steps, HEIGHT * value / top) for step, value in points]
        canvas.line(line, colour, 2.5)
        canvas.text((0.05, HEIGHT - 0.06 * (k + 1)), run.name, 12, colour, anchor="left")
    write_png(options.out, canvas.finished())
    print(options.out)


if __name__ == "__main__":
    main()
