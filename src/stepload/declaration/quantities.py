"""What may be written at one key: types of pydantic with units, limits and ± of their own.

A field `hold_s: Duration` reads "3 s" and holds 3.0. What a plan may say is read with the context
`WRITTEN`: a quantity then needs its unit. Without it, as where a section is made in code, SI floats
are taken as they stand. What a type is called in words, for errors and tables, follows from its
JSON Schema (`stepload.declaration.sections.expected`).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    StrictBool,
    StringConstraints,
    ValidationInfo,
    WithJsonSchema,
)
from pydantic_core import PydanticCustomError, core_schema

from stepload.errors import printable
from stepload.units import (
    QuantityError,
    describe_unit,
    format_quantity,
    parse_quantity,
)

WRITTEN = "written"
"""Context of a validation whose values are those of a file: quantities have their unit."""
EXACT = "exact"
"""Context of a serialisation that keeps every digit."""
REFUSED = "refused"
"""Type of an error that says itself what is wrong and what to do."""
LARGEST_DOUBT = 0.5
"""A quantity with a larger relative standard uncertainty is not known, or has a wrong unit."""
_SUFFIXES = {"degC": "c", "%": "", "m/s": "m_s", "m/s^2": "m_s2", "1/K": "per_k"}


def refused(message: str, hint: str) -> PydanticCustomError:
    """The error of a value that may not stand where it does; `hint` says what was expected."""
    return PydanticCustomError(REFUSED, "{message}", {"message": message, "hint": hint})


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number with its unit, between `low` and `high` in SI; `above`: `low` itself excluded."""

    unit: str
    low: float
    high: float
    above: bool = False

    @property
    def suffix(self) -> str:
        """How the name of an attribute in this unit ends: "_n_per_m" for N/m, "" for a share."""
        rule = self.unit.lower().replace(" ", "_").replace("/", "_per_")
        suffix = _SUFFIXES.get(self.unit, rule)
        return f"_{suffix}" if suffix else ""

    def read(self, value: Any) -> float:
        """The number in SI; raises PydanticCustomError."""
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            name, example = describe_unit(self.unit)
            hint = f'expected {name} with its unit, for example "{example}"'
            raise refused(f"{shown(value)} is not {name}", hint)
        try:
            number = parse_quantity(value, self.unit)
        except QuantityError as error:
            raise refused(error.message, error.hint) from None
        if not self._holds(number):
            text = printable(str(value))
            raise refused(f"{text} is out of range", f"expected {self.expected()}")
        return number

    def _holds(self, number: float) -> bool:
        return self.low <= number <= self.high and not (self.above and number == self.low)

    def expected(self) -> str:
        """What may be written, in words."""
        name, _ = describe_unit(self.unit)
        low, high = self.written(self.low), self.written(self.high)
        return f"{name} above {low} up to {high}" if self.above else f"{name} from {low} to {high}"

    def written(self, value: float) -> str:
        """`value` as a plan would write it."""
        if self.unit == "rad":
            return f"{math.degrees(value):g} deg"
        return format_quantity(value, self.unit, digits=6)

    def _serialised(self, value: float, info: Any) -> str:
        return f"{value!r} {self.unit}" if info.context == EXACT else self.written(value)

    def _validated(self, value: Any, info: ValidationInfo) -> Any:
        return self.read(value) if info.context == WRITTEN else value

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.with_info_plain_validator_function(
            self._validated,
            serialization=core_schema.plain_serializer_function_ser_schema(
                self._serialised, info_arg=True
            ),
        )

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return self.json_schema()

    def json_schema(self) -> dict[str, Any]:
        """JSON Schema of the text; `x-expected` says what it is in words."""
        _, example = describe_unit(self.unit)
        return {
            "type": "string",
            "pattern": r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*(1/)?[A-Za-zµμ°%].*$",
            "examples": [example],
            "x-expected": self.expected(),
        }


@dataclass(frozen=True, slots=True)
class Setting(Quantity):
    """An option of a driver: a quantity whose limits hold in code too."""

    def _validated(self, value: Any, info: ValidationInfo) -> float:
        if info.context == WRITTEN:
            return self.read(value)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not self._holds(value):  # also refuses NaN
            raise refused(f"{shown(value)} {self.unit}", f"expected {self.expected()}")
        return float(value)


class Relative(float):
    """A share of another value of the same section."""


@dataclass(frozen=True, slots=True)
class Sigma(Quantity):
    """A standard uncertainty: in the unit of its value, or a share of it ("1 %")."""

    def read(self, value: Any) -> float:
        if not isinstance(value, str) or not value.rstrip().endswith("%"):
            return Quantity.read(self, value)
        return Relative(Quantity("%", 0.0, LARGEST_DOUBT, above=True).read(value))

    def expected(self) -> str:
        return f"{Quantity.expected(self)}, or a share of the value"


@dataclass(frozen=True, slots=True)
class HalfWidth(Quantity):
    """Half of an interval as a share of what it is about: "±5 %", or "5 %"."""

    def read(self, value: Any) -> float:
        text = _PLUS_MINUS.sub("", value, count=1) if isinstance(value, str) else value
        return Quantity.read(self, text)

    def json_schema(self) -> dict[str, Any]:
        schema = Quantity.json_schema(self)
        pattern = schema["pattern"].replace(r"^\s*", r"^\s*(±|\+/?-)?\s*", 1)
        return schema | {"pattern": pattern, "examples": ["±5 %"]}


_PLUS_MINUS = re.compile(r"^\s*(?:±|\+/?-)\s*(?=[0-9.])")


def number(low: float, high: float, *, above: bool = False) -> Any:
    """A plain number between two limits; `above`: the lower one excluded."""
    least: Any = {"gt": low} if above else {"ge": low}
    return Field(strict=True, allow_inf_nan=False, le=high, **least)


@dataclass(frozen=True, slots=True)
class Choice:
    """One of a few words."""

    words: tuple[str, ...]

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.literal_schema(list(self.words))


def _printable(lines: bool, value: str) -> str:
    allowed = "\n" if lines else ""
    if bad := next((c for c in value if not c.isprintable() and c not in allowed), None):
        text = f"{printable(value)!r} holds the control character U+{ord(bad):04X}"
        raise refused(text, "remove it: a text" + ("" if lines else " of one line"))
    return value


def _one_line(value: str) -> str:
    return _printable(False, value)


def _lines(value: str) -> str:
    return _printable(True, value)


_DAY = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")


def _day(value: Any) -> Any:
    """Only year-month-day is a date: pydantic would also read seconds since 1970."""
    if isinstance(value, date):
        return value
    try:
        return date.fromisoformat(value if _DAY.fullmatch(value) else "")
    except (ValueError, TypeError):
        hint = "expected year-month-day, for example 2025-03-31"
        raise refused(f"{shown(value)} is not a date", hint) from None


def shown(value: object) -> str:
    """A value as an error shows it."""
    if value is None:
        return "nothing"
    if isinstance(value, (dict, list)):
        return "a mapping" if isinstance(value, dict) else "a list"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(printable(value)) if isinstance(value, str) else printable(f"{value}")


def _text(limit: int, least: int | None = None) -> StringConstraints:
    return StringConstraints(strict=True, strip_whitespace=True, min_length=least, max_length=limit)


Name = Annotated[str, _text(100, 1), AfterValidator(_one_line)]
Note = Annotated[str, _text(10_000), AfterValidator(_lines)]
Remark = Annotated[str, _text(1_000), AfterValidator(_one_line)]
Tag = Annotated[str, _text(200, 1), AfterValidator(_one_line)]
PathText = Annotated[str, _text(400, 1), AfterValidator(_one_line)]
Verbatim = Annotated[str, StringConstraints(strict=True, max_length=400), AfterValidator(_one_line)]
"""A text whose spaces at both ends count."""


def _vector(value: Any) -> tuple[float, float, float]:
    items = value if isinstance(value, (list, tuple)) else ()
    numbers = [v for v in items if isinstance(v, (int, float)) and not isinstance(v, bool)]
    if not len(items) == len(numbers) == 3 or not all(map(math.isfinite, numbers)):
        hint = "expected three finite numbers, for example [0, 0, -1]"
        raise refused("this is not a list of three plain numbers", hint)
    x, y, z = map(float, numbers)
    return (x, y, z)


Vector = Annotated[
    tuple[float, float, float],
    BeforeValidator(_vector),
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": "number"},
            "minItems": 3,
            "maxItems": 3,
            "x-expected": "a list of three plain numbers",
        }
    ),
]


def path_of(value: Any) -> Path:
    """The path that a text names; raises PydanticCustomError."""
    if isinstance(value, Path):
        return value
    hint = "expected a path of at most 400 characters"
    if not isinstance(value, str):
        raise refused(f"{shown(value)} is not a text", hint)
    if not value.strip() or len(value) > 400:
        raise refused("an empty text" if not value.strip() else f"{len(value)} characters", hint)
    return Path(_one_line(value))


def _whole(value: Any) -> Any:
    """Neither true nor 1.0 is the version 1."""
    return value if type(value) is int or value is None else str(value).lower()


Version = Annotated[Literal[1], BeforeValidator(_whole)]
"""The version of a file format."""
FilePath = Annotated[Path, BeforeValidator(path_of)]
Calendar = Annotated[date, BeforeValidator(_day)]
Flag = StrictBool
Share = Annotated[float, Quantity("%", 0.0, 1.0)]
Accuracy = Annotated[float, HalfWidth("%", 1e-3, 0.5)]
Force = Annotated[float, Quantity("N", 0.0, 1e6, above=True)]
ForceOrZero = Annotated[float, Quantity("N", 0.0, 1e6)]
ForceRate = Annotated[float, Quantity("N/s", 0.0, 1e6, above=True)]
Torque = Annotated[float, Quantity("N m", 0.0, 1e6, above=True)]
Length = Annotated[float, Quantity("m", 0.0, 10.0, above=True)]
LengthOrZero = Annotated[float, Quantity("m", 0.0, 10.0)]
Pressure = Annotated[float, Quantity("Pa", 1e3, 2e12)]
Duration = Annotated[float, Quantity("s", 0.0, 86_400.0, above=True)]
Delay = Annotated[float, Quantity("s", 0.0, 10.0)]
DurationOrZero = Annotated[float, Quantity("s", 0.0, 86_400.0)]
Rate = Annotated[float, Quantity("Hz", 1.0, 100_000.0)]
Stiffness = Annotated[float, Quantity("N/m", 1.0, 1e12)]
StiffnessError = Annotated[float, Quantity("N/m", 0.0, 1e12, above=True)]
StiffnessSigma = Annotated[float, Sigma("N/m", 0.0, 1e12, above=True)]
Compliance = Annotated[float, Quantity("m/N", -0.01, 0.01)]
ComplianceError = Annotated[float, Quantity("m/N", 0.0, 0.01, above=True)]
Correlation = Annotated[float, number(-1.0, 1.0)]
ShareAcross = Annotated[float, Quantity("%", -2.0, 2.0)]
Damping = Annotated[float, Quantity("N s/m", 0.0, 1e9)]
Angle = Annotated[float, Quantity("rad", -100.0, 100.0)]
Offset = Annotated[float, Quantity("m", -10.0, 10.0)]
Temperature = Annotated[float, Quantity("degC", -50.0, 150.0)]
Expansion = Annotated[float, Quantity("1/K", 0.0, 1e-3)]
Degrees = Annotated[float, number(1.0, 1e6)]
Baud = Annotated[int, number(50, 4_000_000)]
Axis = Annotated[str, Choice(("+fx", "-fx", "+fy", "-fy", "+fz", "-fz"))]
