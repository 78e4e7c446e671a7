"""Any good values are read exactly; any bad ones are all reported, each in its line."""

from __future__ import annotations

from pathlib import Path
from typing import get_origin

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from plan_hints import quantity_in

from stepload.declaration.sections import Key, Kind, keys, schema_of, sections_below
from stepload.plan.load import load_plan
from stepload.plan.model import Payload, Plan
from stepload.plan.problems import PlanError
from stepload.plan.reader import validated
from stepload.plan.source import Source
from stepload.plan.tree import Sequence, parse_tree

FULL = """\
stepload: 1
name: all
payload:
  name: ball
  geometry:
    shape: sphere
    radius: 28.7 mm
    counter_radius: 1 m
  material:
    name: acetal
    youngs_modulus: 2.75 GPa
    poisson_ratio: 0.3
    yield_strength: 70 MPa
  plate:
    name: aluminium
    youngs_modulus: 70 GPa
    poisson_ratio: 0.33
  roughness: 3 µm
  micro_hardness: 700 MPa
  force_limit: 700 N
  height: 57.4 mm
  thermal_expansion: 110e-6 1/K
  modulus_change: 0.4 %/K
  limit_coverage: 3
  friction: 0.2
rig:
  profile: stvf
  name: STVF
  arm:
    driver: sim
    options: {seed: 3}
    rate: 1 kHz
    max_speed: 50 mm/s
    max_acceleration: 2 m/s^2
    max_push: 2 kN
    effective_mass: 20 kg
    command_delay: 3 ms
    lag: 4 ms
    lost_motion: 1 µm
    position_resolution: 2 µm
    position_noise: 0.3 µm
    model_tolerance: 50 µm
    max_age: 12 ms
    pose: down
    lateral_stiffness: 20 MN/m
    structure: arm
    kinematics: ur5e
  force:
    driver: sim
    rate: 1 kHz
    axis: "+fz"
    range: 1 kN
    resolution: 1.5 N
    noise: 0.5 N
    delay: 1 ms
    gain_uncertainty: 1 %
    nonlinearity: 0.5 %
    drift: 0.01 N/s
    max_age: 20 ms
    components: six
    rated_force: [500 N, 500 N, 1 kN]
    rated_torque: [20 N m, 20 N m, 20 N m]
    lever: 80 mm
    misalignment: 1 deg
  displacement:
    driver: sim
    rate: 100 Hz
    resolution: 1 µm
    noise: 1 µm
    offset: 5 mm
  second_force:
    source: sensor
    tolerance: 10 N
    tolerance_relative: 2 %
    time: 20 ms
    noise: 1 N
    zero_error: 3 N
    sensor:
      axis: "+fz"
      driver: sim
      rate: 1 kHz
      range: 500 N
      resolution: 1 N
      noise: 0.5 N
      delay: 1 ms
  system_stiffness:
    value: 3.4 MN/m
    sigma: 34 kN/m
    damping: 1000 N s/m
    msde: 1 µm
    smooth_error: 1 µm
    smooth_degrees: 4
    smooth_length: 60 N
    deflection_force: [150 N, 300 N]
    deflection: [44.5 µm, 88.5 µm]
    deflection_sigma: [0.5 µm, 0.5 µm]
    deflection_common: 1 %
    across: [0.05 µm/N, -0.02 µm/N]
    across_sigma: [0.01 µm/N, 0.02 µm/N]
    across_correlation: 0.5
    at_share: [10 %, -5 %]
    share_reach: 15 %
    stuck_ratio: 2.4
    provenance: measured
    measured_on: 2025-01-01
    valid_until: 2999-01-01
    pose: down
    direction: "+fz"
    temperature: 21 degC
    policy: warn
  loop_delay: 20 ms
  hazards_read_by: Anna
  hazards_read_on: 2026-03-01
  wiring_checked_on: 2026-03-01
  mechanical_fuse: 800 N
  plate_tilt: 1 deg
  common_force_error: 3 %
  load_path: 0.6 m
  thermal_expansion: 11.7e-6 1/K
  simulation:
    world: sim
    world_options: {}
    seed: 4
    law: rough
    payload_factor: 1.1
    stiffness_factor: 0.9
    surface_error: -0.1 mm
    hysteresis: 2 %
    kinematic_error: 1 µm
    kinematic_length: 40 N
    force_drift: 0.001 N/s
    roughness: 5 µm
    micro_hardness: 300 MPa
    yield_force: 200 N
    creep: 10 %
    creep_time: 2 s
    creep_decades: 2
    seating: 2 µm
    seating_force: 150 N
    slip: 1 µm
    drift: 0.1 µm/s
    pad_stiffness: 20 MN/m
    pad_depth: 3 µm
    stop_depth: 70 µm
    stop_stiffness: 5 MN/m
    adhesion: 0.5 N
    adhesion_law: dmt
    softness: 30 %
    softness_force: 80 N
    lateral: 10 %
    lateral_coupling: 20 %
    cross_talk: 2 %
    sensor_quadratic: 0.5 %
    sensor_cubic: -0.2 %
    mount:
      coupling_x: 40 %
      lateral_compliance: 0.9
      turn: 20 µrad/N
      friction: 0.3
      friction_kinetic: 0.25
      tangential_ratio: 0.7
      tilt_x: 0.5 deg
      tilt_y: 1 deg
      sensor_turn_x: 0.4 deg
      sensor_turn_z: 90 deg
      sensor_lever: 150 mm
      eccentricity_x: 1 mm
      eccentricity_y: 0.5 mm
      cross_talk: 1 %
      torque_noise: 3 mN m
      gauge_offset_x: 20 mm
procedure:
  alignment:
    radius: 8 mm
    max_tilt: 1 deg
    touch_error: 10 µm
  step: 50 N
  top_force: 300 N
  load_rate: 40 N/s
  hold: 3 s
  unload: true
  cycles: 2
  lift_off: false
  unload_fraction: 6 %
  surface_distance: 5 mm
  surface_uncertainty: 1 mm
  search_distance: 4 mm
  touch_force: 5 N
  touches: 3
  retract: 1 mm
  tare: 10 s
  warm_up: 2 s
  max_drift: 4 N
  settle_timeout: 10 s
  max_lateral_share: 25 %
  max_eccentricity: 5 mm
identify:
  kind: payload
  secant_force: 200 N
  branch: loading
  p: 2
  s: 20
  t: 5
  accept_unidentifiable: yes it is
  temperature: 22 degC
  temperature_uncertainty: 0.5 K
  acceptance:
    chord_min: 4 MN/m
    chord_max: 8 MN/m
record:
  directory: runs
  notes: hello
  operator: me
  specimen: S7
  batch: B2
  tags: [polished]
"""
"""A plan that gives every key but `levels`, `record` and `until`: it has a gauge."""

SHAPES = next(key.sections for key in keys(Payload) if key.name == "geometry")
LINES = FULL.splitlines()
GIVEN = [
    number
    for number, line in enumerate(LINES, 1)
    if line[-1] != ":" and line.split()[0] not in ("profile:", "shape:", "tags:")
]
"""Lines that hold one value, but for those which say what the lines after them mean, and lists."""


def test_the_full_plan_is_good_and_has_every_key(tmp_path: Path) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(FULL, encoding="utf-8")
    assert load_plan(path).name == "all"
    given = {line.split(":")[0].strip() for line in LINES}
    for kind in sections_below(Plan):
        if kind in SHAPES[1:]:
            continue
        missing = {key.name for key in keys(kind)} - given
        assert missing <= {"levels", "record", "until"}, kind.__name__


@settings(
    max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(st.sets(st.sampled_from(GIVEN), min_size=1))
def test_every_bad_value_is_reported_in_its_line_and_nothing_else_is(
    tmp_path: Path, bad: set[int]
) -> None:
    lines = [
        f"{line.split(':')[0]}: [x]" if number in bad else line
        for number, line in enumerate(LINES, 1)
    ]
    path = tmp_path / "plan.yaml"
    path.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    assert [p.line for p in caught.value.problems] == sorted(bad)


def _written(key: Key) -> st.SearchStrategy[tuple[str, object]]:
    """Good values of a key: as written, and as they must be read."""
    schema = schema_of(key.hint)
    if (quantity := quantity_in(key.hint)) and quantity.unit:
        scale = 100.0 if quantity.unit == "%" else 1.0
        low, high = quantity.low, quantity.high
        numbers = st.floats(low, high, exclude_min=quantity.above, allow_subnormal=False)
        return numbers.map(lambda x: (f"{x * scale!r} {quantity.unit}", x)).filter(
            lambda pair: low <= float(pair[0].split()[0]) / scale <= high
        )
    if quantity:
        numbers = st.floats(quantity.low, quantity.high, exclude_min=True, allow_subnormal=False)
        return numbers.map(lambda x: (repr(x), x))
    if "enum" in schema:
        return st.sampled_from(schema["enum"]).map(lambda word: (f'"{word}"', word))
    match schema.get("type"):
        case "integer" if "minimum" in schema:
            return st.integers(schema["minimum"], schema["maximum"]).map(lambda x: (repr(x), x))
        case "number" if "minimum" in schema:
            floats = st.floats(schema["minimum"], schema["maximum"], allow_subnormal=False)
            return floats.map(lambda x: (repr(x), x))
        case "boolean":
            return st.booleans().map(lambda x: (str(x).lower(), x))
    return st.nothing()


@pytest.mark.parametrize("kind", sections_below(Plan), ids=lambda kind: kind.__name__)
@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_good_values_are_read_exactly(kind: Kind, data: st.DataObject) -> None:
    for key in keys(kind):
        one = not key.sections and get_origin(key.info.annotation) is not tuple
        if one and not (values := _written(key)).is_empty:
            text, value = data.draw(values, label=key.name)
            root, _ = parse_tree(Source("x.yaml", None, f"- {text}", b""))
            assert isinstance(root, Sequence)
            found, errors = validated(key.hint, root.items[0], [])
            assert not errors
            assert found == value or found == pytest.approx(value, rel=1e-15), key.name
