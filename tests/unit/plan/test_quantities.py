"""Both ends of every range of a plan, and what the other types take."""

from __future__ import annotations

from datetime import date
from pathlib import Path
from typing import Annotated, Any

import pytest

from stepload.declaration.quantities import (
    Calendar,
    Choice,
    FilePath,
    Flag,
    HalfWidth,
    Name,
    Note,
    Quantity,
    Remark,
    Version,
    number,
)
from stepload.declaration.uncertain import Uncertain, sigma_of
from stepload.errors import BadInputError
from stepload.plan.reader import checked


def read(hint: Any, value: Any) -> Any:
    return checked(hint, value)


def takes(hint: Any, value: object) -> bool:
    try:
        read(hint, value)
    except BadInputError:
        return False
    return True


LENGTH = Annotated[float, Quantity("m", 0.0, 1.0)]
HALF = Annotated[float, HalfWidth("%", 0.0, 0.5)]
PLAIN = Annotated[float, number(0.0, 9.0)]
COUNT = Annotated[int, number(0, 9)]
WORD = Annotated[str, Choice(("a", "b"))]
ABOVE = Annotated[float, HalfWidth("%", 0.0, 0.5, above=True)]


@pytest.mark.parametrize(
    ("hint", "values", "taken"),
    [
        (LENGTH, ("0 m", "1 m"), True),
        (LENGTH, ("-1 nm", "1000.001 mm"), False),
        (ABOVE, ("0.001 %", "50 %"), True),
        (ABOVE, ("0 %", "50.001 %"), False),
        (PLAIN, (0, 9.0), True),
        (PLAIN, (-1e-9, 9.000001), False),
        (COUNT, (0, 9), True),
        (COUNT, (-1, 10), False),
    ],
)
def test_both_ends_of_a_range(hint: Any, values: tuple[object, object], taken: bool) -> None:
    assert [takes(hint, value) for value in values] == [taken, taken]


@pytest.mark.parametrize(
    ("hint", "good", "found"),
    [
        (LENGTH, "28.7 mm", 0.0287),
        (HALF, "±5 %", 0.05),
        (HALF, " +/- 5 %", 0.05),
        (HALF, "+-5 %", 0.05),
        (HALF, "5 %", 0.05),
        (PLAIN, 3, 3.0),
        (COUNT, 3, 3),
        (Name, " a b ", "a b"),
        (Remark, "", ""),
        (Note, "a\nb\n", "a\nb"),
        (FilePath, "a/b.yaml", Path("a/b.yaml")),
        (FilePath, " a", Path(" a")),
        (WORD, "b", "b"),
        (Flag, False, False),
        (Calendar, "2025-03-31", date(2025, 3, 31)),
        (Version, 1, 1),
    ],
)
def test_what_is_good_is_read(hint: Any, good: object, found: object) -> None:
    value = read(hint, good)
    assert value == found
    assert type(value) is type(found)


@pytest.mark.parametrize(
    ("hint", "bad", "message", "told"),
    [
        (LENGTH, None, "nothing is not a length", '"28.7 mm"'),
        (LENGTH, True, "true is not a length", '"28.7 mm"'),
        (LENGTH, {}, "a mapping is not a length", '"28.7 mm"'),
        (LENGTH, 3, "3 has no unit", '"28.7 mm"'),
        (LENGTH, "2 m", "2 m is out of range", "a length from 0 m to 1 m"),
        (HALF, "±5", "'5' has no unit", '"2 %"'),
        (HALF, 0.05, "0.05 has no unit", '"2 %"'),
        (HALF, "±-5 %", "'±-5 %' is not a number with a unit", '"2 %"'),
        (HALF, "± nan %", "'± nan %' is not a number", '"2 %"'),
        (ABOVE, "±0 %", "0 % is out of range", "above 0 % up to 50 %"),
        (PLAIN, "3", "'3' is not a plain number", "from 0 to 9"),
        (PLAIN, True, "true is not a plain number", "from 0 to 9"),
        (PLAIN, 10, "10 is out of range", "from 0 to 9"),
        (Annotated[float, number(0.0, 9.0, above=True)], float("nan"), "nan is not a plain",
         "above 0 up to 9"),
        (COUNT, 3.0, "3.0 is not a whole number", "from 0 to 9"),
        (COUNT, False, "false is not a whole number", "from 0 to 9"),
        (Name, 7, "7 is not a text", "one line of at most 100"),
        (Name, [], "a list is not a text", "one line of at most 100"),
        (Name, "  ", "an empty text", "one line of at most 100"),
        (Name, "x" * 101, "a text of 101 characters", "at most 100 characters"),
        (Name, "a\nb", "the control character U+000A", "one line"),
        (Note, "a\x1bb", "the control character U+001B", "a text"),
        (FilePath, "", "an empty text", "a path of at most 400"),
        (FilePath, "x" * 401, "401 characters", "a path of at most 400"),
        (FilePath, "a\0", "the control character U+0000", ""),
        (WORD, "c", "'c' is not a choice here", "one of a, b"),
        (Flag, "yes", "'yes' is neither true nor false", "write true or false"),
        (Flag, 1, "1 is neither true nor false", "write true or false"),
        (Calendar, "2025-02-30", "'2025-02-30' is not a date", "year-month-day"),
        (Calendar, "20250228", "'20250228' is not a date", "year-month-day"),
        (Calendar, "2025-W01-1", "'2025-W01-1' is not a date", "year-month-day"),
        (LENGTH, "5 % %", "two signs of percent", "write one"),
        (Calendar, 2025, "2025 is not a date", "year-month-day"),
        (Version, 2, "2 is not accepted here", "expected 1"),
        (Version, 1.0, "'1.0' is not accepted here", "expected 1"),
        (Version, True, "is not accepted here", "expected 1"),
        (Version, None, "nothing is not accepted here", "expected 1"),
        (Version, "1", "'1' is not accepted here", "expected 1"),
    ],
)  # fmt: skip
def test_what_is_bad_is_said_with_what_was_expected(
    hint: Any, bad: Any, message: str, told: str
) -> None:
    with pytest.raises(BadInputError) as caught:
        read(hint, bad)
    assert message in caught.value.message
    assert told in caught.value.hint


@pytest.mark.parametrize(
    ("unit", "suffix"),
    [
        ("m", "_m"), ("N/m", "_n_per_m"), ("N s/m", "_n_s_per_m"), ("m/s^2", "_m_s2"),
        ("m/s", "_m_s"), ("N/s", "_n_per_s"), ("degC", "_c"), ("K", "_k"), ("1/K", "_per_k"),
        ("Pa", "_pa"), ("rad", "_rad"), ("%", ""),
    ],
)  # fmt: skip
def test_the_suffix_of_a_unit(unit: str, suffix: str) -> None:
    assert Quantity(unit, 0.0, 1.0).suffix == suffix


YIELD = Annotated[float, Uncertain("Pa", 1e3, 2e12)]
RATIO = Annotated[float, Uncertain("", -1.0, 0.5, above=True)]


@pytest.mark.parametrize("sign", ["±", "+-", "+/-"])
@pytest.mark.parametrize(
    ("leaf", "text", "value", "sigma"),
    [
        (YIELD, "70 MPa ± 5 %", 70e6, 3.5e6),
        (YIELD, "70 MPa±3.5 MPa", 70e6, 3.5e6),
        (YIELD, "  2.75e9 Pa  ±  0.1 GPa ", 2.75e9, 1e8),
        (YIELD, "70 MPa ± 50 %", 70e6, 35e6),
        (RATIO, "0.30 ± 0.03", 0.3, 0.03),
        (RATIO, "0.30 ± 10 %", 0.3, 0.03),
        (RATIO, "0 ± .02", 0.0, 0.02),
        (RATIO, "-4e-1 ± 0.1", -0.4, 0.1),
    ],
)
def test_a_value_with_its_uncertainty(
    leaf: Any, text: str, value: float, sigma: float, sign: str
) -> None:
    found = read(leaf, text.replace("±", sign))
    assert (found, sigma_of(found)) == pytest.approx((value, sigma))


@pytest.mark.parametrize(
    ("leaf", "bad", "message", "hint"),
    [
        (YIELD, "70 MPa ± 0 %", "'0 %' is out of range", "nothing that is measured is exact"),
        (YIELD, "70 MPa ± 0 MPa", "out of range", "up to 35 MPa"),
        (YIELD, "70 MPa ± -5 %", "out of range", "up to 35 MPa"),
        (YIELD, "70 MPa ± 51 %", "out of range", "up to 35 MPa"),
        (YIELD, "70 MPa ± 3.5 GPa", "out of range", "up to 35 MPa"),
        (YIELD, "70 MPa ± 3.5 mm", "is a length, not a pressure", "standard uncertainty"),
        (YIELD, "70 MPa ± 3.5", "'3.5' has no unit", "± 5 %"),
        (YIELD, "70 MPa ±", "the uncertainty", "± 5 %"),
        (YIELD, "70 ± 3.5 MPa", "'70' has no unit", "expected a pressure"),
        (YIELD, "70 MPa ± 5 % ± 5 %", "the uncertainty", "± 5 %"),
        (YIELD, "1 Pa ± 5 %", "1 Pa is out of range", "1 kPa"),
        (YIELD, 70, "70 has no unit", "expected a pressure"),
        (RATIO, "0.3", "'0.3' is not a plain number", "above -1"),
        (RATIO, "x ± 0.1", "'x' is not a plain number", "above -1 up to 0.5"),
        (RATIO, "0.6 ± 0.1", "0.6 is out of range", "above -1 up to 0.5"),
        (RATIO, "0.3 ± 0", "'0' is out of range", "up to 0.375"),
        (RATIO, "0.3 ± 0.4", "'0.4' is out of range", "up to 0.375"),
        (RATIO, "0.3 ± nan", "the uncertainty", "0.30 ± 0.03"),
        (RATIO, "0.3 ± 1 MPa", "is a pressure", "0.30 ± 0.03"),
        (RATIO, "0.3 ± ", "the uncertainty", "0.30 ± 0.03"),
        (RATIO, "1_0 ± 0.1", "'1_0' is not a plain number", ""),
        (RATIO, True, "true is not a plain number", ""),
    ],
)
def test_an_uncertainty_that_is_none(leaf: Any, bad: Any, message: str, hint: str) -> None:
    with pytest.raises(BadInputError) as caught:
        read(leaf, bad)
    assert message in caught.value.message
    assert hint in caught.value.hint
