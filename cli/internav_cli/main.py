"""`internav-gen`: finds the command. `launch` turns every error into a line and an exit code."""

from __future__ import annotations

import contextlib
import importlib
import shlex
import signal
import sys
import threading
import traceback
import warnings
from typing import TYPE_CHECKING

import click

from internav_cli.streams import leave_unwritten, prepare_streams
from internav_data.core.machine import END_SIGNALS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

COMMANDS = {
    "generate": "Make a dataset from a seed; continue or extend one.",
    "merge": "Join the parts of a dataset that several machines made.",
    "validate": "Validate a dataset independently of its generator; list every error.",
    "stats": "Print statistics of a dataset, beside the paper's Table 2.",
    "show": "Draw a house or an episode from above as a PNG.",
    "view": "Show a dataset in the browser: statistics, gallery, episodes with their outcomes.",
    "replay": "Record a video of an episode: the agent's camera beside the map.",
    "upload": "Upload a dataset to the Hugging Face hub; print the plan first.",
    "schema": "Print the JSON Schemas of every row and file.",
    "assets": "List the assets: obstacles and furniture.",
    "doctor": "Check that this machine can generate datasets.",
    "warmup": "Compile the numba kernels before their first use.",
}
LONGEST_LINE = 1000
"""Characters of an error: one that quotes a file may be as long as the file."""


class InterruptedCommandError(KeyboardInterrupt):
    """A signal ended a command that has nothing to finish or to keep."""

    def __init__(self, signum: int) -> None:
        super().__init__(signum)
        self.signum = signum


class LazyGroup(click.Group):
    """Imports a command's module when it is called, so that help is fast."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the commands in the order in which people meet them."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002
        """Return a command by its name."""
        if cmd_name not in COMMANDS:
            return None
        module = importlib.import_module(f"internav_cli.{cmd_name}")
        command: click.Command = module.command
        command.help = command.help or COMMANDS[cmd_name]  # python -OO removes docstrings
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="""\b
Examples:
  internav-gen generate --scenes 120
  internav-gen validate
  internav-gen stats
  internav-gen show --scene 17 --episode 3

\b
DATASET and --out default to the folder that the environment variable INTERNAV_DATASET
names, else to internav-dataset in the current directory.

\b
Shell completion (bash; zsh and fish likewise):
  eval "$(_INTERNAV_GEN_COMPLETE=bash_source internav-gen)"

\b
Exit codes: 0 good, 1 error, 2 usage, 3 validation failed, 4 finished with
quarantined scenes, 5 corrupt data, 129/130/143 interrupted.""",
)
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
@click.version_option(package_name="internav-data", prog_name="internav-gen")
def cli(*, debug: bool) -> None:
    """Interactive-navigation episodes with physical truth: from a seed to Parquet shards."""


def main(arguments: list[str] | None = None) -> None:
    """Run `internav-gen` and exit with its code."""
    launch(cli, "internav-gen", arguments)


def launch(command: click.Command, program: str, arguments: list[str] | None = None) -> None:
    """Run a command line and exit with its code; every error becomes one line."""
    prepare_streams()
    given = sys.argv[1:] if arguments is None else arguments
    debug = "--debug" in given
    if debug:  # wherever it stands; click takes a group's before its command only
        given = ["--debug", *(word for word in given if word != "--debug")]
    # A warning is a line for the user, not a place in the source.
    warnings.showwarning = lambda message, *_, **_k: click.echo(
        _line(program, f"warning: {message}"), err=True
    )
    try:
        with _signals_raise():
            result = command.main(given, prog_name=program, standalone_mode=False)
            sys.stdout.flush()
    except BrokenPipeError:
        sys.stdout = None  # who read our output has gone: nothing is left to flush at the end
        sys.exit(0)
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - every one becomes one line
        if debug:
            traceback.print_exc()
        code = _report(error, program, given)
        leave_unwritten()
        sys.exit(code)
    sys.exit(result if isinstance(result, int) else 0)


@contextlib.contextmanager
def _signals_raise() -> Iterator[None]:
    """Have the first of `END_SIGNALS` end the block by an exception, the next one the process."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(signum: int, _frame: FrameType | None) -> None:
        for each in END_SIGNALS:
            signal.signal(each, signal.SIG_DFL)
        raise InterruptedCommandError(signum)

    # A signal that is ignored, as in a background job of a plain shell, stays ignored.
    before = {signum: signal.getsignal(signum) for signum in END_SIGNALS}
    for signum, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(signum, end)
    try:
        yield
    finally:
        for signum, handler in before.items():
            signal.signal(signum, handler)


def _report(error: BaseException, program: str, given: list[str]) -> int:
    """Write an error on stderr and return the exit code."""
    from internav_data.records.errors import InternavError

    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        error.show()
        return error.exit_code
    if isinstance(error, KeyboardInterrupt | click.Abort):
        cause = error.__cause__ or error  # click makes its own exception of it
        return _say(program, "interrupted", 128 + getattr(cause, "signum", signal.SIGINT))
    if isinstance(error, click.ClickException):
        return _say(program, _with_help(error), error.exit_code)
    if isinstance(error, InternavError):
        signum = getattr(error, "signum", 0)
        return _say(program, str(error), 128 + signum if signum else error.exit_code)
    return _say(program, _unforeseen(error, program, given), 1)


def _unforeseen(error: BaseException, program: str, given: list[str]) -> str:
    if isinstance(error, OSError):
        where = f" ({error.filename})" if error.filename else ""
        return f"{error.strerror or error}{where}"
    if isinstance(error, ModuleNotFoundError):
        from internav_data.core.extras import missing

        return f"{missing(error.name)}; `internav-gen doctor` tells more"
    if isinstance(error, ImportError):
        return f"cannot import {error.name}: {error}; `internav-gen doctor` tells what is missing"
    again = shlex.join([program, "--debug", *given])
    return f"{type(error).__name__}: {error}; this is a bug: `{again}` shows where"


def _with_help(error: click.ClickException) -> str:
    context = getattr(error, "ctx", None)
    hint = f" (see `{context.command_path} --help`)" if context is not None else ""
    return f"{error.format_message()}{hint}"


def _say(program: str, text: str, code: int) -> int:
    click.echo(_line(program, text), err=True)
    return code


def _line(program: str, text: str) -> str:
    # Names in files may hold anything: no control characters reach the terminal.
    line = "".join(c if c.isprintable() else "?" for c in " ".join(text.split()))
    if len(line) > LONGEST_LINE:
        line = f"{line[: LONGEST_LINE // 2]} ... {line[-LONGEST_LINE // 2 :]}"
    return f"{program}: {line}"
