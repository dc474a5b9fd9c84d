"""`internav-gen upload`."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import click

from internav_cli.options import DATASET, dataset_to_read

if TYPE_CHECKING:
    from pathlib import Path


@click.command(
    "upload",
    epilog="""\b
Examples:
  internav-gen upload --to me/my-houses --dry-run      the plan alone
  internav-gen upload data/flats --to me/flats         the plan, a question, then the upload
  internav-gen upload data/flats --to me/flats --private --yes

\b
Sending needs huggingface_hub (pip install 'internav-data[hub]') and a token of the hub:
`hf auth login`, or HF_TOKEN in the environment.""",
)
@DATASET
@click.option(
    "--to", "repository", required=True, metavar="USER/NAME", help="Dataset repository of the hub."
)
@click.option("--private", is_flag=True, help="Make the repository private, if it is made.")
@click.option("--message", default="", metavar="TEXT", help="Message of the commit.")
@click.option("--dry-run", is_flag=True, help="Print the plan; send nothing.")
@click.option("--yes", is_flag=True, help="Send without a question.")
def command(
    *,
    dataset: Path | None,
    repository: str,
    private: bool,
    message: str,
    dry_run: bool,
    yes: bool,
) -> int:
    """Upload DATASET to the Hugging Face hub: its folder is a dataset repository."""
    from internav_data.interop import plan_upload, upload

    plan = plan_upload(dataset_to_read(dataset), repository, private=private, message=message)
    click.echo(plan.summary())
    if dry_run:
        return 0
    if not yes:
        if not sys.stdin.isatty():
            raise click.UsageError("nothing was sent: there is nobody to ask, so say --yes")
        click.confirm("Nothing has been sent yet. Upload?", abort=True)
    click.echo(f"uploaded: {upload(plan)}", err=True)
    return 0
