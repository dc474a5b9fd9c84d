"""Write into README and docs what the code says: settings, commands, pictures.

    python docs/update.py             # texts
    python docs/update.py --pictures  # and the pictures

`tests/test_docs.py` fails when the texts are out of date.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from internav_cli.main import COMMANDS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from internav_data.records import Asset, Episode, House

ROOT = Path(__file__).resolve().parents[1]
PICTURED = (14, 4)
"""Scene and episode of the picture, in the dataset that ships."""
FILMED = (2, 2)
"""Scene and episode of the replay."""


def settings() -> str:
    """Return all settings with their defaults."""
    from internav_data.core.config import config_toml  # noqa: PLC0415
    from internav_data.generation import GenerationConfig  # noqa: PLC0415 - --pictures needs more

    return f"```toml\n{config_toml(GenerationConfig()).strip()}\n```"


def training_settings() -> str:
    """Return all settings of `camp-train`, those of both presets side by side."""
    from internav_data.camp.config import CampConfig, preset  # noqa: PLC0415 - --pictures needs more
    from internav_data.core.config import settings_notes  # noqa: PLC0415

    small, paper, notes = preset("small"), preset("paper"), settings_notes(CampConfig)
    single, parts = [], []
    for field in dataclasses.fields(CampConfig):
        one, two = getattr(small, field.name), getattr(paper, field.name)
        if not dataclasses.is_dataclass(one):
            single.append(_setting(field.name, one, two, notes[field.name]))
            continue
        rows = [*_HEAD, *_rows(field.name, one, two)]
        parts.append("\n".join([f"**`{field.name}`** {_line(notes[field.name])}", "", *rows]))
    return "\n\n".join(["\n".join([*_HEAD, *single]), *parts])


_HEAD = ("| | `small` | `paper` | |", "|---|---|---|---|")


def _rows(prefix: str, one: Any, two: Any) -> Iterator[str]:  # noqa: ANN401 - parts of a config
    from internav_data.core.config import settings_notes  # noqa: PLC0415

    notes = settings_notes(type(one))
    for field in dataclasses.fields(one):
        values = getattr(one, field.name), getattr(two, field.name)
        yield _setting(f"{prefix}.{field.name}", *values, notes[field.name])


def _setting(key: str, one: object, two: object, note: str) -> str:
    cells = ("none" if value is None else json.dumps(value) for value in (one, two))
    return " | ".join([f"| `{key}`", *cells, f"{_line(note)} |"])


def _line(note: str) -> str:
    return " ".join(note.split()).replace("|", "\\|")


def actions() -> str:
    """Return the table of actions."""
    from internav_data.world import Action  # noqa: PLC0415 - seconds

    rows = [
        f"| {int(a)} | {a.label} | {a.description} |".replace("| -", "| −")  # noqa: RUF001 - minus
        for a in Action
    ]
    return "\n".join(["| | action | effect |", "|---|---|---|", *rows])


def room_types() -> str:
    """Return the room types in one line."""
    from internav_data.houses.room_types import ROOM_TYPES  # noqa: PLC0415

    return f"- Types: {', '.join(sorted(ROOM_TYPES))}. Up to 40 rooms."


def methods() -> str:
    """Return the table of methods."""
    from internav_data.camp.agents import AGENTS  # noqa: PLC0415 - torch

    rows = [
        f"| `{name}` | {method.description} | {method.privileged} |"
        for name, method in AGENTS.items()
    ]
    own = "| NAME | [your own](#your-own-agent) | depends on its `sensors` |"
    return "\n".join(["| `--method` | | privileged input |", "|---|---|---|", *rows, own])


def sensors() -> str:
    """Return the table of sensors."""
    from gymnasium import spaces  # noqa: PLC0415 - seconds

    from internav_data.envs.sensors import SENSORS  # noqa: PLC0415

    size = 987  # stands for S: no bound or channel count is the same number
    rows = []
    for sensor in SENSORS.values():
        space = sensor.space(size)
        if isinstance(space, spaces.Box):
            bounds = _bounds(space.low.ravel().tolist()), _bounds(space.high.ravel().tolist())
        else:
            bounds = "0", str(int(space.n) - 1)  # type: ignore[attr-defined] # a Discrete
        shape = f"{space.shape} ".replace(str(size), "S") if space.shape else ""
        key = f"| `{sensor.name}` | {shape}{space.dtype}"
        rows.append(" | ".join([key, sensor.unit, *bounds, f"{sensor.description} |"]))
    head = ["| key | shape, type | unit | min | max | |", "|---|---|---|---|---|---|"]
    return "\n".join([*head, *rows]).replace("|  |", "| |")


def _bounds(values: list[float]) -> str:
    """Write bounds: one for all elements, or one each."""
    words = []
    for value in dict.fromkeys(values):
        number = "π" if math.isclose(abs(value), math.pi, abs_tol=1e-6) else f"{abs(value):.0f}"
        words.append(f"−{number}" if value < 0 else number)  # noqa: RUF001 - minus
    return ", ".join(words)


def commands() -> str:
    """Return the commands as a table."""
    rows = [f"| `internav-gen {name}` | {text} |" for name, text in COMMANDS.items()]
    return "\n".join(["| | |", "|---|---|", *rows])


def replaced(text: str, name: str, content: str) -> str:
    """Put generated text between its two markers."""
    begin, end = f"<!-- {name}: written by docs/update.py -->", f"<!-- end of {name} -->"
    before, _, rest = text.partition(begin)
    _, _, after = rest.partition(end)
    return f"{before}{begin}\n{content}\n{end}{after}"


def updated() -> dict[Path, str]:
    """Return texts as they should be."""
    readme, configuration = ROOT / "README.md", ROOT / "docs" / "configuration.md"
    training, environment = ROOT / "docs" / "training.md", ROOT / "docs" / "environment.md"
    plans, written = ROOT / "docs" / "floor-plans.md", training.read_text(encoding="utf-8")
    return {
        readme: replaced(readme.read_text(encoding="utf-8"), "commands", commands()),
        configuration: replaced(configuration.read_text(encoding="utf-8"), "settings", settings()),
        plans: replaced(plans.read_text(encoding="utf-8"), "room types", room_types()),
        environment: replaced(
            replaced(environment.read_text(encoding="utf-8"), "actions", actions()),
            "sensors",
            sensors(),
        ),
        training: replaced(
            replaced(written, "training settings", training_settings()), "methods", methods()
        ),
    }


def draw_pictures() -> None:
    """Draw the pictures of README and tutorial, of the dataset that ships."""
    import cv2  # noqa: PLC0415 - seconds, all of these

    from internav_data.catalog import catalogue  # noqa: PLC0415
    from internav_data.views import draw_episode, replay_frames, write_png, write_video  # noqa: PLC0415
    from internav_data.views.asset_sheet import draw_asset_sheet  # noqa: PLC0415

    picture = draw_episode(*of_the_shipped(*PICTURED), pixels=1000)
    write_png(ROOT / "docs" / "episode.png", picture)
    frames = replay_frames(*of_the_shipped(*FILMED), size=280, fps=5.0)
    write_video(ROOT / "docs" / "replay.gif", frames, 5.0)
    sheet = draw_asset_sheet(catalogue())
    height, width = sheet.shape[:2]
    smaller = cv2.resize(sheet, (1000, round(1000 * height / width)), interpolation=cv2.INTER_AREA)
    write_png(ROOT / "docs" / "catalogue.png", smaller)


def of_the_shipped(scene: int, index: int) -> tuple[House, Episode, dict[str, Asset]]:
    """Return house, episode and assets of an episode of `mini`."""
    from internav_data import load_dataset  # noqa: PLC0415

    wanted = f"scene-{scene:06}/{index:04}"
    (episode,) = dataset = load_dataset("mini", filters=[("episode_id", "=", wanted)])
    return dataset.scene(episode.scene_id), episode, dataset.assets


def main() -> None:
    """Write what has changed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", action="store_true")
    options = parser.parse_args()
    for path, text in updated().items():
        path.write_text(text, encoding="utf-8")
    if options.pictures:
        draw_pictures()


if __name__ == "__main__":
    main()
