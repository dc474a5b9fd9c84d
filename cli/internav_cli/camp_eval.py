"""`camp-eval`."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from internav_cli.main import launch
from internav_cli.options import DATASET, JSON, dataset_to_read, positive

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from internav_data.camp.policy import EvaluatedPolicy
    from internav_data.dataset import Dataset
    from internav_data.evaluation.archive import Evaluation
    from internav_data.evaluation.evaluator import EvaluationConfig
    from internav_data.evaluation.statements import Methods

BUSY = "another camp-eval writes into this folder; wait for it to end, or choose another --out"
"""Reason for which a second process is refused."""
_REPORT = "report.html"


class Commands(click.Group):
    """Takes what is no command for a RUN to evaluate."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put `evaluate` before a RUN."""
        own = {"--help", "-h", "--version", "--debug"}
        first = next((k for k, word in enumerate(args) if word not in own), None)
        if first is not None and args[first] not in self.commands and "--version" not in args:
            args = [*args[:first], "evaluate", *args[first:]]
        return super().parse_args(ctx, args)


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  camp-eval runs/camp-0                                a trained run on the test split
  camp-eval runs/camp-0 data/mine                      on another dataset
  camp-eval expert,blind,shortest_path,random          what bounds every column
  camp-eval compare runs/camp-* runs/ppo-*             methods against each other, over seeds
  camp-eval evaluate --help                            all options of the first two

\b
Exit codes: 0 good, 1 error, 2 usage, 5 corrupt data, 129/130/143 interrupted.""",
)
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
@click.version_option(package_name="internav-data", prog_name="camp-eval")
def cli(*, debug: bool) -> None:
    """Measure agents like the paper: `camp-eval RUN [DATASET]`, `camp-eval compare RUN...`."""


@cli.command(
    "evaluate",
    epilog="""\b
Examples:
  camp-eval runs/camp-0
  camp-eval runs/camp-0 data/mine --greedy --video --out results/greedy
  camp-eval runs/camp-0 data/mine --filter "room_count<=3" --filter "mode=blocked"
  camp-eval expert,blind,shortest_path data/mine --split val --limit 200

\b
RUN is a folder that camp-train wrote, or some of expert, blind, shortest_path,
random with commas between them. DATASET defaults to the folder that INTERNAV_DATASET names,
else internav-dataset. Written: episodes.parquet and evaluation.json for each,
tables.md, tables.json, report.html.""",
)
@click.argument("run")
@DATASET
@click.option(
    "--split",
    type=click.Choice(["train", "val", "test", "all"]),
    default="test",
    show_default=True,
    help="Split to evaluate on.",
)
@click.option(
    "--filter",
    "conditions",
    multiple=True,
    metavar="COLUMN=VALUE",
    help="Only such episodes, as in room_count<=3; != < > >= and 'expert is not null' too."
    "  [repeatable]",
)
@click.option(
    "--episodes-per-scene",
    type=int,
    callback=positive,
    help="Only the first episodes of each house, at most this many.",
)
@click.option(
    "--limit", type=int, callback=positive, help="A fixed random choice of this many episodes."
)
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of drawn actions.")
@click.option("--greedy", is_flag=True, help="Take the likeliest actions, draw none.")
@click.option("--without-intent", is_flag=True, help="Feed the trained agent no intent (Table 4).")
@click.option(
    "--max-steps",
    type=int,
    default=500,
    show_default=True,
    help="Steps after which an episode is cut off.",
)
@click.option(
    "--batch", type=int, default=16, show_default=True, help="Episodes played side by side."
)
@click.option(
    "--workers",
    type=int,
    default=0,
    help="Processes that step episodes; they change no number.  [default: none]",
)
@click.option(
    "--reference-policies/--no-reference-policies",
    default=True,
    help="Whether tables have rows of expert and shortest_path.  [default: they do]",
)
@click.option("--video", is_flag=True, help="Film the best, the median and the worst episode.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder to write.  [default: RUN/evaluation-SPLIT; ./evaluation-SPLIT without a run]",
)
@click.option("--force", is_flag=True, help="Write over an evaluation that is there.")
@JSON
def evaluate_command(**given: Any) -> int:  # noqa: ANN401 - the options above
    """Let RUN play DATASET, and print the paper's tables."""
    from internav_data.core.extras import require

    require("cv2", "scipy")  # of tables and page, when all has been played
    from internav_data.camp.policy import candidate, reference_policies_beside
    from internav_data.core.storage import lock_folder
    from internav_data.evaluation.report import methods_of

    names, run = _who(given["run"])
    out = given["out"] or (run or Path()) / f"evaluation-{given['split']}"
    _check_out(out, force=given["force"])
    dataset, settings = _dataset(given), _settings(given)
    settings.check()
    if run is not None and given["reference_policies"]:
        names = [*names, *reference_policies_beside(dataset)]
    greedy, cut = given["greedy"], given["without_intent"]
    candidates = [
        candidate(name, dataset, settings, greedy=greedy, without_intent=cut) for name in names
    ]
    logs = {} if run is None else {run.name: run}
    with lock_folder(out, BUSY):
        _check_out(out, force=given["force"])  # another may have ended just before
        found = _evaluate(candidates, dataset, settings, out, film=given["video"])
        _write(out, methods_of(found), dataset, logs, as_json=given["as_json"])
    return 0


def _evaluate(
    candidates: Sequence[EvaluatedPolicy],
    dataset: Dataset[Any],
    settings: EvaluationConfig,
    out: Path,
    *,
    film: bool,
) -> list[Evaluation]:
    """Evaluate policies, and write their results into a folder."""
    from internav_data.evaluation.archive import (
        Evaluation,
        folder_name,
        forget_evaluations,
        write_evaluation,
    )
    from internav_data.evaluation.evaluator import evaluate
    from internav_data.evaluation.videos import videos

    found = []
    for each in candidates:
        results = evaluate(each.policy, dataset, settings, _reporter(each.about.name))
        found.append(Evaluation(each.about, tuple(results)))
    forget_evaluations(out)
    for evaluation in found:
        folder = out / folder_name(evaluation.about.name)
        write_evaluation(folder, evaluation.about, evaluation.results)
    if film:
        first = candidates[0].policy
        for path in videos(out / "videos", first, found[0].results, dataset, settings):
            click.echo(f"wrote {path}", err=True)
    return found


@cli.command(
    "compare",
    epilog="""\b
Examples:
  camp-eval compare runs/camp-* runs/ppo-*
  camp-eval compare results/a results/b --dataset data/mine --out results/both

\b
RUN is a run that was evaluated, or a folder that camp-eval wrote. Between methods
training seeds are the unit; with one run each, only these checkpoints are compared.""",
)
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--dataset",
    "data",
    type=click.Path(path_type=Path),
    help="Dataset of the episodes; with it the report draws some of them.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder to write.  [default: none]")
@click.option("--force", is_flag=True, help="Write over a comparison that is there.")
@JSON
def compare_command(
    *, runs: tuple[Path, ...], data: Path | None, out: Path | None, force: bool, as_json: bool
) -> int:
    """Lay evaluations side by side, and say what they can tell."""
    from internav_data.core.storage import lock_folder

    if out is None:
        return _compare(runs, data, None, as_json=as_json)
    _check_out(out, force=force)
    with lock_folder(out, BUSY):
        return _compare(runs, data, out, as_json=as_json)


def _compare(runs: tuple[Path, ...], data: Path | None, out: Path | None, *, as_json: bool) -> int:
    from internav_data.evaluation.archive import find_evaluations, read_evaluation
    from internav_data.evaluation.report import methods_of

    folders = [folder for run in runs for folder in find_evaluations(run)]
    methods = methods_of([read_evaluation(folder) for folder in dict.fromkeys(folders)])
    dataset = None if data is None else _same_dataset(data, next(iter(methods.values()))[0])
    _write(out, methods, dataset, {run.name: run for run in runs}, as_json=as_json)
    return 0


def _who(run: str) -> tuple[list[str], Path | None]:
    """Return names to evaluate, and the run's folder where it is one."""
    from internav_data.evaluation.reference_policies import REFERENCE_POLICIES

    names = [name.strip() for name in run.split(",")]
    if all(name in REFERENCE_POLICIES for name in names):
        return list(dict.fromkeys(names)), None
    return [run], Path(run)


def _dataset(given: dict[str, Any]) -> Dataset[Any]:
    from internav_data.dataset import load_dataset
    from internav_data.dataset.select import condition

    filters = [condition(text) for text in given["conditions"]]
    if given["episodes_per_scene"] is not None:
        filters.append(("index", "<", given["episodes_per_scene"]))
    split = None if given["split"] == "all" else given["split"]
    return load_dataset(dataset_to_read(given["dataset"], solves=True), split, filters or None)


def _settings(given: dict[str, Any]) -> EvaluationConfig:
    from internav_data.evaluation.evaluator import EvaluationConfig

    names = ("seed", "batch", "workers", "max_steps", "limit")
    return EvaluationConfig(**{name: given[name] for name in names})


def _same_dataset(path: Path, evaluation: Evaluation) -> Dataset[Any]:
    from internav_data.dataset import load_dataset
    from internav_data.records.errors import UsageError

    split = evaluation.about.split
    dataset = load_dataset(path, None if split == "all" else split)
    known = set(dataset.to_table(["episode_id"]).column("episode_id").to_pylist())
    if any(result.episode_id not in known for result in evaluation.results):
        raise UsageError(f"{path}: --dataset: these runs were evaluated on another one")
    return dataset


def _check_out(out: Path, *, force: bool) -> None:
    from internav_data.evaluation.archive import ABOUT
    from internav_data.records.errors import UsageError

    if out.exists() and not out.is_dir():
        raise UsageError(f"{out}: --out: expected a folder, this is a file")
    there = [*out.glob(f"*/{ABOUT}"), *out.glob(_REPORT), *out.glob("tables.*")]
    if there and not force:
        raise UsageError(
            f"{out}: an evaluation is there already; choose another --out, or pass --force"
        )


def _reporter(name: str) -> Callable[[int, int], None]:
    """Return a function that shows the number of finished episodes, the rate and the time left."""
    from internav_data.core.progress import ProgressLine, clock

    line, began = ProgressLine(sys.stderr), time.monotonic()

    def report(done: int, total: int) -> None:
        if done == total:
            line.end()
        elif line.due():
            spent = max(time.monotonic() - began, 1e-9)
            left = clock((total - done) * spent / done)
            line.update(
                f"{name}: {done}/{total} episodes ({done / total:.0%}), "
                f"{done / spent:.1f} episodes/s, {left} left"
            )

    return report


def _write(
    out: Path | None,
    methods: Methods,
    dataset: Dataset[Any] | None,
    runs: Mapping[str, Path],
    *,
    as_json: bool,
) -> None:
    """Print the tables, and write them where there is a folder to."""
    import json

    from internav_data.evaluation.report import (
        data_of,
        find_log,
        read_log,
        text_of,
        write_page,
        write_texts,
    )

    if out is not None:
        write_texts(out, methods)
        found = {name: find_log(run) for name, run in runs.items() if run.is_dir()}
        logs = {name: read_log(path) for name, path in found.items() if path is not None}
        write_page(out / _REPORT, methods, dataset, logs)
        click.echo(f"wrote {out / _REPORT}", err=True)
    if as_json:
        click.echo(json.dumps(data_of(methods), indent=2, ensure_ascii=False, allow_nan=False))
    else:
        click.echo(text_of(methods))


def main(arguments: list[str] | None = None) -> None:
    """Run `camp-eval` and exit with its code."""
    launch(cli, "camp-eval", arguments)
