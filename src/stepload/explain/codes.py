"""The explanations of all codes, read from their table; rules, keys and thresholds are explained by
their own tables, the plan and the limits."""

from __future__ import annotations

import difflib
import sys
import tomllib
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from itertools import chain

from stepload.declaration.sections import Key, keys_below
from stepload.engine.rules import RULES
from stepload.errors import BadInputError
from stepload.feasibility.limits import RunLimits
from stepload.plan.model import Plan

GROUPS = {
    "preflight": "reasons of a preflight",
    "stop": "why a run ended",
    "device": "faults of a device",
    "sign": "signs that a contact is not elastic",
    "fit": "doubts about one fit",
    "exit": "exit codes",
}
"""Meaning of each group of codes."""
KEY, THRESHOLD = "key", "threshold"
OTHERS = {KEY: "a key of a plan", THRESHOLD: "a threshold of a run", "word": "the glossary"}
"""What else can be explained."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """What a code means and what to do; `page` is a page of docs/."""

    group: str
    code: str
    means: str
    do: str
    page: str


@cache
def explanations() -> tuple[Explanation, ...]:
    """Every code, in the order of its table."""
    text = (resources.files("stepload.explain") / "codes.toml").read_text(encoding="utf-8")
    found = {
        group: [Explanation(group, code, **about) for code, about in codes.items()]
        for group, codes in tomllib.loads(text).items()
    }
    found["stop"][:0] = [
        Explanation("stop", rule.code, rule.means, rule.do, rule.page) for rule in RULES.values()
    ]
    return tuple(chain.from_iterable(found.values()))


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
        known += [name.casefold().replace(" ", "_") for names, _, _ in words() for name in names]
        near = difflib.get_close_matches(wanted, known, n=3, cutoff=0.5)
        near += [each for each in known if wanted in each and each not in near]
        hint = f"perhaps {', '.join(near[:5])}" if near else "`stepload explain` lists them all"
        raise BadInputError(f"no code, key or word is called {code!r}", hint=hint)
    return found


def keys_called(name: str) -> tuple[Explanation, ...]:
    """Every key of a plan with this name, with all places where it may stand."""
    places: dict[str, tuple[Key, list[str]]] = {}
    for path, key in keys_below(Plan):
        if key.name == name:
            places.setdefault(key.meaning, (key, []))[1].append(path)
    return tuple(
        Explanation(
            KEY, name, f"{', '.join(dict.fromkeys(paths))}: {meaning}",
            f"Write {key.expected or 'a mapping'}.", "plan.md",
        )
        for meaning, (key, paths) in places.items()
    )  # fmt: skip


def thresholds_called(name: str) -> tuple[Explanation, ...]:
    """The threshold with this name, if there is one."""
    return tuple(
        Explanation(
            THRESHOLD,
            each.name,
            f"{each.metadata['source']}"
            + (f" [{each.metadata['unit']}]" if each.metadata["unit"] else "")
            + (f"; rule {each.metadata['rule']} judges by it" if each.metadata["rule"] else "")
            + ".",
            "Nothing: limits.json says what it is in a run, and for the rules' own also"
            " `stepload preflight PLAN --verbose`;"
            " `stepload replay RECORD --limit` judges a record by another.",
            "safety.md",
        )
        for each in fields(RunLimits)
        if each.name == name and "source" in each.metadata
    )


def words_called(name: str) -> tuple[Explanation, ...]:
    """The words or symbols with this name, `_` for spaces, in large or small letters."""
    return tuple(
        Explanation("word", ", ".join(names), means, "", page)
        for names, means, page in words()
        if name.casefold() in {each.replace(" ", "_").casefold() for each in names}
    )


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
                lines += [f"[**`{each.code}`**]({each.page}): {each.means} *{each.do}*", ""]
        lines.pop()
    return "\n".join(lines) + "\n"


def words() -> list[tuple[list[str], str, str]]:
    """Names, meaning and page of each, in the order of the page."""
    text = (resources.files("stepload.explain") / "words.toml").read_text(encoding="utf-8")
    return [(each["names"], each["means"], each["page"]) for each in tomllib.loads(text)["word"]]


def glossary() -> str:
    """The page of docs/ that holds the glossary, as Markdown."""
    lines = ["# Glossary", "", "`stepload explain WORD` prints what stands here."]
    for names, means, place in words():
        lines += ["", f"[**{', '.join(names)}**]({place}): {means}"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(glossary() if "glossary" in sys.argv else page(), end="")
