"""Figures of results, each declared once as a field of a `Row`: an object in JSON and its schema, a
line of a table for people. ::

    peak_force_n: float | None = figure("Largest measured force.", "peak force")
    n: Annotated[float, form(".3f")] = figure("Exponent.", "n")

The key ends with the unit, from which the format for people follows; a function in the annotation
gives another. A figure with a heading is a column, in the order of the class.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import AliasPath, BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema
from pydantic.fields import FieldInfo
from pydantic.json_schema import GenerateJsonSchema

from stepload.report.model import NOTHING, Table
from stepload.units import format_quantity

Show = Callable[[Any], str]
"""From a value to the text that people read."""


OrNan = Annotated[float, WithJsonSchema({"type": ["number", "null"]})]
"""A number that may be NaN or infinite, which is null in JSON."""


class Row(BaseModel):
    """An object of results, made from the attributes of another object or from a mapping."""

    model_config = ConfigDict(
        from_attributes=True,
        frozen=True,
        defer_build=True,
        validate_by_name=True,
        validate_by_alias=True,
        serialize_by_alias=True,
    )


def figure(meaning: str, heading: str = "", *, at: str = "", default: Any = ...) -> Any:
    """A figure in JSON.

    Args:
        meaning: its description in the schema; the unit is added.
        heading: of its column; "": for programs only.
        at: where it stands in the object that a row is made from, "fit.n"; its key by default.
        default: its value where nothing is there.
    """
    return Field(default, description=meaning, title=heading or None, validation_alias=_path(at))


def column(heading: str) -> Any:
    """A figure for people only."""
    return Field(None, title=heading, exclude=True)


def _path(at: str) -> AliasPath | None:
    names = [int(name) if name.isdigit() else name for name in at.split(".")]
    return AliasPath(*names) if at else None  # type: ignore[arg-type]


def part(name: str) -> BeforeValidator:
    """In an annotation: an attribute of what stands there; null where nothing does."""
    return BeforeValidator(lambda whole: None if whole is None else getattr(whole, name))


@dataclass(frozen=True, slots=True)
class Cell:
    """In an annotation: the text for people, from the whole row."""

    text: Show


def quantity(unit: str) -> Show:
    """Shows a number of an SI unit with a prefix that suits it."""
    return lambda value: format_quantity(value, unit)


def form(spec: str) -> Show:
    """Shows a number in a Python format."""
    return lambda value: format(value, spec)


def interval(unit: str) -> Show:
    """Shows two numbers of one SI unit as an interval."""
    return lambda ends: in_one_unit(ends, unit)[1]


def in_one_unit(ends: Sequence[float], unit: str, value: float = math.nan) -> tuple[str, str]:
    """A value and its interval as text; those of one prefix have the same number of decimals, and
    an interval of one prefix names its unit once."""
    numbers = (*ends, ends[0] if math.isnan(value) else value)
    low, high, of_value = shown = [format_quantity(each, unit).split(" ", 1) for each in numbers]
    for prefix in {of for _, of in shown}:
        alike = [each for each in shown if each[1] == prefix]
        places = max(len(digits.partition(".")[2]) for digits, _ in alike)
        if all(digits.strip("-").replace(".", "").isdigit() for digits, _ in alike):
            for each in alike:
                each[0] = f"{float(each[0]):.{places}f}"
    one = f"[{low[0]}, {high[0]}] {high[1]}"
    both = one if low[1] == high[1] else f"[{' '.join(low)}, {' '.join(high)}]"
    return NOTHING if math.isnan(value) else " ".join(of_value), both


_UNITS = {
    "n_per_m": "N/m", "n_s_per_m": "N s/m", "m_per_s": "m/s", "m_s": "m/s", "n": "N", "m": "m",
    "s": "s", "j": "J", "us": "µs",
}  # fmt: skip
_SUFFIX = re.compile(f"_({'|'.join(_UNITS)})$")


def unit_of(key: str) -> str:
    """The unit that a key ends with: "N" of "force_n"; "" for a plain number."""
    found = _SUFFIX.search(key)
    return _UNITS[found[1]] if found else ""


def data(kind: type[Row], item: Any) -> dict[str, Any]:
    """The object of `item` for JSON; what it does not have is left out where it may be."""
    return kind.model_validate(item).model_dump(exclude_unset=True)


def _text(row: Row, key: str, field: FieldInfo) -> str:
    for each in field.metadata:
        if isinstance(each, Cell):
            return each.text(row)
    value = getattr(row, key)
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return NOTHING
    for each in field.metadata:
        if callable(each):
            return str(each(value))
    unit = unit_of(key)
    if isinstance(value, bool):
        return "yes" if value else "no"
    if unit and isinstance(value, tuple):
        return interval(unit)(value)
    return quantity(unit)(value) if unit and isinstance(value, float) else str(value)


def cells(kind: type[Row], item: Any) -> list[tuple[str, str]]:
    """Heading and text of every figure of `item` that has a heading."""
    row = kind.model_validate(item)
    return [(x.title, _text(row, key, x)) for key, x in kind.model_fields.items() if x.title]


def table(
    title: str,
    kind: type[Row],
    items: Iterable[Any],
    notes: Sequence[str] = (),
    *,
    page_only: bool = False,
) -> Table:
    """The table of `items`: one row each, one column for every figure that has a heading."""
    rows = [[text for _, text in cells(kind, item)] for item in items]
    columns = [each.title for each in kind.model_fields.values() if each.title]
    return Table(title, columns, rows, notes, page_only)


class _Schema(GenerateJsonSchema):
    """Without the titles that pydantic makes up."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def schema_of(kind: type[Row], name: str, required: Iterable[str] | None = None) -> dict[str, Any]:
    """JSON Schema (2020-12) of a document; `required`: its keys that no document lacks."""
    made = kind.model_json_schema(mode="serialization", schema_generator=_Schema)
    for each in (made, *made.get("$defs", {}).values()):
        for key, declared in each.get("properties", {}).items():
            declared.pop("default", None)
            if unit := unit_of(key):
                declared["description"] = f"{declared.get('description', '')} In {unit}.".strip()
    if required is not None:
        made["required"] = list(required)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return head | {"$id": f"urn:stepload:{name}:1"} | made
