"""A document as one self-contained HTML page: no script, no network, every text escaped."""

from __future__ import annotations

import base64
import re
from functools import cache
from typing import TYPE_CHECKING

from stepload.report.model import SIMULATED, Document

if TYPE_CHECKING:
    from jinja2 import Template

SHORT_TABLE = 14
"""Largest number of rows of a table that is kept on one sheet of paper with its title."""
WORD = 24
"""Word length in characters beyond which a table breaks it: checksums, paths."""


def render(document: Document) -> str:
    """The page as one HTML text, which forbids scripts and any network request."""
    certificate = document.certificate
    return _template().render(
        page=document,
        banner=SIMULATED if document.simulated else "",
        running=running(certificate.foot if certificate else "", simulated=document.simulated),
        short_table=SHORT_TABLE,
    )


@cache
def _template() -> Template:
    """The page without words, compiled once: that takes longer than to fill it in."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("stepload.report"),
        autoescape=True,  # names and texts may come from anybody's file
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["base64"] = lambda text: base64.b64encode(text.encode()).decode()
    environment.tests["long_worded"] = lambda text: max(map(len, text.split()), default=0) > WORD
    return environment.get_template("page.html")


def running(foot: str, *, simulated: bool) -> str:
    """The text at the foot of every printed page. It is part of a style sheet, so only letters,
    digits and characters that cannot end a string are kept."""
    words = re.sub(r"[^A-Za-z0-9 .:_-]", "", foot)[:80].strip()
    return f"{'SIMULATED  ' if simulated else ''}{words}".strip()
