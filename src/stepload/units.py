"""Physical quantities written as text ("28.7 mm"): number and unit in, SI float out.

A unit is a product of symbols ("N s/m", "m/s^2", "kN/mm", "1/K"); everything after the first "/"
divides. Temperatures are given in °C inside stepload ("degC"), their differences in kelvin ("K"),
everything else in SI base units.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from unicodedata import normalize

from stepload.errors import BadInputError

MAX_TEXT = 64
"""Longest quantity text that is looked at, in characters."""

_ZERO_CELSIUS_K = Decimal("273.15")

_Dimension = tuple[int, int, int, int, int]
"""Exponents of m, kg, s, K, rad."""

_NONE: _Dimension = (0, 0, 0, 0, 0)

_PREFIXES = {"p": -12, "n": -9, "µ": -6, "m": -3, "c": -2, "": 0, "k": 3, "M": 6, "G": 9}

_SYMBOLS: dict[str, tuple[_Dimension, str, str]] = {
    "m": ((1, 0, 0, 0, 0), "1", "nµmc"),
    "g": ((0, 1, 0, 0, 0), "0.001", "mk"),
    "s": ((0, 0, 1, 0, 0), "1", "nµm"),
    "min": ((0, 0, 1, 0, 0), "60", ""),
    "h": ((0, 0, 1, 0, 0), "3600", ""),
    "Hz": ((0, 0, -1, 0, 0), "1", "kM"),
    "N": ((1, 1, -2, 0, 0), "1", "pnµmkMG"),
    "Pa": ((-1, 1, -2, 0, 0), "1", "kMG"),
    "K": ((0, 0, 0, 1, 0), "1", "m"),
    "rad": ((0, 0, 0, 0, 1), "1", "mµ"),
    "deg": ((0, 0, 0, 0, 1), repr(math.pi / 180.0), ""),
    "%": (_NONE, "0.01", ""),
}
"""Symbol: dimension, size in SI, prefixes. Only prefixes in use, so that "Mm" is no length."""

_NAMES: dict[_Dimension, tuple[str, str]] = {
    (1, 0, 0, 0, 0): ("a length", "28.7 mm"),
    (0, 1, 0, 0, 0): ("a mass", "20 kg"),
    (0, 0, 1, 0, 0): ("a time", "3 s"),
    (0, 0, -1, 0, 0): ("a rate", "1 kHz"),
    (1, 1, -2, 0, 0): ("a force", "50 N"),
    (-1, 1, -2, 0, 0): ("a pressure", "2.75 GPa"),
    (0, 1, -2, 0, 0): ("a stiffness", "3.49e6 N/m"),
    (0, -1, 2, 0, 0): ("a compliance", "5 µm/N"),
    (0, 1, -1, 0, 0): ("a damping", "3.87e4 N s/m"),
    (1, 0, -1, 0, 0): ("a speed", "5 mm/s"),
    (1, 0, -2, 0, 0): ("an acceleration", "0.5 m/s^2"),
    (1, 1, -3, 0, 0): ("a force rate", "1.5 N/s"),
    (0, 0, 0, 1, 0): ("a temperature", "23 degC"),
    (0, 0, 0, -1, 0): ("a change per kelvin", "11.7e-6 1/K"),
    (2, 1, -2, 0, 0): ("a torque", "10 N m"),
    (0, 0, 0, 0, 1): ("an angle", "15 deg"),
    (-1, -1, 2, 0, 1): ("an angle over a force", "25 µrad/N"),
    _NONE: ("a share", "2 %"),
}


class QuantityError(BadInputError):
    """A text that is not the expected quantity."""


@dataclass(frozen=True, slots=True)
class _Unit:
    dimension: _Dimension
    scale: Decimal


def _symbols() -> dict[str, _Unit]:
    table = {}
    for symbol, (dimension, size, prefixes) in _SYMBOLS.items():
        for prefix in ("", *prefixes):
            scale = Decimal(size).scaleb(_PREFIXES[prefix])
            table[prefix + symbol] = _Unit(dimension, scale)
            if prefix == "µ":
                table["u" + symbol] = table["μ" + symbol] = table[prefix + symbol]
    table["°"] = table["deg"]
    return table


_UNITS = _symbols()
_CELSIUS = ("degC", "°C")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_FACTOR = re.compile(r"([A-Za-zµμ]+|[%°])(?:\^?([-+]?[0-9]|[²³]))?")
_POWERS = {"²": 2, "³": 3}
_PLUS_MINUS = re.compile(r"±|\+/-|\+-")


def _parse_unit(text: str, wanted: _Unit | None = None) -> _Unit:
    """The unit of a text; an unknown one that stands alone is held against those like `wanted`."""
    if text in _CELSIUS:
        return _Unit(_UNITS["K"].dimension, Decimal(1))
    exponents = [0, 0, 0, 0, 0]
    scale = Decimal(1)
    first = 1 if text.startswith("1/") else 0
    for position, part in enumerate(text.removeprefix("1/").split("/"), first):
        factors = re.split(r"[ *·]+", part.strip())
        if position and len(factors) > 1:
            raise QuantityError(
                f"the unit {text!r} can be read in two ways",
                hint='write what multiplies before the "/", as in "N s/m"',
            )
        if factors.count("%") > 1:
            raise QuantityError(f"{text!r} has two signs of percent", hint="write one")
        for factor in factors:
            match = _FACTOR.fullmatch(factor)
            if match is None or match[1] not in _UNITS:
                raise QuantityError(
                    f"unknown unit {factor!r}",
                    hint=_nearest(factor, wanted if factor == text else None),
                )
            unit = _UNITS[match[1]]
            power = int(_POWERS.get(match[2], match[2] or 1)) * (-1 if position else 1)
            exponents = [e + power * d for e, d in zip(exponents, unit.dimension, strict=True)]
            scale *= unit.scale**power
    a, b, c, d, e = exponents
    return _Unit((a, b, c, d, e), scale)


def _nearest(symbol: str, wanted: _Unit | None) -> str:
    known = [*_UNITS, *_CELSIUS]
    if wanted is not None:
        known = [each for each in known if _parse_unit(each).dimension == wanted.dimension]
    near = [u for u in known if u.lower() == symbol.lower()]
    near = near or get_close_matches(symbol, known, n=3, cutoff=0.5)
    near = list(dict.fromkeys(normalize("NFKC", unit) for unit in near))  # µ has two code points
    if near:
        return "did you mean " + " or ".join(repr(unit) for unit in near[:3]) + "?"
    return "units are written like N, mm, GPa, N/m, N s/m, kHz, %, degC"


def describe_unit(unit: str) -> tuple[str, str]:
    """What a quantity in `unit` is called, with its article, and an example of one."""
    return ("a temperature difference", "0.5 K") if unit == "K" else _named(unit)


def _named(unit: str) -> tuple[str, str]:
    return _NAMES.get(_parse_unit(unit).dimension, (f"a quantity in {unit}", f"1 {unit}"))


def parse_named(name: str, text: str, unit: str) -> float:
    """`parse_quantity`, whose errors begin with `name`, such as an option's.

    Raises:
        BadInputError: as there.
    """
    try:
        return parse_quantity(text, unit)
    except QuantityError as error:
        raise BadInputError(f"{name}: {error.message}", hint=error.hint) from None


def parse_quantity(text: object, unit: str) -> float:
    """`text` ("28.7 mm") in the SI unit `unit` ("m"); finite.

    Args:
        text: what the user wrote; anything but a text with number and unit is an error.
        unit: SI unit wanted: it sets the dimension. "degC" for temperatures, "K" for their
            differences (which nobody gives in °C), "%" for shares (2 % is returned as 0.02).

    Raises:
        QuantityError: no unit, unknown unit, other dimension, not finite, not a quantity at all.
    """
    name, example = describe_unit(unit)
    expected = f'expected {name} with its unit, for example "{example}"'
    if isinstance(text, bool) or not isinstance(text, (str, int, float)):
        raise QuantityError(f"this is not {name}", hint=expected)
    if not isinstance(text, str):
        if not math.isfinite(text):
            raise QuantityError(f"{text} is not a finite number", hint=expected)
        raise QuantityError(f"{text:.12g} has no unit", hint=expected)
    shown = _shown(text)
    if len(text) > MAX_TEXT:
        raise QuantityError(
            f"{shown} is too long for a quantity ({len(text)} characters)", hint=expected
        )
    text = text.strip()
    number = _NUMBER.match(text)
    if number is None or not re.match(r"\s|[A-Za-zµμ%°]|$", text[number.end() :]):
        if re.match(r"[-+]?[0-9]+,[0-9]", text):
            expected += " (with a decimal point)"
        raise QuantityError(f"{shown} is not a number with a unit", hint=expected)
    unit_text = text[number.end() :].strip()
    if not unit_text:
        raise QuantityError(f"{shown} has no unit", hint=expected)
    wanted = _parse_unit(unit)
    try:
        given = _parse_unit(unit_text, wanted)
    except QuantityError as error:
        hint = f"{expected}; {error.hint}"
        raise QuantityError(f"{shown}: {error.message}", hint=hint) from None
    if given.dimension != wanted.dimension or (unit == "K" and unit_text in _CELSIUS):
        other, _ = _named(unit_text)
        raise QuantityError(f"{shown} is {other}, not {name}", hint=expected)
    value = _scaled(number[0], given.scale / (wanted.scale if unit != "%" else Decimal(1)))
    if unit in _CELSIUS and unit_text not in _CELSIUS:
        value -= float(_ZERO_CELSIUS_K)
    if not math.isfinite(value):
        raise QuantityError(f"{shown} is not a finite number", hint=expected)
    return value


def split_uncertainty(text: str) -> tuple[str, str | None]:
    """The parts of `text` before and after the first "±" ("+-" and "+/-" are the same).

    The second part is None where no uncertainty is written.
    """
    before, *after = _PLUS_MINUS.split(text, maxsplit=1)
    return before.strip(), after[0].strip() if after else None


def _scaled(number: str, scale: Decimal) -> float:
    """The product, rounded once; inf beyond the range of a float."""
    if abs(float(number)) in (0.0, math.inf):
        return float(number)
    return float(Decimal(number) * scale)


def _shown(text: str) -> str:
    return repr(text if len(text) <= 40 else text[:37] + "...")


def percent(share: float, digits: int = 3) -> str:
    """A share in per cent with so many significant digits, without noise: "20 %", "4.69 %"."""
    shown = float(f"{100.0 * share:.{digits}g}")
    return f"{shown:f} %" if not math.isfinite(shown) else f"{Decimal(repr(shown)).normalize():f} %"


def change(relative: float) -> str:
    """A change against the first of two, "+5.1 %"; beyond half and twice a ratio, "× 3.2"."""
    if not -0.5 <= relative <= 1.0:
        return f"× {1.0 + relative:.3g}"
    return f"{100.0 * relative:+.3g} %"


def changes(ends: Sequence[float]) -> str:
    """The two ends of an interval of a change."""
    return f"[{', '.join(map(change, ends))}]"


def beside_limit(value: float, limit: float, unit: str = "%") -> tuple[str, str]:
    """A value and its limit with enough digits that they compare as the numbers do.

    Args:
        value: a share, or a number in `unit`; of a negative one the size counts.
        limit: the same.
        unit: "%" for shares; "" for plain numbers; otherwise as `format_quantity` writes it.
    """
    scale = 100.0 if unit == "%" else 1.0
    for digits in range(3, 18):
        shown, most = (float(f"{abs(scale * x):.{digits - 1}e}") for x in (value, limit))
        if (shown <= most) == (abs(value) <= abs(limit)):
            break
    texts = [
        percent(x, digits) if unit == "%" else format_quantity(x, unit, digits).rstrip()
        for x in (value, limit)
    ]
    return texts[0], texts[1]


def format_quantity(value: float, unit: str, digits: int = 3) -> str:
    """`value` in the SI unit `unit` as people write it: "3.49 MN/m", "28.7 mm", "727 N".

    Rounds to `digits` significant digits and chooses the engineering prefix of the first symbol of
    `unit`. `parse_quantity` reads the result back.
    """
    if unit == "%":
        return f"{_plain(value * 100.0, digits)} %"
    if unit in _CELSIUS:
        return f"{_plain(value, digits)} °C"
    rounded = float(f"{value:.{digits - 1}e}")
    match = re.match(r"[A-Za-zµ]+", unit)
    if rounded == 0.0 or not math.isfinite(rounded) or match is None:
        return f"{_plain(rounded, digits)} {unit}"
    symbol, rest = match[0], unit[match.end() :]
    steps = _steps(symbol)
    exponent = 3 * math.floor(math.log10(abs(rounded)) / 3.0 + 1e-12)
    exponent = min(max(exponent, min(steps)), max(steps))
    if rest.startswith(("^", "²", "³")):
        exponent = 0
    shown = float(Decimal(repr(rounded)).scaleb(-exponent))
    return f"{_plain(shown, digits)} {steps[exponent]}{rest}"


def rounded_down(value: float) -> float:
    """`value` above 0 rounded down to three significant digits; 0 stays."""
    if value <= 0.0:
        return value
    digit = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.floor(value / digit * (1.0 + 1e-12)) * digit:.2e}")


def _steps(symbol: str) -> dict[int, str]:
    """Powers of ten that `symbol` may stand for, with the spelling of each."""
    if symbol == "kg":
        return {-3: "g", 0: "kg"}
    prefixes = _SYMBOLS[symbol][2].replace("c", "") if symbol in _SYMBOLS else ""
    return {_PREFIXES[prefix]: prefix + symbol for prefix in ("", *prefixes)}


def _plain(value: float, digits: int) -> str:
    """`value` to `digits` significant digits, without an exponent where it stays short."""
    if math.isfinite(value) and 10.0**digits <= abs(value) < 1e7:
        return f"{float(f'{value:.{digits - 1}e}'):.0f}"
    return f"{value:.{digits}g}"
