"""Quantities behind which ± and a standard uncertainty may stand, or a range in their place."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple, overload

from pydantic_core import PydanticCustomError

from stepload.declaration.quantities import LARGEST_DOUBT, Quantity, refused, shown
from stepload.errors import printable
from stepload.units import (
    QuantityError,
    describe_unit,
    format_quantity,
    parse_quantity,
    split_uncertainty,
)


class Stated(float):
    """A value in SI that carries what is written behind it."""

    told: Told

    def __new__(
        cls, value: float, sigma: float | None = None, ends: tuple[float, float] | None = None
    ) -> Stated:
        self = super().__new__(cls, value)
        self.told = Told(float(value), sigma, ends)
        return self

    @property
    def sigma(self) -> float | None:
        """Its standard uncertainty; None: not stated."""
        return self.told.sigma


class Told(NamedTuple):
    """A value in SI, its standard uncertainty, and the least and the most that it may be.

    All in the same unit; None where nothing of the kind is stated.
    """

    value: float
    sigma: float | None
    ends: tuple[float, float] | None


@overload
def stated(value: float) -> Told: ...
@overload
def stated(value: None) -> None: ...
@overload
def stated(value: float | None) -> Told | None: ...
def stated(value: float | None) -> Told | None:
    """What a field of an uncertain value was given; None of None."""
    if value is None:
        return None
    return value.told if isinstance(value, Stated) else Told(value, None, None)


@dataclass(frozen=True, slots=True)
class Uncertain(Quantity):
    """A quantity, or with the unit "" a plain number, behind which ± and its σ may stand.

    The uncertainty is a share ("70 MPa ± 5 %") or in the unit of the value ("70 MPa ± 3.5 MPa",
    "0.30 ± 0.03"); "+-" and "+/-" are read as "±". An uncertainty of 0 is refused: nothing that is
    measured is exact, and margins follow from it.

    Where `spread` is above 1, a range may stand instead ("0.5 GPa to 5 GPa", "0.2 to 0.5") of
    something that is not known: every bound then holds at both ends. `spread` is the largest ratio
    of the two ends of a quantity.
    """

    spread: float = 0.0

    def read(self, value: Any) -> Stated:
        if self.spread and isinstance(value, str) and (ends := _TO.split(value.strip()))[1:]:
            return self._range(value, ends)
        before, after = split_uncertainty(value) if isinstance(value, str) else ("", None)
        if after is None:
            return Stated(self._number(value))
        number = self._number(before if self.unit else _plain(before))
        return Stated(number, self._sigma(after, number))

    def _number(self, value: Any) -> float:
        if self.unit:
            return Quantity.read(self, value)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not math.isfinite(value):
            raise refused(f"{shown(value)} is not a plain number", f"expected {self._alone()}")
        if not self._holds(value):
            raise refused(f"{value:.12g} is out of range", f"expected {self._alone()}")
        return float(value)

    def _range(self, text: str, ends: list[str]) -> Stated:
        """A value between two ends: the geometric mean of a quantity, else the middle."""
        if len(ends) != 2 or not all(ends):
            raise refused(f"{printable(text)!r} is not a range", f"expected {self.expected()}")
        try:
            low, high = (self._number(end if self.unit else _plain(end)) for end in ends)
        except PydanticCustomError as error:
            hint = f"expected a range as in {self._example}; both ends: {_hint(error)}"
            raise refused(f"the range {printable(text)!r}: {error.message()}", hint) from None
        if not low < high:
            raise refused(
                f"the range {printable(text)!r} does not rise",
                "write the least first and the most behind it; what is known exactly is no range",
            )
        if not self.unit:
            return Stated(0.5 * (low + high), None, (low, high))
        if high > self.spread * low:
            raise refused(
                f"the range {printable(text)!r} is a factor of {high / low:.3g} wide",
                f"expected at most {self.spread:g}: nothing can be planned for all of it; find out"
                " what kind of material it is",
            )
        return Stated(math.sqrt(low * high), None, (low, high))

    def _sigma(self, text: str, number: float) -> float:
        """The standard uncertainty in SI of `number`, read from `text`."""
        example = f"{describe_unit(self.unit)[1]} ± 5 %" if self.unit else "0.30 ± 0.03"
        hint = f'expected a standard uncertainty, as in "{example}"'
        plain = _plain(text)
        try:
            if text.endswith("%"):
                sigma = parse_quantity(text, "%") * abs(number)
            elif isinstance(plain, float) and not self.unit:
                sigma = plain
            else:
                sigma = parse_quantity(text, self.unit or "%")
        except QuantityError as error:
            raise refused(f"the uncertainty: {error.message}", hint) from None
        largest = LARGEST_DOUBT * abs(number) if self.unit else 0.25 * (self.high - self.low)
        if not 0.0 < sigma <= largest:
            end = format_quantity(largest, self.unit) if self.unit else f"{largest:g}"
            raise refused(
                f"the uncertainty {printable(text)!r} is out of range",
                f"expected one above 0, for nothing that is measured is exact, up to {end}; leave"
                " it out where it is not known",
            )
        return sigma

    def _alone(self) -> str:
        if self.unit:
            return Quantity.expected(self)
        low = f"above {self.low:g} up" if self.above else f"from {self.low:g}"
        return f"a plain number {low} to {self.high:g}"

    def expected(self) -> str:
        ranged = f", or a range: {self._example}" if self.spread else ""
        return f"{self._alone()}, ± its uncertainty where known{ranged}"

    @property
    def _example(self) -> str:
        return "`0.5 GPa to 5 GPa`" if self.unit else "`0.2 to 0.5`"

    def json_schema(self) -> dict[str, Any]:
        if not self.unit:
            least = "exclusiveMinimum" if self.above else "minimum"
            number = {"type": "number", least: self.low, "maximum": self.high}
            pattern = _NUMBER_AND_MORE.replace("±", "±|to") if self.spread else _NUMBER_AND_MORE
            text = {"type": "string", "pattern": pattern, "examples": ["0.30 ± 0.03"]}
            return {"anyOf": [number, text], "x-expected": self.expected()}
        schema = Quantity.json_schema(self)
        examples = [*schema["examples"], f"{schema['examples'][0]} ± 5 %"]
        examples += [self._example.strip("`")] if self.spread else []
        return schema | {"examples": examples}


_TO = re.compile(r"\s+to(?:\s+|$)")
_PLAIN = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_NUMBER_AND_MORE = rf"^\s*{_PLAIN.pattern}\s*(±|\+/-|\+-).+$"


def _plain(text: str) -> float | str:
    """The plain number that `text` is; `text` itself where it is none."""
    return float(text) if _PLAIN.fullmatch(text) else text


def _hint(error: PydanticCustomError) -> str:
    return str((error.context or {}).get("hint", ""))


UncertainForce = Annotated[float, Uncertain("N", 0.0, 1e6, above=True)]
UncertainLengthOrZero = Annotated[float, Uncertain("m", 0.0, 10.0)]
UncertainLength = Annotated[float, Uncertain("m", 0.0, 10.0, above=True)]
UncertainPressure = Annotated[float, Uncertain("Pa", 1e3, 2e12)]
Modulus = Annotated[float, Uncertain("Pa", 1e3, 2e12, spread=100.0)]
PoissonRatio = Annotated[float, Uncertain("", -1.0, 0.5, above=True, spread=math.inf)]
