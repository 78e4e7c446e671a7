"""Good plans: defaults, profiles, files and SI units."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from stepload.contact.materials import (
    BluntTip,
    FlatPunch,
    Geometry,
    PowerProfile,
    SharpCone,
    Sphere,
)
from stepload.plan.load import load_payload, load_plan
from stepload.plan.model import Provenance, SecondForceSource
from stepload.plan.problems import PlanError
from stepload.plan.shipped import payload_folder

WritePlan = Callable[..., Path]


def test_what_is_not_said_has_a_sensible_default(write_plan: WritePlan) -> None:
    plan = load_plan(write_plan())
    assert plan.name == "plan"
    procedure = plan.procedure
    assert procedure.levels_n == (50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
    assert (procedure.touches, procedure.tare_s, procedure.cycles) == (3, 10.0, 2)
    touch_n = procedure.touch_force_n
    assert touch_n == pytest.approx(6.0 * math.hypot(0.5, 1.5 / math.sqrt(12.0)))
    touch_m = touch_n / 3.49e6 + (touch_n / 6.57e8) ** (2.0 / 3.0) + plan.rig.arm.lost_motion_m
    assert procedure.search_distance_m == pytest.approx(3e-3 + 2.0 * touch_m, rel=1e-3)
    travel_m = 300.0 / 3.49e6 + (300.0 / 6.57e8) ** (2.0 / 3.0)
    assert procedure.retract_m > 2.0 * travel_m
    identify = plan.identify
    assert identify.kind == "payload"
    assert (identify.resolution_multiple_p, identify.compensation_quality_s) == (2.0, 20.0)
    assert (identify.accuracy_t, identify.secant_force_n) == (5.0, 300.0)
    assert identify.accept_unidentifiable == ""
    assert plan.record.directory == Path("runs")


def test_quantities_arrive_in_si_units(write_plan: WritePlan) -> None:
    rig = load_plan(write_plan()).rig
    assert rig.system_stiffness.stiffness_n_per_m == 3.49e6
    assert rig.system_stiffness.damping_n_s_per_m == 3.87e4
    assert rig.system_stiffness.msde_m == 5.42e-7
    assert rig.arm.position_resolution_m == 2e-6
    assert (rig.force.resolution_n, rig.force.rate_hz) == (1.5, 1000.0)
    assert rig.second_force.source is SecondForceSource.ARM
    assert rig.second_force.tolerance_relative == 0.02


@pytest.mark.parametrize(("step", "count"), [("1.1 N", 273), ("100 N", 3), ("70 N", 5)])
def test_levels_end_exactly_at_the_top_force(write_plan: WritePlan, step: str, count: int) -> None:
    low = "surface_distance: 5 mm, touch_force: 1 N"
    path = write_plan(
        ("50 N", step),
        ("surface_distance: 5 mm", low),
        ("rig: stvf", "rig: {profile: stvf, force: {noise: 0.1 N}}"),
    )
    levels = load_plan(path).procedure.levels_n
    assert len(levels) == count
    assert levels[-1] == 300.0
    assert all(a < b for a, b in pairwise(levels))


def test_overrides_are_laid_over_a_profile(write_plan: WritePlan) -> None:
    override = "rig: {profile: stvf, name: ours, force: {noise: 0.4 N}, mechanical_fuse: 600 N}"
    rig = load_plan(write_plan(("rig: stvf", override))).rig
    assert (rig.name, rig.force.noise_n, rig.mechanical_fuse_n) == ("ours", 0.4, 600.0)
    assert rig.force.resolution_n == 1.5


def test_a_stiffness_with_a_value_replaces_the_whole_old_one(write_plan: WritePlan) -> None:
    override = "rig: {profile: stvf, system_stiffness: {value: 4 MN/m, sigma: 40 kN/m}}"
    stiffness = load_plan(write_plan(("rig: stvf", override))).rig.system_stiffness
    assert (stiffness.stiffness_n_per_m, stiffness.sigma_n_per_m) == (4e6, 4e4)
    assert stiffness.damping_n_s_per_m == 0.0
    assert stiffness.provenance is Provenance.DECLARED


def test_a_procedure_may_be_a_file(write_plan: WritePlan, tmp_path: Path) -> None:
    (tmp_path / "steps.yaml").write_text("step: 10 N\ntop_force: 20 N\nsurface_distance: 4 mm\n")
    inline = "{step: 50 N, top_force: 300 N, surface_distance: 5 mm}"
    plan = load_plan(write_plan((inline, "steps.yaml")))
    assert plan.procedure.levels_n == (10.0, 20.0)


def test_a_problem_in_a_file_is_reported_with_that_file(
    write_plan: WritePlan, tmp_path: Path
) -> None:
    path = write_plan()
    (tmp_path / "ball.yaml").write_text("name: ball\ngeometry: {shape: sphere, radius: 3}\n")
    with pytest.raises(PlanError) as caught:
        load_plan(path)
    problem = caught.value.problems[-1]
    assert Path(problem.file).name == "ball.yaml"
    assert (problem.line, problem.column) == (2, 35)


@pytest.mark.parametrize(
    ("geometry", "built"),
    [
        ("{shape: sphere, radius: 3 mm}", Sphere(0.003)),
        ("{shape: sphere, radius: 3 mm, counter_radius: 1 cm}", Sphere(0.003, 0.01)),
        ("{shape: cone_tip, radius: 3 mm}", BluntTip("cone", 0.003)),
        ("{shape: pyramid_tip, radius: 3 mm}", BluntTip("pyramid", 0.003)),
        ("{shape: sharp_cone, slope: 15 deg}", SharpCone(math.radians(15.0))),
        ("{shape: flat_punch, radius: 3 mm}", FlatPunch(0.003)),
        (
            "{shape: power, exponent: 3, gap: 1 mm, at_radius: 10 mm}",
            PowerProfile(3.0, pytest.approx(1000.0)),
        ),
    ],
)
def test_every_shape_is_built(tmp_path: Path, geometry: str, built: Geometry) -> None:
    path = tmp_path / "payload.yaml"
    path.write_text(
        f"name: x\ngeometry: {geometry}\nforce_limit: 400 N\n"
        "material: {name: a, youngs_modulus: 3 GPa, poisson_ratio: 0.3}\n"
        "plate: {name: b, youngs_modulus: 70 GPa, poisson_ratio: 0.33}\n"
    )
    payload = load_payload(path)
    assert payload.geometry == built
    assert payload.declared_force_limit_n == 400.0


def test_driver_options_arrive_checked_and_complete(write_plan: WritePlan) -> None:
    override = (
        "rig: {profile: ur5e, arm: {options: {host: 127.0.0.1, lookahead: 50 ms, "
        "approach: [0, 0, -1]}}, force: {options: {port: /dev/null}}}"
    )
    rig = load_plan(write_plan(("rig: stvf", override), ("300 N", "150 N"))).rig
    options = rig.arm.options
    assert (options["host"], options["lookahead"]) == ("127.0.0.1", 0.05)
    assert options["approach"] == (0.0, 0.0, -1.0)
    assert options["upper_registers"] is False
    assert rig.system_stiffness.provenance is Provenance.INDICATIVE


def test_uncertainties_arrive_beside_their_values(write_plan: WritePlan, tmp_path: Path) -> None:
    path = write_plan()
    ball = tmp_path / "ball.yaml"
    text = ball.read_text().replace("70 MPa", "70 MPa ± 10 %").replace("0.3,", "0.30 +/- 0.01,")
    text = text.replace("28.7 mm", "28.7 mm +- 10 µm")
    ball.write_text(text + "roughness: 7.5 µm ± 0.5 µm\nforce_limit: 400 N ± 20 N\n")
    payload = load_plan(path).payload
    material = payload.material
    assert (material.yield_strength_pa, material.poisson_ratio) == (70e6, 0.3)
    assert material.yield_strength_sigma_pa == pytest.approx(7e6)
    assert material.poisson_ratio_sigma == 0.01
    assert material.youngs_modulus_sigma_pa is None
    assert payload.geometry == Sphere(28.7e-3, None, pytest.approx(1e-5), None)
    assert payload.roughness_sigma_m == pytest.approx(5e-7)
    assert payload.declared_force_limit_sigma_n == 20.0
    assert payload.micro_hardness_sigma_pa is None


def test_the_sources_of_a_plan_are_every_file_that_it_is_made_from(
    write_plan: WritePlan, tmp_path: Path
) -> None:
    payload = tmp_path / "mine.yaml"
    payload.write_text((payload_folder() / "plastic-sphere.yaml").read_text())
    (tmp_path / "rig.yaml").write_text("profile: stvf\n")
    plan = tmp_path / "both.yaml"
    plan.write_text(
        "stepload: 1\npayload: ./mine.yaml\nrig: ./rig.yaml\nprocedure: "
        "{step: 50 N, top_force: 300 N, surface_distance: 5 mm}\n"
    )

    def sums() -> tuple[str, ...]:
        return tuple(source.sha256 for source in load_plan(plan).sources)

    before = sums()
    assert sums() == before
    payload.write_text(payload.read_text().replace("28.7 mm", "28.8 mm"))
    other = sums()
    (tmp_path / "rig.yaml").write_text("profile: stvf\nname: mine\n")
    assert len({before, other, sums()}) == 3


@pytest.mark.parametrize(
    ("steps", "touch_n", "first_n"),
    [
        ("step: 2.4 N, top_force: 12 N", 3.97, 4.8),  # levels below the touch are left out
        ("levels: [4.5 N, 12 N], top_force: 12 N", 3.97, 4.5),
        ("step: 50 N, top_force: 300 N", 3.97, 50.0),
        ("levels: [2 N, 300 N], touch_force: 2.5 N, top_force: 300 N", 2.5, math.nan),
    ],
)
def test_the_touch_force_and_the_first_level_fit_each_other(
    write_plan: WritePlan, steps: str, touch_n: float, first_n: float
) -> None:
    """An error only where the levels that a person writes cannot be told from noise."""
    path = write_plan(("step: 50 N, top_force: 300 N", steps))
    if math.isnan(first_n):
        with pytest.raises(PlanError):
            load_plan(path)
        return
    procedure = load_plan(path).procedure
    assert procedure.touch_force_n == pytest.approx(touch_n, abs=0.01)
    assert procedure.levels_n[0] == first_n
