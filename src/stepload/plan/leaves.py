"""What may be written at one key: how it is read, described and put into the JSON Schema."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from stepload.plan.problems import printable
from stepload.units import (
    QuantityError,
    describe_unit,
    format_quantity,
    parse_quantity,
    split_uncertainty,
)

_LONGEST_PATH = 400
_LARGEST_DOUBT = 0.5
"""A quantity with a larger relative standard uncertainty is not known, or has a wrong unit."""
_SUFFIXES = {"degC": "c", "%": "", "m/s": "m_s", "m/s^2": "m_s2", "1/K": "per_k"}


class LeafError(Exception):
    """A value that may not stand where it does.

    `hint` says what was expected; `quoted` whether the value in quotes would do.
    """

    def __init__(self, message: str, hint: str, *, quoted: bool = False) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.quoted = quoted


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
        if isinstance(value, bool) or not isinstance(value, (str, int, float)):
            name, example = describe_unit(self.unit)
            hint = f'expected {name} with its unit, for example "{example}"'
            raise LeafError(f"{_shown(value)} is not {name}", hint)
        try:
            number = parse_quantity(value, self.unit)
        except QuantityError as error:
            raise LeafError(error.message, error.hint) from None
        if number > self.high or number < self.low or (self.above and number <= self.low):
            shown = printable(str(value))
            raise LeafError(f"{shown} is out of range", f"expected {self.expected()}")
        return number

    def expected(self) -> str:
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
            "pattern": r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*(1/)?[A-Za-zµμ°%].*$",
            "examples": [example],
            "description": f"{self.expected()}, with its unit",
        }


class Relative(float):
    """A share of another value of the same section."""


@dataclass(frozen=True, slots=True)
class Sigma(Quantity):
    """A standard uncertainty of the field `of`: in its unit, or a share of it ("1 %")."""

    of: str = ""

    def read(self, value: Any) -> float:
        if not isinstance(value, str) or not value.rstrip().endswith("%"):
            return Quantity.read(self, value)
        return Relative(Quantity("%", 0.0, _LARGEST_DOUBT, above=True).read(value))

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


@dataclass(frozen=True, slots=True)
class Number:
    """A plain number without a unit, between `low` and `high`; `above`: `low` itself excluded."""

    low: float
    high: float
    above: bool = False
    integer: bool = False

    def read(self, value: Any) -> float | int:
        wanted = int if self.integer else (int, float)
        if isinstance(value, bool) or not isinstance(value, wanted) or not math.isfinite(value):
            raise LeafError(f"{_shown(value)} is not {self._noun()}", f"expected {self.expected()}")
        if value > self.high or value < self.low or (self.above and value <= self.low):
            raise LeafError(f"{value:.12g} is out of range", f"expected {self.expected()}")
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


class Stated(NamedTuple):
    """A value in SI, its standard uncertainty, and the least and the most that it may be.

    All in the same unit; None where nothing of the kind is stated.
    """

    value: float
    sigma: float | None
    ends: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Uncertain:
    """A quantity, or a plain number, behind which ± and its standard uncertainty may stand.

    The uncertainty is a share ("70 MPa ± 5 %") or in the unit of the value ("70 MPa ± 3.5 MPa",
    "0.30 ± 0.03"); "+-" and "+/-" are read as "±". An uncertainty of 0 is refused: nothing that is
    measured is exact, and margins follow from it.

    Where `spread` is above 1, a range may stand instead ("0.5 GPa to 5 GPa", "0.2 to 0.5") of
    something that is not known: every bound then holds at both ends. `spread` is the largest ratio
    of the two ends of a quantity.
    """

    leaf: Quantity | Number
    spread: float = 0.0

    def read(self, value: Any) -> Stated:
        if self.spread and isinstance(value, str) and (ends := _TO.split(value.strip()))[1:]:
            return self._range(value, ends)
        before, after = split_uncertainty(value) if isinstance(value, str) else ("", None)
        if after is None:
            return Stated(float(self.leaf.read(value)), None)
        number = float(self.leaf.read(before if self._unit else _plain(before)))
        return Stated(number, self._sigma(after, number))

    def _range(self, text: str, ends: list[str]) -> Stated:
        """A value between two ends: the geometric mean of a quantity, else the middle."""
        if len(ends) != 2 or not all(ends):
            raise LeafError(f"{printable(text)!r} is not a range", f"expected {self.expected()}")
        try:
            low, high = (float(self.leaf.read(e if self._unit else _plain(e))) for e in ends)
        except LeafError as error:
            hint = f"expected a range as in {self._example}; both ends: {error.hint}"
            raise LeafError(f"the range {printable(text)!r}: {error.message}", hint) from None
        if not low < high:
            raise LeafError(
                f"the range {printable(text)!r} does not rise",
                "write the least first and the most behind it; what is known exactly is no range",
            )
        if not self._unit:
            return Stated(0.5 * (low + high), None, (low, high))
        if high > self.spread * low:
            raise LeafError(
                f"the range {printable(text)!r} is a factor of {high / low:.3g} wide",
                f"expected at most {self.spread:g}: nothing can be planned for all of it; find out"
                " what kind of material it is",
            )
        return Stated(math.sqrt(low * high), None, (low, high))

    @property
    def _unit(self) -> str:
        """The SI unit of the value; "" of a plain number."""
        return self.leaf.unit if isinstance(self.leaf, Quantity) else ""

    def _sigma(self, text: str, number: float) -> float:
        """The standard uncertainty in SI of `number`, read from `text`."""
        example = f"{describe_unit(self._unit)[1]} ± 5 %" if self._unit else "0.30 ± 0.03"
        hint = f'expected a standard uncertainty, as in "{example}"'
        plain = _plain(text)
        try:
            if text.endswith("%"):
                sigma = parse_quantity(text, "%") * abs(number)
            elif isinstance(plain, float) and not self._unit:
                sigma = plain
            else:
                sigma = parse_quantity(text, self._unit or "%")
        except QuantityError as error:
            raise LeafError(f"the uncertainty: {error.message}", hint) from None
        largest = _LARGEST_DOUBT * abs(number)
        if isinstance(self.leaf, Number):
            largest = 0.25 * (self.leaf.high - self.leaf.low)
        if not 0.0 < sigma <= largest:
            end = format_quantity(largest, self._unit) if self._unit else f"{largest:g}"
            raise LeafError(
                f"the uncertainty {printable(text)!r} is out of range",
                f"expected one above 0, for nothing that is measured is exact, up to {end}; leave"
                " it out where it is not known",
            )
        return sigma

    def expected(self) -> str:
        ranged = f", or a range: {self._example}" if self.spread else ""
        return f"{self.leaf.expected()}, ± its uncertainty where known{ranged}"

    @property
    def _example(self) -> str:
        return "`0.5 GPa to 5 GPa`" if self._unit else "`0.2 to 0.5`"

    def json_schema(self) -> dict[str, Any]:
        schema = self.leaf.json_schema()
        if isinstance(self.leaf, Number):
            pattern = _NUMBER_AND_MORE.replace("±", "±|to") if self.spread else _NUMBER_AND_MORE
            text = {"type": "string", "pattern": pattern, "examples": ["0.30 ± 0.03"]}
            return {"anyOf": [schema, text]}
        examples = [*schema["examples"], f"{schema['examples'][0]} ± 5 %"]
        examples += [self._example.strip("`")] if self.spread else []
        return schema | {"examples": examples, "description": f"{self.expected()}, with its unit"}


_TO = re.compile(r"\s+to(?:\s+|$)")
_PLAIN = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NUMBER_AND_MORE = rf"^\s*{_PLAIN.pattern}\s*(±|\+/-|\+-).+$"


def _plain(text: str) -> float | str:
    """The plain number that `text` is; `text` itself where it is none."""
    return float(text) if _PLAIN.fullmatch(text) else text


@dataclass(frozen=True, slots=True)
class Text:
    """Printable text of at most `limit` characters; `lines`: line breaks are allowed."""

    limit: int
    empty: bool = False
    lines: bool = False

    def read(self, value: Any) -> str:
        return _text(value, self.limit, self.expected(), empty=self.empty, lines=self.lines).strip()

    def expected(self) -> str:
        noun = "a text" if self.lines else "a text of one line"
        return f"{noun} of at most {self.limit} characters"

    def json_schema(self) -> dict[str, Any]:
        schema: dict[str, Any] = {"type": "string", "maxLength": self.limit}
        return schema if self.empty else schema | {"minLength": 1}


@dataclass(frozen=True, slots=True)
class FileName:
    """The path of a file or directory, as written."""

    def read(self, value: Any) -> Path:
        return Path(_text(value, _LONGEST_PATH, self.expected()))

    def expected(self) -> str:
        return f"a path of at most {_LONGEST_PATH} characters"

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string", "maxLength": _LONGEST_PATH, "minLength": 1}


def _text(
    value: Any, limit: int, expected: str, *, empty: bool = False, lines: bool = False
) -> str:
    hint = f"expected {expected}"
    if not isinstance(value, str):
        quoted = isinstance(value, (bool, int, float))
        raise LeafError(f"{_shown(value)} is not a text", hint, quoted=quoted)
    if not value.strip() and not empty:
        raise LeafError("an empty text", hint)
    if len(value) > limit:
        raise LeafError(f"a text of {len(value)} characters", hint)
    allowed = "\n" if lines else ""
    if bad := next((c for c in value if not c.isprintable() and c not in allowed), None):
        shown = f"{printable(value)!r} holds the control character U+{ord(bad):04X}"
        raise LeafError(shown, hint)
    return value


@dataclass(frozen=True, slots=True)
class Choice:
    """One of a few words; read as the element of `words` that it equals."""

    words: tuple[str, ...]

    def read(self, value: Any) -> str:
        for word in self.words:
            if value == word:
                return word
        raise LeafError(f"{_shown(value)} is not a choice here", f"expected {self.expected()}")

    def expected(self) -> str:
        return "one of " + ", ".join(self.words)

    def json_schema(self) -> dict[str, Any]:
        return {"enum": [str(word) for word in self.words]}


@dataclass(frozen=True, slots=True)
class Switch:
    """true or false."""

    def read(self, value: Any) -> bool:
        if not isinstance(value, bool):
            raise LeafError(f"{_shown(value)} is neither true nor false", "write true or false")
        return value

    def expected(self) -> str:
        return "true or false"

    def json_schema(self) -> dict[str, Any]:
        return {"type": "boolean"}


@dataclass(frozen=True, slots=True)
class Day:
    """A calendar date."""

    def read(self, value: Any) -> date:
        try:
            return date.fromisoformat(value if isinstance(value, str) and len(value) == 10 else "")
        except ValueError:
            raise LeafError(
                f"{_shown(value)} is not a date", "expected year-month-day, for example 2025-03-31"
            ) from None

    def expected(self) -> str:
        return "a date, year-month-day"

    def json_schema(self) -> dict[str, Any]:
        return {"type": "string", "format": "date"}


@dataclass(frozen=True, slots=True)
class Version:
    """The version of a file format: this number and no other."""

    number: int

    def read(self, value: Any) -> int:
        if isinstance(value, bool) or value != self.number:
            nothing_or_bool = isinstance(value, bool) or value in (None, {}, [])
            shown = _shown(value) if nothing_or_bool else repr(printable(str(value)))
            raise LeafError(f"{shown} is not accepted here", f"expected {self.number}")
        return self.number

    def expected(self) -> str:
        return f"`{self.number}`"

    def json_schema(self) -> dict[str, Any]:
        return {"const": self.number, "type": "integer"}


Leaf = Quantity | Number | Uncertain | Text | FileName | Choice | Switch | Day | Version


def _shown(value: object) -> str:
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
FilePath = Annotated[Path, FileName()]
Calendar = Annotated[date, Day()]
Flag = Annotated[bool, Switch()]
Share = Annotated[float, Quantity("%", 0.0, 1.0)]
Accuracy = Annotated[float, HalfWidth("%", 1e-3, 0.5)]
Force = Annotated[float, Quantity("N", 0.0, 1e6, above=True)]
ForceOrZero = Annotated[float, Quantity("N", 0.0, 1e6)]
ForceRate = Annotated[float, Quantity("N/s", 0.0, 1e6, above=True)]
Torque = Annotated[float, Quantity("N m", 0.0, 1e6, above=True)]
Length = Annotated[float, Quantity("m", 0.0, 10.0, above=True)]
LengthOrZero = Annotated[float, Quantity("m", 0.0, 10.0)]
UncertainForce = Annotated[float, Uncertain(Quantity("N", 0.0, 1e6, above=True))]
UncertainLengthOrZero = Annotated[float, Uncertain(Quantity("m", 0.0, 10.0))]
UncertainLength = Annotated[float, Uncertain(Quantity("m", 0.0, 10.0, above=True))]
Pressure = Annotated[float, Quantity("Pa", 1e3, 2e12)]
UncertainPressure = Annotated[float, Uncertain(Quantity("Pa", 1e3, 2e12))]
Modulus = Annotated[float, Uncertain(Quantity("Pa", 1e3, 2e12), spread=100.0)]
PoissonRatio = Annotated[float, Uncertain(Number(-1.0, 0.5, above=True), spread=math.inf)]
Duration = Annotated[float, Quantity("s", 0.0, 86_400.0, above=True)]
Delay = Annotated[float, Quantity("s", 0.0, 10.0)]
DurationOrZero = Annotated[float, Quantity("s", 0.0, 86_400.0)]
Rate = Annotated[float, Quantity("Hz", 1.0, 100_000.0)]
Stiffness = Annotated[float, Quantity("N/m", 1.0, 1e12)]
StiffnessError = Annotated[float, Quantity("N/m", 0.0, 1e12, above=True)]
StiffnessSigma = Annotated[float, Sigma("N/m", 0.0, 1e12, above=True, of="stiffness_n_per_m")]
Compliance = Annotated[float, Quantity("m/N", -0.01, 0.01)]
ComplianceError = Annotated[float, Quantity("m/N", 0.0, 0.01, above=True)]
Correlation = Annotated[float, Number(-1.0, 1.0)]
ShareAcross = Annotated[float, Quantity("%", -2.0, 2.0)]
Damping = Annotated[float, Quantity("N s/m", 0.0, 1e9)]
Angle = Annotated[float, Quantity("rad", -100.0, 100.0)]
Offset = Annotated[float, Quantity("m", -10.0, 10.0)]
Temperature = Annotated[float, Quantity("degC", -50.0, 150.0)]
Expansion = Annotated[float, Quantity("1/K", 0.0, 1e-3)]
Degrees = Annotated[float, Number(1.0, 1e6)]
Axis = Annotated[str, Choice(("+fx", "-fx", "+fy", "-fy", "+fz", "-fz"))]
