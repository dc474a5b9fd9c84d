"""Statistics of houses, beside real homes, ProcTHOR and the paper's Table 2.

python benchmarks/houses.py [--scenes 300] [--out houses.json] [--set scale_large=1.05 ...]
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from statistics import mean, median
from typing import TYPE_CHECKING, Any

import numpy as np
from home_rules import area_spread, kept_rules, repeated_plans

from internav_data.catalog import catalogue
from internav_data.geometry import footprint
from internav_data.houses import HouseConfig, build_house
from internav_data.navigation import Lattice, room_of

if TYPE_CHECKING:
    from internav_data.records import House, Room

Result = dict[str, dict[str, dict[str, float]]]
"""Figures by name, by room type or count, and by kind of average."""

MEASURED = {
    "paper": {
        "house area by rooms (ProcTHOR, m2)": {
            1: 26, 2: 47, 3: 67, 4: 103, 5: 93, 6: 131, 8: 292, 10: 250,
        },
        "area by type (ProcTHOR, m2)": {"kitchen": 27, "living": 23, "bedroom": 28, "bathroom": 16},
        "lattice distance by class (Table 2, m)": {"1-2": 5.45, "3-5": 9.92, "6-10": 14.67},
        "rooms on path by class (Table 2)": {"1-2": 1.44, "3-5": 2.50, "6-10": 3.29},
    },
    "realistic": {
        "area by type (real, m2)": {
            "bedroom": "11.3 (5-17)", "bathroom": "3.3 (2-7.5)", "kitchen": "5.3-9",
            "living": "30 (19-48)",
        },
        "house area by bedrooms (real, m2)": {1: 50, 2: "61-70", 3: 86, 4: 99, 5: 103},
        "minima": "habitable 6.5 m2 and 2.13 m, hall 0.91 m, doors 0.77-0.96 m, ceilings 2.4-3.2 m",
    },
}  # fmt: skip
WANTED = {"paper": 0.95, "realistic": 0.99}
"""Share of rooms and things that keep each rule of `home_rules`."""
BUDGET_MS = {2: 20, 4: 40, 8: 80}


def size_class(rooms: int) -> str:
    return "1-2" if rooms <= 2 else "3-5" if rooms <= 5 else "6-10"


def shape_of(room: Room) -> float:
    xs, ys = [p[0] for p in room.polygon], [p[1] for p in room.polygon]
    w, h = max(xs) - min(xs), max(ys) - min(ys)
    return max(w, h) / min(w, h)


def covered(house: House, room: Room) -> float:
    """Floor area under things (bounding boxes of footprints), m2."""
    total = 0.0
    for thing in house.objects:
        asset = house.assets[thing.asset_id]
        if thing.room == room.room_id and thing.support < 0 and thing.z < 1.0 and asset.blocks:
            polygons = footprint(asset, thing.pose).vertices
            if len(polygons):
                total += float(np.prod(polygons.max(axis=0) - polygons.min(axis=0)))
    return total


def room_steps(house: House, a: int, b: int) -> int | None:
    """Count the rooms on the shortest room path."""
    seen, ring, steps = {a}, {a}, 1
    while b not in seen:
        ring = {
            n
            for edge in house.room_graph
            for m, n in (edge, edge[::-1])
            if m in ring and n not in seen
        }
        if not ring:
            return None
        seen |= ring
        steps += 1
    return steps


def paths(house: House, rng: np.random.Generator, draws: int = 12) -> list[tuple[float, int]]:
    """Return metres and rooms of random lattice paths between rooms (inside one-room houses)."""
    lattice = Lattice.of(house)
    components = lattice.components()
    labels, counts = np.unique(components[components >= 0], return_counts=True)
    nodes = np.argwhere(components == labels[counts.argmax()])
    rooms = [room_of(house, i * 0.25, j * 0.25) for i, j in nodes]
    out = []
    for _ in range(draws):
        for _ in range(50):
            a, b = (int(rng.random() * len(nodes)) for _ in range(2))
            if rooms[a] >= 0 and rooms[b] >= 0 and (len(house.rooms) == 1 or rooms[a] != rooms[b]):
                steps = int(lattice.distances(*map(int, nodes[a]))[tuple(nodes[b])])
                if steps * 0.25 >= 2.0:
                    out.append((steps * 0.25, room_steps(house, rooms[a], rooms[b])))
                    break
    return out


def survey(config: HouseConfig, scenes: int, seed: int) -> tuple[Result, list[House]]:
    """Build houses; return figures of them, and the houses."""
    assets, houses = catalogue(), []
    build_house(seed, 0, config, assets)
    table = defaultdict(lambda: defaultdict(list))
    rng = np.random.default_rng(0)
    for scene in range(scenes):
        started = time.process_time()
        house = build_house(seed, scene, config, assets)
        spent = 1000 * (time.process_time() - started)
        houses.append(house)
        rooms = len(house.rooms)
        table["CPU ms per house by rooms"][rooms].append(spent)
        table["house area by rooms (m2)"][rooms].append(house.area_m2)
        bedrooms = sum(r.type == "bedroom" for r in house.rooms)
        if rooms >= 4:
            table["house area by bedrooms (m2)"][bedrooms].append(house.area_m2)
        table["loops by class"][size_class(rooms)].append(len(house.room_graph) - rooms + 1)
        floor = sum(r.area_m2 for r in house.rooms)
        table["free floor share by class"][size_class(rooms)].append(
            1 - sum(covered(house, r) for r in house.rooms) / floor
        )
        for room in house.rooms:
            things = sum(t.room == room.room_id for t in house.objects)
            standing = sum(
                t.room == room.room_id and t.support < 0 and t.z < 1.0 for t in house.objects
            )
            degree = sum(room.room_id in edge for edge in house.room_graph)
            table["area by type (m2)"][room.type].append(room.area_m2)
            table["longest side over shortest by type"][room.type].append(shape_of(room))
            table["things a room by type"][room.type].append(things)
            table["things on the floor by type"][room.type].append(standing)
            table["doors a room by type"][room.type].append(degree)
            table["L-shaped share by type"][room.type].append(len(room.polygon) > 4)
        for metres, passed in paths(house, rng):
            table["lattice distance by class (m)"][size_class(rooms)].append(metres)
            table["rooms on path by class"][size_class(rooms)].append(passed)
    figures = {
        name: {
            str(key): {
                "mean": round(float(mean(values)), 3),
                "median": round(float(median(values)), 3),
                "min": round(float(min(values)), 3),
                "max": round(float(max(values)), 3),
                "n": len(values),
            }
            for key, values in sorted(rows.items(), key=lambda item: str(item[0]).zfill(8))
        }
        for name, rows in sorted(table.items())
    }
    return figures, houses


def homes(houses: list[House]) -> dict[str, Any]:
    """Return how many rooms and things keep each rule of a home, and how much plans vary."""
    areas = defaultdict(list)
    for house in houses:
        areas[len(house.rooms)].append(house.area_m2)
    return {
        "rules": {
            name: {"kept": kept, "of": of} for name, (kept, of) in kept_rules(houses).items()
        },
        "plans that repeat": repeated_plans(houses),
        "area, 95 % over 5 %, by rooms": {
            str(rooms): round(area_spread(values), 2) for rooms, values in sorted(areas.items())
        },
    }


def show_homes(preset: str, found: dict[str, Any]) -> None:
    print("\nrules of a home")
    for name, row in found["rules"].items():
        share = row["kept"] / max(1, row["of"])
        note = "" if share >= WANTED[preset] or not row["of"] else f"  wanted {WANTED[preset]:.0%}"
        print(f"  {name:<45} {row['kept']:5d} of {row['of']:5d}  {share:7.1%}{note}")
    for name in ("plans that repeat", "area, 95 % over 5 %, by rooms"):
        print(f"{name}: {found[name]}")


def show(preset: str, result: Result) -> None:
    print(f"\n=== {preset} ===")
    for name, rows in result.items():
        print(f"\n{name}")
        for key, row in rows.items():
            line = "  ".join(f"{k} {row[k]:8.2f}" for k in ("mean", "median", "min", "max"))
            print(f"  {key:>10}  {line}   n {row['n']}")
    print("\nbeside (MEASURED.md):")
    for name, value in MEASURED[preset].items():
        print(f"  {name}: {value}")


def levers(pairs: list[str]) -> dict[str, Any]:
    out = {}
    for text in pairs:
        name, _, value = text.partition("=")
        kind = type(getattr(HouseConfig(), name))
        out[name] = kind(value)
    return out


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--presets", default="paper,realistic")
    parser.add_argument("--out", help="also write the figures here, as JSON")
    parser.add_argument("--set", nargs="*", default=[], metavar="lever=value")
    arguments = parser.parse_args()
    results = {}
    for preset in arguments.presets.split(","):
        config = replace(HouseConfig(preset=preset), **levers(arguments.set))
        figures, houses = survey(config, arguments.scenes, arguments.seed)
        results[preset] = {**figures, "home": homes(houses)}
        show(preset, figures)
        show_homes(preset, results[preset]["home"])
    print(f"\nbudget, ms per house by rooms: {BUDGET_MS}")
    if arguments.out:
        text = json.dumps({"measured": MEASURED, "houses": results}, indent=1)
        Path(arguments.out).write_text(text, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
