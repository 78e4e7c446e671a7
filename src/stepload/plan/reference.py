"""Writes the tables of docs/plan.md from the section classes: `python -m stepload.plan.reference`.

A table stands between `<!-- keys: NAME -->` and `<!-- end -->`; everything else in the file is
written by hand and left alone.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from stepload.declaration.sections import Key, Kind, keys, sections_below
from stepload.plan.calibration import CalibrationRecord
from stepload.plan.model import Plan
from stepload.plan.reader import SHAPE
from stepload.plan.references import about, data_sheets, profiles, read_data_sheet, read_profile
from stepload.plan.source import Source

_BLOCK = re.compile(r"(<!-- keys: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(kind: Kind) -> str:
    """Markdown table of the keys of a section."""
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for key in keys(kind):
        if key.name == SHAPE and not key.sections:
            continue
        cells = (f"`{key.name}`", _value(key), _default(key), key.meaning)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def _shipped_table(names: Sequence[str], read: Callable[[str], Source]) -> str:
    """Markdown table of what comes with stepload, with its first sentences."""
    rows = [f"| `{name}` | {about(read(name))} |" for name in names]
    return "\n".join(["| profile | what it is |", "|---|---|", *rows])


def with_tables(text: str) -> str:
    """`text` with every table made anew.

    Raises:
        KeyError: a table of a section that does not exist.
    """
    kinds = {kind.__name__: kind for kind in (*sections_below(Plan), CalibrationRecord)}

    def fill(match: re.Match[str]) -> str:
        name = match[2]
        if name == "profiles":
            made = _shipped_table(profiles(), read_profile)
        elif name == "data_sheets":
            made = _shipped_table(data_sheets(), read_data_sheet)
        else:
            made = table(kinds[name])
        return f"{match[1]}{made}\n{match[3]}"

    return _BLOCK.sub(fill, text)


def _value(key: Key) -> str:
    if key.shaped:
        return "a mapping with one of the shapes below"
    return key.expected or "a mapping"


def _default(key: Key) -> str:
    if key.required:
        return "**required**"
    default = key.default_text
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    return "" if default in (None, "") else f"`{default}`"


def main() -> None:
    """Rewrite the tables of the file named on the command line (docs/plan.md)."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/plan.md")
    path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
