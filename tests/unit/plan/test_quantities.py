"""Both ends of every range of a plan, and what the other types take."""

from __future__ import annotations

import re
from datetime import date
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, get_args

import pytest
from plan_hints import quantity_in

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
from stepload.declaration.sections import Kind, fields_of, keys, schema_of
from stepload.declaration.uncertain import Uncertain, stated
from stepload.errors import BadInputError
from stepload.plan.calibration import CalibrationRecord
from stepload.plan.model import Plan
from stepload.plan.reader import SHAPE, checked

RANGES = {
    "above 0 to 10 m": """
        payload.geometry.sphere.radius payload.geometry.sphere.counter_radius
        payload.geometry.cone_tip.radius payload.geometry.pyramid_tip.radius
        payload.geometry.flat_punch.radius payload.geometry.power.gap
        payload.geometry.power.at_radius rig.arm.position_resolution
        rig.arm.model_tolerance rig.displacement.resolution procedure.surface_distance
        procedure.surface_uncertainty procedure.search_distance procedure.retract
        rig.simulation.stop_depth rig.force.lever rig.second_force.sensor.lever
        procedure.max_eccentricity procedure.alignment.touch_error
        rig.system_stiffness.deflection calibration.deflection
    """,
    "0.1 to 89 deg": "payload.geometry.sharp_cone.slope",
    "0.1 to 50": "payload.geometry.power.exponent",
    "1000 to 2e12 Pa": """
        payload.material.youngs_modulus payload.material.yield_strength
        payload.plate.youngs_modulus payload.plate.yield_strength payload.micro_hardness
        rig.simulation.micro_hardness
    """,
    "above -1 to 0.5": "payload.material.poisson_ratio payload.plate.poisson_ratio",
    "above 0 to 1e6 N": """
        payload.force_limit rig.arm.max_push rig.force.range rig.force.resolution
        rig.force.noise rig.second_force.sensor.range rig.second_force.sensor.resolution
        rig.force.rated_force rig.second_force.sensor.rated_force
        rig.second_force.sensor.noise rig.mechanical_fuse rig.simulation.kinematic_length
        procedure.top_force procedure.step procedure.levels procedure.touch_force
        procedure.max_drift identify.secant_force calibration.force_from calibration.force_to
        rig.simulation.yield_force rig.simulation.seating_force rig.simulation.softness_force
        rig.system_stiffness.smooth_length rig.system_stiffness.deflection_force
        calibration.smooth_length calibration.deflection_force
    """,
    "0 to 10 m": """
        payload.roughness
        payload.height rig.arm.lost_motion rig.arm.position_noise rig.displacement.noise
        rig.displacement.offset
        rig.system_stiffness.msde rig.system_stiffness.smooth_error rig.load_path
        rig.simulation.kinematic_error calibration.msde calibration.smooth_error
        rig.simulation.roughness rig.simulation.seating rig.simulation.slip
        rig.simulation.pad_depth rig.simulation.mount.sensor_lever
        rig.system_stiffness.deflection_sigma calibration.deflection_sigma
    """,
    "0 to 0.001 1/K": "payload.thermal_expansion rig.thermal_expansion",
    "0 to 0.1 1/K": "payload.modulus_change",
    "1 to 100000 Hz": """
        rig.arm.rate rig.force.rate rig.displacement.rate rig.second_force.sensor.rate
    """,
    "above 0 to 2 m/s": "rig.arm.max_speed",
    "above 0 to 100 m/s^2": "rig.arm.max_acceleration",
    "above 0 to 10000 kg": "rig.arm.effective_mass",
    "above 0 to 1e6 N m": "rig.force.rated_torque rig.second_force.sensor.rated_torque",
    "0 to 10 s": """
        rig.arm.command_delay rig.arm.lag rig.force.delay rig.second_force.sensor.delay
    """,
    "1e-5 to 10 s": "rig.loop_delay",
    "0.002 to 2 s": "rig.arm.max_age rig.force.max_age rig.second_force.sensor.max_age",
    "0 to 100 %": """
        rig.force.gain_uncertainty rig.second_force.tolerance_relative
        rig.second_force.sensor.gain_uncertainty rig.simulation.creep
        rig.second_force.sensor.nonlinearity rig.system_stiffness.deflection_common
        rig.force.nonlinearity rig.system_stiffness.share_reach
    """,
    "0 to 100 N/s": "rig.force.drift rig.second_force.sensor.drift",
    "0 to 1e6 N": """
        rig.second_force.tolerance rig.second_force.noise rig.second_force.zero_error
        rig.simulation.adhesion
    """,
    "above 0 to 86400 s": """
        rig.second_force.time procedure.hold procedure.tare procedure.settle_timeout
        rig.simulation.creep_time
    """,
    "1 to 1e12 N/m": """
        rig.arm.lateral_stiffness
        rig.system_stiffness.value calibration.stiffness rig.simulation.pad_stiffness
        rig.simulation.stop_stiffness
    """,
    "above 0 to 1e12 N/m": "rig.system_stiffness.sigma calibration.sigma",
    "0 to 1e9 N s/m": "rig.system_stiffness.damping calibration.damping",
    "0 to 1": "calibration.deflection_common calibration.share_reach",
    "-2 to 2": "calibration.at_share",
    "-100 to 100 rad": "calibration.joints calibration.tcp_rotation",
    "-10 to 10 m": """
        calibration.tcp_position
        rig.simulation.mount.eccentricity_x rig.simulation.mount.eccentricity_y
        rig.simulation.mount.gauge_offset_x rig.simulation.mount.gauge_offset_y
    """,
    "1 to 1e6": "rig.system_stiffness.smooth_degrees calibration.smooth_degrees",
    "-50 to 150 degC": """
        rig.system_stiffness.temperature identify.temperature calibration.temperature
    """,
    "0 to 2147483647 count": "rig.simulation.seed",
    "0.01 to 100": "rig.simulation.payload_factor rig.simulation.stiffness_factor",
    "-0.1 to 0.1 m": "rig.simulation.surface_error",
    "0 to 50 %": "rig.common_force_error",
    "0 to 90 %": "rig.simulation.hysteresis",
    "-10 to 10 N/s": "rig.simulation.force_drift",
    "0 to 6 count": "rig.simulation.creep_decades",
    "-0.0001 to 0.0001 m/s": "rig.simulation.drift",
    "0 to 1000 %": "rig.simulation.softness",
    "-200 to 200 %": """
        rig.simulation.lateral rig.simulation.lateral_coupling rig.system_stiffness.at_share
        rig.simulation.mount.coupling_x rig.simulation.mount.coupling_y
    """,
    "-0.01 to 0.01 m/N": "rig.system_stiffness.across calibration.across",
    "above 0 to 0.01 m/N": "rig.system_stiffness.across_sigma calibration.across_sigma",
    "-1 to 1": "rig.system_stiffness.across_correlation calibration.across_correlation",
    "0.001 to 1000": "rig.simulation.mount.lateral_compliance",
    "0 to 0.175 rad": """
        rig.force.misalignment rig.second_force.sensor.misalignment rig.plate_tilt
    """,
    "-0.01 to 0.01 rad/N": "rig.simulation.mount.turn",
    "0 to 2": """
        payload.friction rig.simulation.mount.friction rig.simulation.mount.friction_kinetic
    """,
    "above 0 to 2": "rig.simulation.mount.tangential_ratio",
    "-30 to 30 deg": """
        rig.simulation.mount.tilt_x rig.simulation.mount.tilt_y
        rig.simulation.mount.sensor_turn_x rig.simulation.mount.sensor_turn_y
    """,
    "-180 to 180 deg": "rig.simulation.mount.sensor_turn_z procedure.nulling.sensor_turn",
    "1e-3 to 0.01 m": "procedure.alignment.radius",
    "0.05 to 3 deg": "procedure.alignment.max_tilt",
    "0.05 to 5 s": "procedure.nulling.time_constant",
    "above 0 to 3e-4 m": "procedure.nulling.largest_shift",
    "-50 to 50 %": "rig.simulation.mount.cross_talk",
    "0 to 10000 N m": """
        rig.simulation.mount.torque_noise rig.simulation.mount.torque_resolution
        rig.simulation.mount.torque_range
    """,
    "-100 to 100 %": "rig.simulation.cross_talk",
    "-10 to 10 %": "rig.simulation.sensor_quadratic rig.simulation.sensor_cubic",
    "above 0 to 1e6 N/s": "procedure.load_rate",
    "1 to 1000 count": "procedure.cycles",
    "1 to 50 %": "procedure.unload_fraction procedure.max_lateral_share",
    "0.1 to 50 %": "procedure.until",
    "1 to 100 count": "procedure.touches",
    "0 to 86400 s": "procedure.warm_up",
    "1 to 100": "identify.p rig.system_stiffness.stuck_ratio",
    "1 to 1000": "identify.s identify.t",
    "1 to 5": "payload.limit_coverage",
    "0 to 20 K": "identify.temperature_uncertainty",
}
"""Range, as written in a plan: the keys that have it. "count" is a plain whole number."""


def ranged(kind: Kind, path: str) -> dict[str, Any]:
    """The hint of one value at every key below a section that has a range."""
    found: dict[str, Any] = {}
    for key in keys(kind):
        name = path + key.name
        if re.search(r" (from|above) ", key.expected):
            found[name] = get_args(key.info.annotation)[0] if key.each else key.hint
        for inner in key.sections:
            shape = get_args(fields_of(inner)[SHAPE].annotation)[0] + "." if key.shaped else ""
            found |= ranged(inner, f"{name}.{shape}")
    return found


HINTS = ranged(Plan, "") | ranged(CalibrationRecord, "calibration.")
EXPECTED = {key: text for text, keys in RANGES.items() for key in keys.split()}


def read(hint: Any, value: Any) -> Any:
    return checked(hint, value)


def takes(hint: Any, value: object) -> bool:
    try:
        read(hint, value)
    except BadInputError:
        return False
    return True


def test_the_table_has_every_key_with_a_range() -> None:
    assert set(EXPECTED) == set(HINTS)


@pytest.mark.parametrize("key", EXPECTED)
def test_both_ends_of_every_range(key: str) -> None:
    words = EXPECTED[key].split()
    above = words[0] == "above"
    low, _, high, *rest = words[above:]
    unit = " ".join(rest)
    count = unit == "count"
    tiny = Decimal(1) if count else (Decimal(high) - Decimal(low)) * Decimal("1e-9")

    def good(value: Decimal) -> bool:
        written = int(value) if count else f"{value} {unit}" if unit else float(value)
        return takes(HINTS[key], written)

    assert [good(Decimal(high)), good(Decimal(high) + tiny)] == [True, False]
    assert [good(Decimal(low)), good(Decimal(low) - tiny)] == [not above, False]
    assert good(Decimal(low) + tiny)


LENGTH = Annotated[float, Quantity("m", 0.0, 1.0)]
HALF = Annotated[float, HalfWidth("%", 0.0, 0.5)]
PLAIN = Annotated[float, number(0.0, 9.0)]
COUNT = Annotated[int, number(0, 9)]
WORD = Annotated[str, Choice(("a", "b"))]


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


def test_in_code_si_floats_are_taken_as_they_stand() -> None:
    from stepload.declaration.sections import adapter

    assert adapter(LENGTH).validate_python(0.5) == 0.5


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
        (Annotated[float, HalfWidth("%", 0.0, 0.5, above=True)], "±0 %", "0 % is out of range",
         "above 0 % up to 50 %"),
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


def test_every_number_of_a_payload_that_may_be_uncertain() -> None:
    uncertain = {key for key, hint in HINTS.items() if isinstance(quantity_in(hint), Uncertain)}
    bodies = [f"payload.{body}." for body in ("material", "plate")]
    numbers = ("youngs_modulus", "poisson_ratio", "yield_strength")
    radii = ("sphere.radius", "sphere.counter_radius", "cone_tip.radius", "pyramid_tip.radius",
             "flat_punch.radius")  # fmt: skip
    assert uncertain == {
        *(body + number for body in bodies for number in numbers),
        *(f"payload.geometry.{radius}" for radius in radii),
        "payload.roughness", "payload.micro_hardness", "payload.force_limit",
    }  # fmt: skip


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
    assert stated(read(leaf, text.replace("±", sign)))[:2] == pytest.approx((value, sigma))


def test_a_value_without_its_uncertainty_is_read_as_ever() -> None:
    assert stated(read(YIELD, "70 MPa")) == (70e6, None, None)
    assert stated(read(RATIO, 0.3)) == (0.3, None, None)
    assert stated(read(RATIO, 0)) == (0.0, None, None)


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


def test_the_schema_takes_what_is_read() -> None:
    number, text = schema_of(RATIO)["anyOf"]
    assert number == {"type": "number", "exclusiveMinimum": -1.0, "maximum": 0.5}
    for written in ("0.30 ± 0.03", "0.3+-10 %", " -.4 +/- 0.1"):
        assert re.search(text["pattern"], written)
        read(RATIO, written)
    assert not re.search(text["pattern"], "0.3")
    whole = schema_of(YIELD)
    assert re.search(whole["pattern"], "70 MPa ± 5 %")
    assert any("±" in example for example in whole["examples"])
