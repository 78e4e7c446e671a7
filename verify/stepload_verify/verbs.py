"""The verbs that `stepload` gets where this package is installed."""

from __future__ import annotations

import typer

from stepload_verify.campaign_verb import campaign
from stepload_verify.falsify_verb import falsify
from stepload_verify.paper_verb import paper


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
