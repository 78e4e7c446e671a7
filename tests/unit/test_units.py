"""Quantities as text."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stepload.units import (
    MAX_TEXT,
    QuantityError,
    beside_limit,
    format_quantity,
    parse_quantity,
)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("28.7 mm", "m", 0.0287),
        ("28.7mm", "m", 0.0287),
        ("2.75 GPa", "Pa", 2.75e9),
        ("50 N", "N", 50.0),
        ("+.5e1 N", "N", 5.0),
        ("3.49e6 N/m", "N/m", 3.49e6),
        ("3.49 MN/m", "N/m", 3.49e6),
        ("1 kN/mm", "N/m", 1e6),
        ("3.87e4 N s/m", "N s/m", 3.87e4),
        ("3.87e4 N·s/m", "N s/m", 3.87e4),
        ("1 kHz", "Hz", 1000.0),
        ("3 s", "s", 3.0),
        ("5 min", "s", 300.0),
        ("5 mm/s", "m/s", 0.005),
        ("0.5 m/s^2", "m/s^2", 0.5),
        ("0.5 m/s²", "m/s^2", 0.5),
        ("2 %", "%", 0.02),
        ("23 degC", "degC", 23.0),
        ("-3 °C", "degC", -3.0),
        ("273.15 K", "degC", 0.0),
        ("15 deg", "rad", math.radians(15.0)),
        ("1.5 N/s", "N/s", 1.5),
        ("400 g", "kg", 0.4),
        ("7.5 µm", "m", 7.5e-6),
        ("7.5 μm", "m", 7.5e-6),
        ("7.5 um", "m", 7.5e-6),
        ("-2 mm", "m", -0.002),
        ("0.5 K", "K", 0.5),
        ("300 mK", "K", 0.3),
        ("11.7e-6 1/K", "1/K", 11.7e-6),
        ("0.4 %/K", "1/K", 0.004),
        ("11.7 µm/m/K", "1/K", 11.7e-6),
        ("500 1/s", "Hz", 500.0),
    ],
)
def test_a_quantity_is_read_into_si(text: str, unit: str, value: float) -> None:
    assert parse_quantity(text, unit) == value


@pytest.mark.parametrize(
    ("text", "unit", "message", "hint"),
    [
        ("28.7", "m", "'28.7' has no unit", '"28.7 mm"'),
        (28.7, "m", "28.7 has no unit", '"28.7 mm"'),
        (300, "N", "300 has no unit", "a force"),
        (True, "N", "not a force", "a force"),
        (None, "N", "not a force", "a force"),
        ([], "N", "not a force", "a force"),
        ("50 N", "m", "is a force, not a length", "a length"),
        ("50 N/m", "N s/m", "is a stiffness, not a damping", "N s/m"),
        ("28.7 Mm", "m", "unknown unit 'Mm'", "'mm'"),
        ("3 newton", "N", "unknown unit 'newton'", "a force"),
        ("5 microns", "m", "unknown unit 'microns'", "units are written like"),
        ("5 kgf", "N", "unknown unit 'kgf'", "units are written like"),
        ("nan N", "N", "not a number", "a force"),
        ("inf N", "N", "not a number", "a force"),
        (math.nan, "N", "not a finite number", "a force"),
        (math.inf, "N", "not a finite number", "a force"),
        ("1e999 N", "N", "not a finite number", "a force"),
        ("1e308 GPa", "Pa", "not a finite number", "a pressure"),
        ("28,7 mm", "m", "not a number", "decimal point"),
        ("1 N/m s", "N s/m", "two ways", "before the"),
        ("0x10 N", "N", "unknown unit", "a force"),
        ("1_000 N", "N", "not a number", "a force"),
        ("٣ N", "N", "not a number", "a force"),
        ("", "N", "not a number", "a force"),
        ("N", "N", "not a number", "a force"),
        ("5 /s", "Hz", "unknown unit ''", "a rate"),
        ("5 1", "%", "unknown unit '1'", "a share"),
        ("20 degC", "K", "is a temperature, not a temperature difference", '"0.5 K"'),
        ("20 °C", "K", "is a temperature, not a temperature difference", '"0.5 K"'),
        ("300 K", "m", "is a temperature, not a length", "a length"),
        ("0.5 K", "1/K", "not a change per kelvin", "11.7e-6 1/K"),
        ("5 1/m s", "Hz", "two ways", "a rate"),
        ("9" * (MAX_TEXT + 1) + " N", "N", "too long", "a force"),
    ],
)
def test_what_is_no_quantity_is_refused_with_an_example(
    text: object, unit: str, message: str, hint: str
) -> None:
    with pytest.raises(QuantityError) as caught:
        parse_quantity(text, unit)
    assert message in caught.value.message
    assert hint in caught.value.hint
    assert "for example" in caught.value.hint


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (3.49e6, "N/m", "3.49 MN/m"),
        (0.0287, "m", "28.7 mm"),
        (727.0, "N", "727 N"),
        (999.6, "N", "1 kN"),
        (0.0, "N", "0 N"),
        (-3.0, "N", "-3 N"),
        (2e-6, "m", "2 µm"),
        (6.57e8, "N/m^1.5", "657 MN/m^1.5"),
        (3600.0, "s", "3600 s"),
        (0.02, "%", "2 %"),
        (23.0, "degC", "23 °C"),
        (0.4, "kg", "400 g"),
        (5e-7, "m/N", "500 nm/N"),
        (4.0, "m^2", "4 m^2"),
        (math.nan, "N", "nan N"),
        (math.inf, "N", "inf N"),
    ],
)
def test_a_quantity_is_shown_as_people_write_it(value: float, unit: str, text: str) -> None:
    assert format_quantity(value, unit) == text


_UNITS = ["m", "N", "Pa", "N/m", "N s/m", "Hz", "s", "m/s", "m/s^2"]
_UNITS += ["kg", "N/s", "rad", "%", "degC", "K", "1/K"]


@given(st.floats(1e-12, 1e15), st.sampled_from(_UNITS), st.integers(2, 12), st.booleans())
def test_what_is_shown_can_be_read_back(
    size: float, unit: str, digits: int, negative: bool
) -> None:
    value = -size if negative else size
    shown = format_quantity(value, unit, digits)
    assert parse_quantity(shown, unit) == pytest.approx(value, rel=0.51 * 10.0 ** (1 - digits))


@given(
    st.text(max_size=80) | st.from_regex(r"[-+]?[0-9.eE]{1,12} ?[µumkMGNPasHzg/ ^²%]{0,8}"),
    st.sampled_from(_UNITS),
)
def test_any_text_is_a_finite_number_or_a_quantity_error(text: str, unit: str) -> None:
    try:
        value = parse_quantity(text, unit)
    except QuantityError as error:
        hint = error.hint
    else:
        hint = "expected" if math.isfinite(value) else f"got {value}"
    assert "expected" in hint


@pytest.mark.parametrize(("share", "limit", "told"), [
    (0.176, 0.2, ("17.6 %", "20 %")),
    (0.048, 1.0 / 21.3, ("4.8 %", "4.69 %")),
    (0.04696, 0.0469, ("4.7 %", "4.69 %")),
    (0.046949, 1.0 / 21.3, ("4.6949 %", "4.6948 %")),
    (0.046943, 1.0 / 21.3, ("4.69 %", "4.69 %")),
    (0.20001, 0.2, ("20.001 %", "20 %")),
    (0.2, 0.2, ("20 %", "20 %")),
    (math.inf, 0.2, ("inf %", "20 %")),
    (math.nan, 0.2, ("nan %", "20 %")),
])  # fmt: skip
def test_what_is_beyond_a_limit_is_told_as_beyond_it(
    share: float, limit: float, told: tuple[str, str]
) -> None:
    assert beside_limit(share, limit) == told
