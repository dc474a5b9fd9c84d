"""`camp-train`."""

from __future__ import annotations

import json
import shlex
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from internav_cli.main import launch
from internav_cli.options import DATASET, JSON, dataset_to_read
from internav_data.core.machine import keep_freed_memory

if TYPE_CHECKING:
    from internav_data.camp.config import CampConfig
    from internav_data.camp.train import Request

_SETTINGS = {
    "seed": "seed",
    "conditions": "data.filter",
    "intent": "agent.intent",
    "sync_every": "agent.sync_every",
    "steps": "stages.total_timesteps",
    "workers": "run.workers",
}
"""Options that are settings, and their keys."""


@click.command(
    "camp-train",
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  camp-train                                              CaMP from scratch, into runs/camp-0
  camp-train --pretrain bc --steps 100000                 clone the dataset's expert first
  camp-train data/mine --method ppo --seed 1 --out runs/ppo-1
  camp-train data/mine --filter "shortest_path_m<=6" --set run.max_steps=200
  camp-train --dry-run                                    how long it would take
  camp-train --out runs/camp-0 --resume                   go on after Ctrl-C
  camp-train --out runs/camp-0 --resume --steps 600000    more steps, for the last stage
  camp-train --print-config > mine.toml                   all settings, to be changed
  torchrun --nproc-per-node 2 -m internav_cli.camp_train data/mine   several GPUs

\b
Ctrl-C finishes the update, saves and exits with 130; a second one leaves the
last checkpoint as it is. Measure what was trained by camp-eval RUN.
DATASET defaults to the folder that INTERNAV_DATASET names, else internav-dataset.
Exit codes: 0 good, 1 error, 2 usage, 5 corrupt data, 6 NaN or infinity,
129/130/143 interrupted.""",
)
@DATASET
@click.option(
    "--method",
    help="Agent to train: camp, a baseline of it (docs/training.md), or your own.  [default: camp]",
)
@click.option(
    "--out", type=click.Path(path_type=Path), help="The run's folder.  [default: runs/METHOD-SEED]"
)
@click.option(
    "--preset",
    type=click.Choice(["small", "paper"]),
    help="Sizes and schedule.  [default: paper with a GPU, else small]",
)
@click.option(
    "--config",
    "config_file",
    type=click.Path(path_type=Path),
    help="TOML file with any of the settings that --print-config lists.",
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="One setting, as in --set ppo.num_steps=32; wins over the file.  [repeatable]",
)
@click.option("--seed", type=int, help="Every random number derives from it.  [default: 0]")
@click.option(
    "--steps",
    type=int,
    help="Environment steps of all stages together; with --resume, those above the run's go to its "
    "last stage.",
)
@click.option(
    "--filter",
    "conditions",
    multiple=True,
    metavar="COLUMN=VALUE",
    help="Only these episodes, as in room_count<=3; != < > >= and 'expert is not null' too."
    "  [repeatable]",
)
@click.option(
    "--stages",
    metavar="PARTS",
    help="Some of auxiliary,single,all, in order, or cloning alone.  [default: all three; no "
    "auxiliary below stages.min_auxiliary_timesteps]",
)
@click.option(
    "--pretrain",
    type=click.Choice(["bc"]),
    help="Begin with behaviour cloning of the dataset's expert.",
)
@click.option(
    "--intent",
    type=click.Choice(["integrated", "policy", "recursive", "none"]),
    help="Intent input of the global policy (Table 4).  [default: integrated]",
)
@click.option(
    "--sync-every",
    type=int,
    help="Rollouts between copies of the global policy into the intent policy.  [default: 3]",
)
@click.option(
    "--workers",
    type=int,
    help="Processes that step environments; they change no number.  [default: none]",
)
@click.option(
    "--device",
    type=click.Choice(["auto", "cpu", "cuda"]),
    default="auto",
    show_default=True,
    help="Where networks run; auto takes a GPU where there is one.",
)
@click.option(
    "--resume",
    is_flag=True,
    help="Go on from the last checkpoint of --out: with one thread, to the bits of an unbroken "
    "run, whatever --workers. Steps, workers, threads and intervals may change.",
)
@click.option("--dry-run", is_flag=True, help="Tell how long it would take; write nothing.")
@click.option("--print-config", is_flag=True, help="Print all settings as TOML and stop.")
@JSON
@click.option("--debug", is_flag=True, expose_value=False, help="Show the traceback of an error.")
@click.version_option(package_name="internav-data", prog_name="camp-train")
def command(**given: Any) -> int:  # noqa: ANN401 - the options above
    """Train an agent on DATASET: CaMP, one of its baselines, or your own."""
    if given["print_config"]:
        from internav_data.core.config import config_toml

        click.echo(config_toml(_config(given), "camp-train"), nl=False)
        return 0
    if given["dry_run"] and given["resume"]:
        raise click.UsageError("--dry-run tells of a new run: leave --resume out")
    keep_freed_memory()
    request = _request(given)
    if given["dry_run"]:
        return _forecast(request, as_json=given["as_json"])
    return _train(request, given)


def _settings(given: dict[str, Any]) -> dict[str, Any]:
    """Return the options that are settings, by dotted key."""
    chosen = {key: given[name] for name, key in _SETTINGS.items()}
    return {key: value for key, value in chosen.items() if value not in (None, ())}


def _config(given: dict[str, Any]) -> CampConfig:
    from internav_data.camp.config import config_of
    from internav_data.camp.distributed import default_preset

    name = given["preset"] or default_preset(given["device"])
    return config_of(name, given["config_file"], given["overrides"], _settings(given))


def _request(given: dict[str, Any]) -> Request:
    from internav_data.camp.stages import CLONING, PARTS
    from internav_data.camp.train import Request

    config, method = _config(given), given["method"] or "camp"
    words = (given["stages"] or ",".join(PARTS)).replace(" ", "").split(",")
    parts = () if words == [CLONING] else tuple(words)
    return Request(
        dataset=dataset_to_read(given["dataset"], solves=True),
        out=given["out"] or Path("runs") / f"{method}-{config.seed}",
        method=method,
        config=config,
        parts=parts,
        clones=given["pretrain"] is not None,
        device=given["device"],
    )


def _forecast(request: Request, *, as_json: bool) -> int:
    from internav_data.camp.run import forecast
    from internav_data.core.progress import clock

    stages = forecast(request)
    if as_json:
        names = ("stage", "steps", "seconds")
        click.echo(json.dumps([dict(zip(names, row, strict=True)) for row in stages]))
        return 0
    total = ("in all", sum(s for _, s, _ in stages), sum(seconds for *_, seconds in stages))
    for name, steps, seconds in (*stages, total):
        amount = f"{steps:,} steps" if steps else ""
        click.echo(f"{name:<20} {amount:>18} {clock(seconds):>14}")
    click.echo("measured over a few updates; validation is not in it", err=True)
    return 0


def _train(request: Request, given: dict[str, Any]) -> int:
    from internav_data.camp.logging import ProgressReporter
    from internav_data.camp.run import begin, resume
    from internav_data.core.interrupts import Interrupts

    teller = ProgressReporter(sys.stderr)
    with Interrupts() as interrupts:
        request = replace(request, callback=teller, interrupted=lambda: interrupts.signum)
        try:
            trainer = resume(request, _asked(given, request)) if given["resume"] else begin(request)
        finally:
            teller.end()
    if not trainer.ranks.first:
        return 0
    click.echo(teller.summary(request.out), err=True)
    named = [request.out] if given["dataset"] is None else [request.out, request.dataset]
    click.echo(f"measure it: {shlex.join(['camp-eval', *map(str, named)])}", err=True)
    if given["as_json"]:
        click.echo(json.dumps(teller.plain(request.out)))
    return 0


def _asked(given: dict[str, Any], request: Request) -> dict[str, Any]:
    """Return what was asked for besides --resume, to be compared with the run."""
    from internav_data.camp.run import CHANGEABLE
    from internav_data.core.config import keys_given, known_keys

    named = keys_given(given["config_file"], given["overrides"], _settings(given))
    known = known_keys(request.config)
    # A name inside a setting, as in mine.width, is that setting's.
    keys = [key for key in known if any(f"{each}.".startswith(f"{key}.") for each in named)]
    if given["preset"]:
        keys += [key for key in known if key not in CHANGEABLE]
    return {
        "method": given["method"],
        "config": request.config if keys else None,
        "keys": keys,
        "clones": request.clones,
        "parts": request.parts if given["stages"] else None,
    }


def main(arguments: list[str] | None = None) -> None:
    """Run `camp-train` and exit with its code."""
    launch(command, "camp-train", arguments)


if __name__ == "__main__":  # for torchrun, which starts modules
    main()
