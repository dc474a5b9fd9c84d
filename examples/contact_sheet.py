"""Draw many scenes or episodes of a dataset into one picture.

python examples/contact_sheet.py data/mine houses.png
python examples/contact_sheet.py data/mine episodes.png --episodes --count 12
"""

from __future__ import annotations

import argparse
from pathlib import Path

from internav_data import load_dataset
from internav_data.views import contact_sheet, draw_episode, draw_house, write_png


def main() -> None:
    """Read the arguments and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("picture", type=Path)
    parser.add_argument("--episodes", action="store_true", help="one episode a scene")
    parser.add_argument("--count", type=int, default=12)
    parser.add_argument("--columns", type=int, default=4)
    parser.add_argument("--pixels", type=int, default=520, help="longer side of each plan")
    options = parser.parse_args()

    ds = load_dataset(options.dataset)
    if options.episodes:
        first = {e.scene_id: e for e in load_dataset(options.dataset, filters=[("index", "=", 0)])}
        images = [
            draw_episode(ds.scene(scene_id), first[scene_id], ds.assets, pixels=options.pixels)
            for scene_id in sorted(first)[: options.count]
        ]
    else:
        images = [
            draw_house(ds.scene(scene_id), pixels=options.pixels)
            for scene_id in sorted(ds.scene_ids)[: options.count]
        ]
    write_png(options.picture, contact_sheet(images, options.columns))
    print(f"{options.picture}: {len(images)} pictures")


if __name__ == "__main__":
    main()
