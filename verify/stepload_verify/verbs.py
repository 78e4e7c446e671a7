"""The verbs that `stepload` gets where this package is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stepload.errors import BadInputError
from stepload.report.terminal import AsJson, Output
from stepload_verify.campaign_verb import campaign
from stepload_verify.falsify_verb import falsify


def paper(
    out: Annotated[
        Path, typer.Option("--out", help="The page; figures and curves go into paper/ beside it.")
    ] = Path("paper.md"),
    as_json: AsJson = False,
) -> None:
    """Compute the paper's tables and figures again (half a minute), printed beside ours.

    Example: stepload paper
    """
    from stepload_verify.paper.document import generate

    output = Output(as_json=as_json)
    try:
        off = generate(out)
    except OSError as error:
        raise BadInputError(f"cannot write {error.filename or out}: {error.strerror}") from error
    output.line(f"{len(off)} printed numbers differ from ours")
    output.line(f"page: {out}")
    output.result({
        "page": out,
        "differs": [{"quantity": row.quantity, "printed": row.printed, "ours": row.ours}
                    for row in off],
    })  # fmt: skip


def emulate(context: typer.Context) -> None:
    """Speak a device's wire protocol on loopback or a pseudo-terminal, with faults on demand.

    Example: stepload emulate gauge
    """
    from stepload_verify.emulators.command import app

    app(args=context.args, prog_name="stepload emulate", standalone_mode=False)


def register(app: typer.Typer) -> None:
    """Add them."""
    app.command()(campaign)
    app.command()(falsify)
    app.command()(paper)
    app.command(
        context_settings={
            "allow_extra_args": True,
            "ignore_unknown_options": True,
            "help_option_names": [],
        }
    )(emulate)
