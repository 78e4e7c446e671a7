"""Writes the tables of docs/plan.md from the section models: `python -m stepload.plan.reference`.

A table stands between `<!-- keys: NAME -->` and `<!-- end -->`; everything else in the file is
written by hand and left alone.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from pydantic.fields import FieldInfo

from stepload.plan.calibration import RecordFileSection
from stepload.plan.introspect import default_text, item_type, leaf_of, models_in, sections_below
from stepload.plan.payload_section import Section
from stepload.plan.plan_section import PlanSection
from stepload.plan.references import profiles, read_profile

_BLOCK = re.compile(r"(<!-- keys: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)


def table(model: type[Section]) -> str:
    """Markdown table of the keys of `model`."""
    rows = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for name, field in model.model_fields.items():
        cells = (f"`{name}`", _value(field), _default(field), field.description or "")
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def profile_table() -> str:
    """Markdown table of the rig profiles with their first sentences."""
    rows = ["| profile | what it is |", "|---|---|"]
    for name in profiles():
        comment = re.match(r"(?:#[^\n]*\n)+", read_profile(name).text)
        text = re.sub(r"\n?# ?", " ", comment[0]).strip() if comment else ""
        rows.append(f"| `{name}` | {text} |")
    return "\n".join(rows)


def with_tables(text: str) -> str:
    """`text` with every table made anew.

    Raises:
        KeyError: a table of a section that does not exist.
    """
    known: list[type[Section]] = [*sections_below(PlanSection), RecordFileSection]
    models = {model.__name__: model for model in known}

    def fill(match: re.Match[str]) -> str:
        name = match[2]
        made = profile_table() if name == "profiles" else table(models[f"{name}Section"])
        return f"{match[1]}{made}\n{match[3]}"

    return _BLOCK.sub(fill, text)


def missing_tables(text: str) -> list[str]:
    """Sections of a plan that `text` has no table for."""
    named = {match[2] for match in _BLOCK.finditer(text)}
    known = [model.__name__.removesuffix("Section") for model in sections_below(PlanSection)]
    return [name for name in known if name not in named]


def _value(field: FieldInfo) -> str:
    if models := models_in(field):
        shapes = [str(m.model_fields["shape"].annotation) for m in models if len(models) > 1]
        return "a mapping with one of the shapes below" if shapes else "a mapping"
    leaf = leaf_of(field)
    if leaf is None:
        literal = re.match(r"typing\.Literal\[(.*)\]", str(field.annotation))
        return f"`{literal[1].strip(chr(39))}`" if literal else "a mapping"
    return f"a list, each {leaf.expected()}" if item_type(field) else leaf.expected()


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "**required**"
    default = default_text(field)
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    return "" if default in (None, "") else f"`{default}`"


def main() -> None:
    """Rewrite the tables of the file named on the command line (docs/plan.md)."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/plan.md")
    path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
