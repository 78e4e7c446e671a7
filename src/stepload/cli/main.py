"""The `stepload` command: thin verbs, built when they are called; heavy imports inside them."""

from __future__ import annotations

import atexit
import gc
import io
import os
import sys
import traceback
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Annotated

import typer

from stepload import __version__
from stepload.cli.verbs import OwnVerbs
from stepload.errors import BadInputError, ExitCode, LeftEarlyError, SteploadError

app = typer.Typer(
    name="stepload",
    cls=OwnVerbs,
    help="Press a stiff payload in load steps, below its elastic limit; identify F = K δⁿ.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=True,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version; -v: all that a bug report needs.")
    ] = False,
    verbose: Annotated[
        int,
        typer.Option(
            "-v", "--verbose", count=True, help="Show the log: -v states, -vv every exchange."
        ),
    ] = 0,
    log_file: Annotated[
        Path | None, typer.Option("--log-file", help="Add the whole log to a file, for a report.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", hidden=True)] = False,
) -> None:
    if as_json and not version:
        raise BadInputError("--json stands behind the verb", hint="stepload VERB … --json")
    if version:
        if not (verbose or as_json):
            print(__version__)
            raise typer.Exit
        from stepload.cli.version import show_version
        from stepload.report.terminal import Output

        show_version(Output(as_json=as_json))
        raise typer.Exit
    if verbose or log_file:
        from stepload.cli.log import start_log

        context.obj.callback(start_log(verbose, log_file))


def _as_text(error: Exception) -> SteploadError:
    """An exception converted to an error with a text."""
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return BadInputError(f"{where}{error.strerror or error}")
    if isinstance(error, MemoryError):
        return BadInputError("there is not enough memory for that")
    if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("stepload"):
        said = f"this needs {error.name}, which is not installed"
        return BadInputError(said, hint="pip check lists what is missing")
    frame = traceback.extract_tb(error.__traceback__)[-1]
    return SteploadError(
        f"internal error: {type(error).__name__}: {error} ({frame.filename}:{frame.lineno})",
        hint="please report it with the file of `stepload --log-file FILE ...`",
    )


def _give_streams() -> None:
    """Connect closed streams to /dev/null, or the next file that is opened would be taken for one;
    escape characters that an output cannot encode."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, os.fdopen(number, "w" if number else "r", encoding="utf-8"))
        elif number and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


@cache
def _leave_quickly() -> None:
    """Exclude imported objects from garbage collection, since the interpreter would scan them twice
    at its end, a tenth of a second of a short command. While they are imported it would scan them
    every 700 objects: a twenty-fifth of a preflight."""
    gc.set_threshold(50_000)
    atexit.register(gc.freeze)


def _log_failure(error: Exception) -> None:
    """Log where an error came from, if there is a log."""
    if "stepload.cli.log" in sys.modules:
        import logging

        logging.getLogger(__name__).debug("the command failed", exc_info=error)


def _exit_code(log: ExitStack) -> int:
    """Run the verb of the command line; what is started for a log ends with `log`."""
    try:
        return int(app(standalone_mode=False, obj=log, prog_name="stepload") or 0)
    except LeftEarlyError as error:
        return 128 + error.signal_number
    except (KeyboardInterrupt, typer.Abort):
        return ExitCode.INTERRUPTED
    except Exception as error:
        show = getattr(error, "show", None)  # typer's own usage errors
        if show is not None:
            show()
            return int(getattr(error, "exit_code", ExitCode.BAD_INPUT))
        _log_failure(error)
        from stepload.report.terminal import Output, delivered

        if isinstance(error, OSError) and not delivered():  # typer's own output
            return ExitCode.BAD_INPUT
        known = error if isinstance(error, SteploadError) else _as_text(error)
        Output(as_json="--json" in sys.argv).error(known)
        return known.exit_code


def main() -> None:
    """Run the command line; every error ends in text and its own exit code, none in a traceback."""
    _give_streams()
    _leave_quickly()
    # No plugin may watch how a plan is validated; to look for some reads every installed package.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "true")
    with ExitStack() as log:
        code = _exit_code(log)
    from stepload.report.terminal import delivered

    sys.exit(int(code) if delivered() else int(code) or ExitCode.BAD_INPUT)
