"""Writes the tables of keys in docs: `python -m stepload.plan.reference`.

A table stands between `<!-- keys: NAME -->` and `<!-- end -->`; everything else in the file is
written by hand and left alone.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from stepload.declaration.sections import LIST, Key, Kind, keys, sections_below
from stepload.plan.model import Plan
from stepload.plan.reader import SHAPE
from stepload.plan.references import profiles, read_profile, title

PAGES = ("docs/plan.md", "docs/simulation.md")
_BLOCK = re.compile(r"(<!-- keys: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(kind: Kind) -> str:
    """Markdown table of the keys of a section."""
    rows = ["| key | value | meaning |", "|---|---|---|"]
    for key in keys(kind):
        if key.name == SHAPE and not key.sections:
            continue
        name = f"**`{key.name}`**" if key.required else f"`{key.name}`"
        cells = (name, _value(key), key.meaning)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def _profile_table() -> str:
    """Markdown table of the rig profiles, with their titles."""
    rows = [f"| `{name}` | {title(read_profile(name))} |" for name in profiles()]
    return "\n".join(["| profile | what it is |", "|---|---|", *rows])


def with_tables(text: str) -> str:
    """`text` with every table made anew.

    Raises:
        KeyError: a table of a section that does not exist.
    """
    kinds = {kind.__name__: kind for kind in sections_below(Plan)}

    def fill(match: re.Match[str]) -> str:
        name = match[2]
        made = _profile_table() if name == "profiles" else table(kinds[name])
        return f"{match[1]}{made}\n{match[3]}"

    return _BLOCK.sub(fill, text)


def _value(key: Key) -> str:
    """The default as a plan would write it, or else the kind of value; of a choice, both."""
    default = key.default_text
    if isinstance(default, bool):
        default = str(default).lower()
    written = key.expected
    if written.startswith("one of "):
        choices = written.removeprefix("one of ").split(", ")
        return ", ".join(f"`{each}`" if each == default else each for each in choices if each)
    return f"`{default}`" if default not in (None, "") else _kind(written) or "mapping"


def _kind(written: str) -> str:
    """The noun of what may be written: "a force from 0 N to 1 MN" is a force."""
    if written.startswith(LIST):
        return f"list: {_kind(written.removeprefix(LIST).removeprefix('one of '))}"
    noun = re.split(r" from | above | of at most | of one line|, ", written)[0]
    more = " ±" * ("±" in written) + " or range" * ("or a range" in written)
    return f"{re.sub('^an? ', '', noun)}{more}"


def main() -> None:
    """Rewrite the tables of the files named on the command line; of both pages without any."""
    for path in map(Path, sys.argv[1:] or PAGES):
        path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
