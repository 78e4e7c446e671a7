"""Reports on paper: the options of every verb that writes one, and the result of the conversion."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stepload.errors import BadInputError
from stepload.results.terminal import Output

AsPdf = Annotated[
    bool,
    typer.Option("--pdf", help="The report as a PDF too, by Chromium or WeasyPrint."),
]
PaperSize = Annotated[str, typer.Option("--paper", help="With --pdf: a4 or letter.")]
A4 = "a4"


def wanted_paper(as_pdf: bool, paper: str) -> str | None:
    """The paper size of a requested PDF, None without one; checked before anything runs.

    Raises:
        BadInputError: there is no such size, or a size is given without a PDF.
    """
    from stepload.results.pdf import PAPERS

    if paper not in PAPERS:
        raise BadInputError(f"--paper {paper!r}", hint=f"one of: {', '.join(PAPERS)}")
    if paper != A4 and not as_pdf:
        raise BadInputError("--paper without --pdf", hint="add --pdf")
    return paper if as_pdf else None


def put_on_paper(page: Path, paper: str | None, output: Output) -> None:
    """Write a requested PDF next to a page, and report the result.

    It comes last and never fails: results and exit code of the command do not change.
    """
    from stepload.results.pdf import print_page

    if paper is None:
        return
    if not page.exists():
        output.line("no PDF: there is no report")
        return
    try:
        output.line(print_page(page, paper).line)
    except KeyboardInterrupt:
        output.line(f"no PDF: left out on request; {page} prints from any browser")
