"""The verb `ui`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from stepload.cli.options import Certificate, Key
from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output

if TYPE_CHECKING:
    from stepload.ui.door import Door

NICE = 5
"""Below a loop, and above what else reads files."""


def ui(
    directory: Annotated[Path, Argument(help="Folder of the plans, and of the runs below it.")] = (
        Path()
    ),
    host: Annotated[
        str, Option(help="Address; another than this computer's own needs a certificate.")
    ] = "127.0.0.1",
    port: Annotated[int, Option(min=0, max=65535, help="0: any that is free.")] = 8766,
    certificate: Certificate = None,
    key: Key = None,
    as_json: AsJson = False,
) -> None:
    """Show runs, reports, the live run and preflight in a browser; it starts no motion.

    Example: stepload ui
    """
    try:
        from stepload.ui.app import serve
    except ModuleNotFoundError as error:
        raise BadInputError(
            f"`ui` needs {error.name}, which is not installed", hint="pip install 'stepload[ui]'"
        ) from error
    output = Output(as_json=as_json)

    def started(door: Door) -> None:
        output.line(f"page     {door.url}")
        output.line(f"folder   {directory.resolve()}")
        if door.everything:
            output.line("The browser asks for a password: the token, under any name.")
        output.line("Pause and stop need the token in this address.")
        output.line("Ctrl+C ends the page, not a run.")
        output.result({"url": door.url, "token": door.token, "directory": directory.resolve()})

    os.nice(NICE)
    serve(directory, host, port, started, certificate, key)
