"""README and docs agree with the code: commands, snippets, names, links."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from engines import bullet_only

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "internav_data"
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
SNIPPET = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def small_dataset(tmp_path_factory):
    from internav_data.generation import generate, load_config

    out = tmp_path_factory.mktemp("docs") / "dataset"
    # The loop over ranks shares these among eight; snippets ask for houses of four rooms.
    generate(out, load_config(overrides=["episodes_per_scene=4", "house.rooms=4"]), 4, workers=1)
    return out


@pytest.fixture(scope="module")
def small_run(tmp_path_factory):
    """A run that has not learnt anything yet."""
    from internav_data.camp.agents import make_agent
    from internav_data.camp.checkpoint import Checkpoint, save
    from internav_data.camp.config import preset

    run, config = tmp_path_factory.mktemp("docs-run"), preset("small")
    save(run, Checkpoint("camp", config, make_agent("camp", config).state_dict()))
    rows = [{"step": 64 * k, "episode": {"success": 0.1 * k}} for k in range(4)]
    (run / "log.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    return run


@bullet_only  # without it the tests have another default engine than the texts tell
def test_generated_texts_are_up_to_date():
    updated = runpy.run_path(str(ROOT / "docs" / "update.py"))["updated"]
    texts = updated()
    assert texts
    for path, text in texts.items():
        assert path.read_text() == text, "run `python docs/update.py`"


def test_the_pictures_of_the_tutorial_are_what_its_commands_draw():
    """Of today's `mini`: `python docs/update.py --pictures` draws them again."""
    import cv2

    from internav_data.views import draw_episode, replay_frames

    update = runpy.run_path(str(ROOT / "docs" / "update.py"))
    tutorial, of_the_shipped = (ROOT / "docs" / "tutorial.md").read_text(), update["of_the_shipped"]
    scene, index = update["PICTURED"]
    assert f"internav-gen show mini --scene {scene} --episode {index} " in tutorial
    drawn = draw_episode(*of_the_shipped(scene, index), pixels=1000)
    picture = cv2.imread(str(ROOT / "docs" / "episode.png"))[..., ::-1]
    assert abs(drawn.astype(int) - picture).mean() < 1
    scene, index = update["FILMED"]
    assert f"internav-gen replay mini {scene}/{index} " in tutorial
    first = next(iter(replay_frames(*of_the_shipped(scene, index), size=280, fps=5.0)))
    read, frame = cv2.VideoCapture(str(ROOT / "docs" / "replay.gif")).read()
    assert read
    assert abs(first.astype(int) - frame[..., ::-1]).mean() < 8  # a GIF has 256 colours


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
        assert (page.parent / target).exists(), target


def slug(heading):
    """A heading's anchor, as GitHub and the site make it."""
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_anchors_of_links_are_headings(page):
    for target, anchor in re.findall(r"\]\(([^)#:]*)#([^)]+)\)", page.read_text()):
        text = (page.parent / target).read_text() if target else page.read_text()
        headings = {slug(heading) for heading in re.findall(r"(?m)^#+ (.+)$", text)}
        assert anchor in headings, f"{target}#{anchor}"


@pytest.mark.parametrize("page", [p for p in PAGES if SNIPPET.search(p.read_text())], ids=str)
def test_python_in_the_docs_runs(page, small_dataset, small_run, monkeypatch):
    monkeypatch.setenv("INTERNAV_DATASET", str(small_dataset))
    for snippet in SNIPPET.findall(page.read_text()):
        code = snippet.replace("data/mine", str(small_dataset))
        code = code.replace("runs/camp-0", str(small_run))
        exec(compile(code, page.name, "exec"), {})  # noqa: S102 - our own words


def test_every_page_has_a_place_in_the_sites_contents():
    contents = (ROOT / "docs" / "index.md").read_text()
    listed = set(re.findall(r"(?m)^([\w-]+)$", contents))
    pages = {page.stem for page in (ROOT / "docs").glob("*.md")} - {"index"}
    assert pages <= listed, "put the page into a toctree of docs/index.md"
    assert listed <= pages


def commands_in(page):
    """Command lines of ours in a page."""
    text = re.sub(r"(?m)^torchrun .* -m internav_cli\.camp_train", "camp-train", page.read_text())
    return re.findall(
        r"^(?:internav-data|internav-gen|camp-eval|camp-train) .*$", text, re.MULTILINE
    )


def test_pages_have_commands_and_links():
    assert sum(len(commands_in(page)) for page in PAGES) > 20
    assert sum(page.read_text().count("](") for page in PAGES) > 20


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_commands_in_the_docs_exist_with_their_options(page):
    from click.testing import CliRunner
    from internav_cli import camp_eval, camp_train, data
    from internav_cli.main import cli

    for line in commands_in(page):
        words = re.split(r" +#|[|]|> ", line)[0].split()
        command, path = {
            "internav-data": (data.cli, words[1:2]),
            "internav-gen": (cli, words[1:2]),
            "camp-eval": (camp_eval.cli, ["compare" if words[1:2] == ["compare"] else "evaluate"]),
            "camp-train": (camp_train.command, []),
        }[words[0]]
        shown = CliRunner().invoke(command, [*path, "--help"]).output
        for option in (w for w in words[1:] if w.startswith("--")):
            assert option in shown, line


def test_an_example_floor_plan_can_be_built():
    from internav_data.houses import load_floor_plan

    assert len(load_floor_plan(ROOT / "examples" / "floor_plan.toml").types) == 6


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda p: p.stem)
def test_examples_run(example, small_dataset, small_run, tmp_path):
    if example.stem == "slurm_generate":
        pytest.importorskip("submitit")
    ranges = ["--scenes", "2", "--parts", "2", "--workers", "1", "--local"]
    tiny = ["network.image_size=16", "ppo.num_envs=4", "ppo.num_steps=8", "run.max_steps=8"]
    arguments = {
        "own_reward": [small_dataset, tmp_path / "run", *tiny, "stages.total_timesteps=64"],
        "draw_curve": [small_run, "--out", tmp_path / "curve.png"],
        "ship_agent": [small_run, tmp_path / "agent"],
        "contact_sheet": [small_dataset, tmp_path / "sheet.png", "--pixels", "120"],
        "stream_episodes": [small_dataset],
        "slurm_generate": [tmp_path / "d", *ranges, "--episodes-per-scene", "1"],
        "paths_in_a_house": ["--seed", "7", "--scene", "3"],
    }[example.stem]
    done = subprocess.run(
        [sys.executable, example, *map(str, arguments)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_the_agent_that_ships_plays(small_dataset):
    from internav_data import load_dataset
    from internav_data.camp.policy import candidate
    from internav_data.evaluation.evaluator import EvaluationConfig, evaluate

    dataset, settings = load_dataset(small_dataset), EvaluationConfig(limit=2, max_steps=20)
    shipped = ROOT / "examples" / "camp-small"
    found = candidate(str(shipped), dataset, settings, greedy=False, without_intent=False)
    assert (found.about.method, found.about.environment_steps) == ("camp", 60_416)
    assert len(evaluate(found.policy, dataset, settings)) == 2


def test_tests_named_in_durability_exist():
    """A row ends in `file.py::test_name`, below tests/; there may be several, with commas."""
    page = (ROOT / "docs" / "durability.md").read_text()
    rows = [line for line in page.splitlines() if line.startswith("| ") and "promise" not in line]
    for row in rows:
        named = re.findall(r"`([\w/]+\.py)::(\w+)`", row.split("|")[-2])
        assert named, f"no test: {row}"
        for file, name in named:
            assert f"def {name}(" in (ROOT / "tests" / file).read_text(), (file, name)


def test_tests_named_in_the_architecture_exist():
    named = re.findall(r"`(test_\w+)` \((tests/[\w/.]+)\)", (ROOT / "ARCHITECTURE.md").read_text())
    assert len(named) > 20
    for name, path in named:
        assert f"def {name}(" in (ROOT / path).read_text(), name


@pytest.mark.parametrize(
    ("pattern", "number"),
    [
        (r"the (\w+) obstacles$", "spawnable assets"),
        (r"of the (\w+) types that can be pushed", "types of obstacles"),
    ],
)
def test_numbers_in_the_docs_are_those_of_the_code(pattern, number):
    from internav_data.catalog import OBSTACLES, catalogue

    true = {
        "spawnable assets": str(len(catalogue().spawnable)),
        "types of obstacles": str(len(OBSTACLES)),
    }[number]
    counted = 0
    for page in (page for page in PAGES if page.name != "CHANGELOG.md"):
        for line in page.read_text().splitlines():
            for said in re.findall(pattern, line):
                if said.isdecimal():
                    counted += 1
                    assert said == true, f"{page.name}: {line}"
    assert counted


def test_no_text_says_how_many_actions_there_are():
    """The number lives in `ACTIONS`, so that a new action is no change of prose."""
    sources = [
        path for room in ("internav_data", "cli", "benchmarks") for path in
        sorted((ROOT / room).rglob("*.py"))
    ]  # fmt: skip
    for page in [*PAGES, *sources]:
        if page.name == "CHANGELOG.md":
            continue
        text = " ".join(page.read_text().split())
        found = re.search(r"\b(?:twelve|thirteen|12|13) (?:discrete )?actions\b", text)
        assert not found, f"{page}: {text[found.start() - 60 : found.end()]}"


def table_rows(page):
    """Cells of every row of the page's tables, without heads and lines below them."""
    lines = [line for line in (ROOT / page).read_text().splitlines() if line.startswith("| ")]
    rows = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines]
    return [row for row in rows if row[0] not in {"term", "step", "to add", "invariant"}]


def defines(path, name):
    """Return whether a module, or one in a folder, defines a name, a column or an option."""
    modules = sorted(path.rglob("*.py")) if path.is_dir() else [path]
    pattern = rf"^ *(def|class) {name}\b|^ *(self\.)?{name}\b *[:=]|[\"']{name}[\"']"
    return any(re.search(pattern, module.read_text(), re.MULTILINE) for module in modules)


def test_functions_named_in_the_architecture_exist():
    named = [row for row in table_rows("ARCHITECTURE.md") if len(row) == 3]
    assert len(named) > 30
    for _, name, path in named:
        assert defines(PACKAGE / path.strip("`"), name.strip("`")), f"{path} defines no {name}"


def test_names_in_the_glossary_exist_where_it_says():
    rows = table_rows("docs/glossary.md")
    assert len(rows) > 150
    for term, _, _, where in rows:
        paths = [PACKAGE / path for path in re.findall(r"`([^`]+)`", where)]
        assert paths, term
        for path in paths:
            assert path.exists(), f"{term}: {path}"
        for name in re.findall(r"`(\w+)`", term):
            assert any(defines(path, name) for path in paths), f"{name} is not in {where}"


def test_names_in_definitions_of_the_glossary_exist():
    sources = [path.read_text() for path in PACKAGE.rglob("*.py")]
    words = set(re.findall(r"\w+", " ".join(sources)))
    for term, definition, _, _ in table_rows("docs/glossary.md"):
        for name in re.findall(r"`([\w.]+)`", definition):
            assert set(name.split(".")) <= words, f"{term}: no {name} in the package"
