"""The verb `explain`, which explains a code."""

from __future__ import annotations

from typing import Annotated

import typer

from stepload.results.terminal import AsJson, Output

OTHERS = {"key": "a key of a plan", "threshold": "a threshold of a run", "word": "the glossary"}
"""Other things that can be explained."""


def codes(incomplete: str) -> list[str]:
    """Codes that begin with a text, for the shell's completion."""
    from stepload.explain.codes import explanations

    return [each.code for each in explanations() if each.code.startswith(incomplete)]


def explain(
    code: Annotated[
        str,
        typer.Argument(
            help="A code (R6), a key of a plan (search_distance), a threshold, a word; none: all.",
            autocompletion=codes,
        ),
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Say what a code, key, threshold or word means and what to do.

    Example: stepload explain unidentifiable
    """
    from dataclasses import asdict

    from stepload.explain.codes import GROUPS, explained, explanations

    output = Output(as_json=as_json)
    found = explained(code) if code else explanations()
    if code:
        for each in found:
            output.line(f"{each.code} ({(GROUPS | OTHERS)[each.group]})")
            output.line(f"  {each.means}")
            if each.do:
                output.line(f"  What to do: {each.do}")
            output.line(f"  More: docs/{each.page}")
    else:
        for group, title in GROUPS.items():
            words = [each.code for each in found if each.group == group]
            output.line(f"{title}: {', '.join(words)}")
        output.line("keys of a plan: docs/plan.md, or stepload explain KEY")
        output.line("words and symbols: docs/glossary.md, or stepload explain WORD")
    output.result({"codes": [asdict(each) for each in found]})
