"""A document as one self-contained HTML page: no script, no network, every text escaped."""

from __future__ import annotations

import base64

from stepload.results.model import SIMULATED, Document


def render(document: Document) -> str:
    """The page as one HTML text; it forbids itself scripts and any network request."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("stepload.results"),
        autoescape=True,  # names and texts may come from anybody's file
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["base64"] = lambda text: base64.b64encode(text.encode()).decode()
    return environment.get_template("page.html").render(
        page=document, banner=SIMULATED if document.simulated else ""
    )
