"""The explanations of all codes, read from their table; keys are explained by the plan itself."""

from __future__ import annotations

import difflib
import tomllib
from functools import cache
from importlib import resources

from stepload.errors import BadInputError
from stepload.explain.keys import keys_called
from stepload.explain.model import Explanation
from stepload.explain.thresholds import thresholds_called
from stepload.explain.words import words_called

GROUPS = {
    "preflight": "reasons of a preflight",
    "stop": "why a run ended",
    "device": "faults of a device",
    "sign": "signs that a contact is not what the law says",
    "fit": "doubts about one fit",
    "exit": "exit codes",
}
"""Meaning of each group of codes."""


@cache
def explanations() -> tuple[Explanation, ...]:
    """Every code, in the order of its table."""
    text = (resources.files("stepload.explain") / "codes.toml").read_text(encoding="utf-8")
    return tuple(
        Explanation(group, code, **about)
        for group, codes in tomllib.loads(text).items()
        for code, about in codes.items()
    )


def explained(code: str) -> tuple[Explanation, ...]:
    """Explanations of a code; more than one where groups share it.

    If no code has this name, the keys of a plan, thresholds of a run and words that have it.

    Raises:
        BadInputError: there is no such code; the message names similar ones.
    """
    wanted = code.strip().strip("[]").lower().replace("-", "_").replace(" ", "_")
    found = tuple(each for each in explanations() if each.code.lower() == wanted)
    if not found:
        found = keys_called(wanted) + thresholds_called(wanted) + words_called(wanted)
    if not found:
        known = sorted({each.code for each in explanations()})
        near = difflib.get_close_matches(wanted, known, n=3, cutoff=0.5)
        near += [each for each in known if wanted in each and each not in near]
        hint = f"perhaps {', '.join(near[:5])}" if near else "`stepload explain` lists them all"
        raise BadInputError(f"no code is called {code!r}", hint=hint)
    return found


def page() -> str:
    """The page of docs/ that explains all codes, as Markdown."""
    lines = [
        "# What the codes mean",
        "",
        "Reasons, stops, faults and signs have a code that does not change from version to",
        "version. `stepload explain CODE` prints what stands here; `stepload explain` lists the",
        "codes. This page is generated from the same table.",
    ]
    for group, title in GROUPS.items():
        lines += ["", f"## {title[0].upper()}{title[1:]}", ""]
        for each in explanations():
            if each.group == group:
                lines += [f"**`{each.code}`**: {each.means} *{each.do}* [More]({each.page})", ""]
        lines.pop()
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(page(), end="")
