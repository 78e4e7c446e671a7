"""What may stand at one key of a plan: pydantic field types that say what they expected."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import date
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from stepload.plan.problems import printable
from stepload.units import QuantityError, describe_unit, format_quantity, parse_quantity


def field_error(message: str, hint: str) -> PydanticCustomError:
    """The one error type of plan fields; `message` and `hint` are in its context."""
    return PydanticCustomError("plan", "{message}", {"message": message, "hint": hint})


class Leaf:
    """A field type with its own check, for `Annotated[type, Leaf(...)]`."""

    __slots__ = ()

    def read(self, value: Any) -> Any:
        """The checked value; raises `field_error`."""
        raise NotImplementedError

    def json_schema(self) -> dict[str, Any]:
        raise NotImplementedError

    def expected(self) -> str:
        """What may be written, for the reference."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return self.json_schema()


@dataclass(frozen=True, slots=True)
class Quantity(Leaf):
    """A number with its unit, between `low` and `high` in SI; `above`: `low` itself excluded."""

    unit: str
    low: float
    high: float
    above: bool = False

    def read(self, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            name, example = describe_unit(self.unit)
            hint = f'expected {name} with its unit, for example "{example}"'
            raise field_error(f"{_told(value)} is not {name}", hint)
        try:
            number = parse_quantity(value, self.unit)
        except QuantityError as error:
            raise field_error(error.message, error.hint) from None
        if number > self.high or number < self.low or (self.above and number <= self.low):
            shown = printable(str(value))
            raise field_error(f"{shown} is out of range", f"expected {self._range()}")
        return number

    def _range(self) -> str:
        name, _ = describe_unit(self.unit)
        low, high = (self._limit(limit) for limit in (self.low, self.high))
        return f"{name} above {low} up to {high}" if self.above else f"{name} from {low} to {high}"

    def _limit(self, limit: float) -> str:
        if self.unit == "rad":
            return f"{math.degrees(limit):g} deg"
        return format_quantity(limit, self.unit, digits=6)

    def json_schema(self) -> dict[str, Any]:
        _, example = describe_unit(self.unit)
        return {
            "type": "string",
            "pattern": r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*[A-Za-zµμ°%].*$",
            "examples": [example],
            "description": f"{self._range()}, with its unit",
        }

    def expected(self) -> str:
        return self._range()


@dataclass(frozen=True, slots=True)
class Number(Leaf):
    """A plain number without a unit."""

    low: float
    high: float
    above: bool = False
    integer: bool = False

    def read(self, value: Any) -> float | int:
        wanted = int if self.integer else (int, float)
        if isinstance(value, bool) or not isinstance(value, wanted) or not math.isfinite(value):
            raise field_error(
                f"{_told(value)} is not {self._noun()}", f"expected {self.expected()}"
            )
        if value > self.high or value < self.low or (self.above and value <= self.low):
            raise field_error(f"{value:.12g} is out of range", f"expected {self.expected()}")
        return value if self.integer else float(value)

    def _noun(self) -> str:
        return "a whole number" if self.integer else "a plain number"

    def expected(self) -> str:
        low = f"above {self.low:g} up" if self.above else f"from {self.low:g}"
        return f"{self._noun()} {low} to {self.high:g}"

    def json_schema(self) -> dict[str, Any]:
        low = "exclusiveMinimum" if self.above else "minimum"
        return {
            "type": "integer" if self.integer else "number",
            low: self.low,
            "maximum": self.high,
        }


@dataclass(frozen=True, slots=True)
class Text(Leaf):
    """Printable text; `path`: the name of a file or directory."""

    limit: int
    empty: bool = False
    path: bool = False
    lines: bool = False

    def read(self, value: Any) -> str:
        if not isinstance(value, str):
            hint = f"expected {self.expected()}"
            if isinstance(value, (bool, int, float)):
                hint += f'; put it in quotes: "{printable(str(value))}"'
            raise field_error(f"{_told(value)} is not a text", hint)
        if not value.strip() and not self.empty:
            raise field_error("an empty text", f"expected {self.expected()}")
        if len(value) > self.limit:
            raise field_error(f"a text of {len(value)} characters", f"expected {self.expected()}")
        allowed = "\n" if self.lines else ""
        if bad := next((c for c in value if not c.isprintable() and c not in allowed), None):
            raise field_error(
                f"{printable(value)!r} holds the control character U+{ord(bad):04X}",
                f"expected {self.expected()}",
            )
        return value.strip() if not self.path else value

    def expected(self) -> str:
        noun = "a path" if self.path else "a text" if self.lines else "a text of one line"
        return f"{noun} of at most {self.limit} characters"

    def json_schema(self) -> dict[str, Any]:
        schema: dict[str, Any] = {"type": "string", "maxLength": self.limit}
        return schema if self.empty else schema | {"minLength": 1}


@dataclass(frozen=True, slots=True)
class Choice(Leaf):
    """One of a few words."""

    words: tuple[str, ...]

    def read(self, value: Any) -> str:
        if value not in self.words:
            raise field_error(f"{_told(value)} is not a choice here", f"expected {self.expected()}")
        return str(value)

    def expected(self) -> str:
        return "one of " + ", ".join(self.words)

    def json_schema(self) -> dict[str, Any]:
        return {"enum": list(self.words)}


@dataclass(frozen=True, slots=True)
class Switch(Leaf):
    """true or false."""

    def read(self, value: Any) -> bool:
        if not isinstance(value, bool):
            raise field_error(f"{_told(value)} is neither true nor false", "write true or false")
        return value

    def expected(self) -> str:
        return "true or false"

    def json_schema(self) -> dict[str, Any]:
        return {"type": "boolean"}


@dataclass(frozen=True, slots=True)
class Day(Leaf):
    """A calendar date."""

    def read(self, value: Any) -> date:
        try:
            return date.fromisoformat(value if isinstance(value, str) and len(value) == 10 else "")
        except ValueError:
            raise field_error(
                f"{_told(value)} is not a date", "expected year-month-day, for example 2025-03-31"
            ) from None

    def expected(self) -> str:
        return "a date, year-month-day"

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string", "format": "date"}


def _told(value: object) -> str:
    if value is None:
        return "nothing"
    if isinstance(value, (dict, list)):
        return "a mapping" if isinstance(value, dict) else "a list"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(printable(value)) if isinstance(value, str) else printable(f"{value}")


Name = Annotated[str, Text(100)]
Note = Annotated[str, Text(10_000, empty=True, lines=True)]
Remark = Annotated[str, Text(1_000, empty=True)]
FilePath = Annotated[str, Text(400, path=True)]
Calendar = Annotated[date, Day()]
Flag = Annotated[bool, Switch()]
Share = Annotated[float, Quantity("%", 0.0, 1.0)]
Force = Annotated[float, Quantity("N", 0.0, 1e6, above=True)]
ForceOrZero = Annotated[float, Quantity("N", 0.0, 1e6)]
ForceRate = Annotated[float, Quantity("N/s", 0.0, 1e6, above=True)]
Length = Annotated[float, Quantity("m", 0.0, 10.0, above=True)]
LengthOrZero = Annotated[float, Quantity("m", 0.0, 10.0)]
Pressure = Annotated[float, Quantity("Pa", 1e3, 2e12)]
Duration = Annotated[float, Quantity("s", 0.0, 86_400.0, above=True)]
Delay = Annotated[float, Quantity("s", 0.0, 10.0)]
DurationOrZero = Annotated[float, Quantity("s", 0.0, 86_400.0)]
Rate = Annotated[float, Quantity("Hz", 1.0, 100_000.0)]
Stiffness = Annotated[float, Quantity("N/m", 1.0, 1e12)]
StiffnessError = Annotated[float, Quantity("N/m", 0.0, 1e12, above=True)]
Damping = Annotated[float, Quantity("N s/m", 0.0, 1e9)]
Temperature = Annotated[float, Quantity("degC", -50.0, 150.0)]
