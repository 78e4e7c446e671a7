"""What follows from other keys, term by term."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from stepload.plan.load import load_plan
from stepload.plan.model import Plan, Procedure

RIG = """
name: ours
arm:
  driver: sim
  rate: 1 kHz
  max_speed: 50 mm/s
  max_acceleration: 2 m/s^2
  max_push: 2 kN
  effective_mass: 20 kg
  command_delay: 3 ms
  lag: 4 ms
  lost_motion: 10 µm
  position_resolution: 2 µm
force: {driver: sim, axis: +fz, rate: 1 kHz, range: 10 kN, resolution: %s, noise: %s, delay: 1 ms}
system_stiffness: {value: %s, sigma: 1 kN/m}
"""
PAYLOAD = """
name: ball
force_limit: 100 kN
geometry: {shape: flat_punch, radius: 1 mm}
material: {name: a, youngs_modulus: 2 GPa, poisson_ratio: 0}
plate: {name: b, youngs_modulus: 2 GPa, poisson_ratio: 0}
"""
K = 2.0 * 1e-3 * 1e9
"""Stiffness of the punch in N/m: 2 R E_eq."""
LOST_M = 10e-6


def plan(
    directory: Path,
    *,
    steps: str = "step: 50 N, top_force: 300 N",
    procedure: str = "touch_force: 40 N",
    resolution: str = "1 mN",
    noise: str = "1 mN",
    stiffness: str = "1 MN/m",
    rest: str = "",
) -> Plan:
    (directory / "rig.yaml").write_text(RIG % (resolution, noise, stiffness), encoding="utf-8")
    (directory / "ball.yaml").write_text(PAYLOAD, encoding="utf-8")
    path = directory / "my-plan.yaml"
    given = f"{{{steps}, surface_distance: 50 mm{', ' + procedure if procedure else ''}}}"
    path.write_text(
        f"stepload: 1\npayload: ball.yaml\nrig: rig.yaml\nprocedure: {given}\n{rest}",
        encoding="utf-8",
    )
    return load_plan(path)


def procedure(directory: Path, **how: str) -> Procedure:
    return plan(directory, **how).procedure


@pytest.mark.parametrize(
    ("steps", "levels", "step"),
    [
        ("step: 100 N, top_force: 300 N", (100.0, 200.0, 300.0), 100.0),
        ("step: 100 N, top_force: 302 N", (100.0, 200.0, 300.0, 302.0), 100.0),
        ("step: 100 N, top_force: 301 N", (100.0, 200.0, 301.0), 100.0),
        ("step: 300 N, top_force: 300 N", (300.0,), 300.0),
        ("step: 111.1 N, top_force: 333.3 N", (111.1, 222.2, 333.3), 111.1),
        ("levels: [50 N, 150 N, 300 N], top_force: 300 N", (50.0, 150.0, 300.0), 150.0),
        ("levels: [200 N, 300 N], top_force: 300 N", (200.0, 300.0), 200.0),
    ],
)
def test_levels_follow_from_the_step_and_the_step_from_levels(
    tmp_path: Path, steps: str, levels: tuple[float, ...], step: float
) -> None:
    made = procedure(tmp_path, steps=steps)
    assert (made.levels_n, made.step_n) == (levels, step)
    assert made.load_rate_n_per_s == pytest.approx(step)


@pytest.mark.parametrize(
    ("top_n", "resolution", "noise", "touch_n"),
    [
        (90, "1 mN", "1 mN", 1.0),
        (1000, "1 mN", "1 mN", 10.0),
        (1000, "6 N", "1 mN", 12.0),
        (100, "1 mN", "2 N", 12.0),
        (100, "3 N", "1 N", 6.0 * math.hypot(1.0, 3.0 / math.sqrt(12.0))),
    ],
)
def test_the_touch_force(
    tmp_path: Path, top_n: int, resolution: str, noise: str, touch_n: float
) -> None:
    made = procedure(
        tmp_path, steps=f"step: 40 N, top_force: {top_n} N", procedure="",
        resolution=resolution, noise=noise,
    )  # fmt: skip
    assert made.touch_force_n == pytest.approx(touch_n, rel=1e-6)


@pytest.mark.parametrize(
    ("top_n", "resolution", "drift_n"),
    [(90, "1 mN", 1.0), (1000, "1 mN", 10.0), (1000, "6 N", 18.0), (90, "300 mN", 1.0)],
)
def test_the_largest_drift(tmp_path: Path, top_n: int, resolution: str, drift_n: float) -> None:
    made = procedure(
        tmp_path, steps=f"step: 40 N, top_force: {top_n} N", procedure="", resolution=resolution
    )
    assert made.max_drift_n == pytest.approx(drift_n)
    assert procedure(tmp_path, procedure="max_drift: 7 N").max_drift_n == 7.0


def test_search_and_retract_hold_what_arm_and_payload_give_way(tmp_path: Path) -> None:
    made = procedure(tmp_path, procedure="touch_force: 40 N, surface_uncertainty: 2 mm")
    touch_m = 40.0 / 1e6 + 40.0 / K + LOST_M
    assert made.search_distance_m == pytest.approx(3.0 * 2e-3 + 2.0 * touch_m)
    travel_m = 300.0 / 1e6 + 300.0 / K + LOST_M
    assert made.retract_m == pytest.approx(2.0 * travel_m)
    assert procedure(tmp_path, stiffness="100 MN/m").retract_m == 5e-4
    given = "touch_force: 40 N, search_distance: 7 mm, retract: 8 mm"
    made = procedure(tmp_path, procedure=given)
    assert (made.search_distance_m, made.retract_m) == (7e-3, 8e-3)


@pytest.mark.parametrize(("top_n", "secant_n"), [(299, 299.0), (1000, 300.0)])
def test_the_secant_force(tmp_path: Path, top_n: int, secant_n: float) -> None:
    steps = f"step: 50 N, top_force: {top_n} N"
    assert plan(tmp_path, steps=steps).identify.secant_force_n == secant_n
    given = plan(tmp_path, steps=steps, rest="identify: {secant_force: 7 N}")
    assert given.identify.secant_force_n == 7.0
