"""How hard a payload may be pressed, and which plans of it are looked at."""

from __future__ import annotations

from pathlib import Path

import pytest

from stepload.design import plan_design as room
from stepload.design.plan_design import grid
from stepload.design.top_force import Ceiling, ceiling
from stepload.feasibility.conditions import expected_result
from stepload.feasibility.draft_plan import Order, plan_of
from stepload.feasibility.preflight import derive
from stepload.feasibility.reason import PlanVerdict
from stepload.plan.shipped import payload_folder
from stepload.units import rounded_down

PAYLOADS = payload_folder()
SPHERE = PAYLOADS / "plastic-sphere.yaml"
FINE = "profile: stvf\nsystem_stiffness: {msde: 10 nm}\n"
"""The measured position of this rig takes next to nothing of the travel limit."""
SLIDING_ARM = """\
profile: ur5e
arm: {driver: sim, options: {}}
force: {driver: sim, options: {}}
system_stiffness: {stuck_ratio: 1}
"""
"""A UR5e of which nothing holds the tip sideways: the travel limit is longer."""
FINE_ARM = "position_resolution: 0.2 um"


@pytest.mark.parametrize("name", ["polyurethane-sphere", "silicone-sphere"])
def test_the_elastic_limit_ends_it_where_that_is_lower(name: str, tmp_path: Path) -> None:
    rig = tmp_path / "mine.yaml"
    rig.write_text(f"{FINE}arm: {{{FINE_ARM}}}\n")
    found = ceiling(str(rig), PAYLOADS / f"{name}.yaml")
    plan = plan_of(str(rig), PAYLOADS / f"{name}.yaml", found.top_n)
    preflight = derive(plan)
    assert found.top_n == pytest.approx(preflight.largest_safe_force_n, rel=1e-4)
    assert found.top_n < preflight.theory.counted.lower_n
    assert "is not safe: its elastic limit F_c" in found.why


def test_the_rig_ends_it_where_the_payload_bears_more(tmp_path: Path) -> None:
    rig = tmp_path / "mine.yaml"
    rig.write_text(f"{FINE}arm: {{max_push: 250 N, {FINE_ARM}}}\n")
    found = ceiling(str(rig), PAYLOADS / "stiff-flat.yaml")
    assert 240.0 < found.top_n < 250.0
    assert found.why.endswith("leaves too little room below what STVF can press with")


@pytest.fixture
def one_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    """A grid of a fifth of the orders."""
    monkeypatch.setattr(room, "HOLDS_S", (1.0,))


@pytest.mark.usefixtures("one_hold")
def test_all_orders_of_the_largest_top_force_may_run_where_the_elastic_limit_ends_it(
    tmp_path: Path,
) -> None:
    """Larger steps need more room below F_c: a plan of few steps is not left out for that."""
    rig = tmp_path / "mine.yaml"
    rig.write_text(
        f"{FINE}arm: {{{FINE_ARM}}}\n"
        "displacement: {driver: sim, rate: 100 Hz, resolution: 1 um}\n"
    )  # fmt: skip
    limit = ceiling(str(rig), SPHERE, Order(min(room.STEPS)))
    assert 400.0 < limit.top_n < ceiling(str(rig), SPHERE, Order(12)).top_n
    found = grid(str(rig), SPHERE, limit, "5 mm")
    highest = [each.order for each in found.candidates if each.share == 1.0]
    assert len(highest) == len(room.STEPS) * len(room.HOLDS_S) * len(room.RAMPS_S)


@pytest.mark.parametrize(
    ("force_n", "expected"),
    [(74.1666, 74.1), (300.0, 300.0), (0.1239, 0.123), (99.99, 99.9), (1000.0, 1000.0),
     (0.3, 0.3), (0.0, 0.0)],
)  # fmt: skip
def test_forces_are_rounded_down(force_n: float, expected: float) -> None:
    assert rounded_down(force_n) == expected


@pytest.mark.usefixtures("one_hold")
def test_every_plan_of_the_grid_is_one_that_preflight_lets_run() -> None:
    limit = ceiling("stvf", SPHERE)
    found = grid("stvf", SPHERE, limit, "5 mm")
    assert len(found.candidates) + found.refused == (
        len(room.SHARES) * len(room.STEPS) * len(room.HOLDS_S) * len(room.RAMPS_S)
    )
    for each in found.candidates:
        assert each.top_n <= limit.top_n
        assert each.step_n * each.order.steps == pytest.approx(each.top_n, rel=1e-12)
    for each in found.candidates[:: len(found.candidates) - 1]:
        preflight = derive(plan_of("stvf", SPHERE, each.top_n, each.order))
        assert preflight.verdict is not PlanVerdict.REFUSED
        assert each.duration_s == preflight.duration_s
        expected = expected_result(preflight.plan, preflight.theory, preflight.loading_times).chord
        assert each.half_width == pytest.approx(expected.half_width, rel=1e-9)
        assert each.expected.chord.to_n == pytest.approx(each.top_n, rel=1e-3)


@pytest.mark.usefixtures("one_hold")
def test_what_preflight_refuses_is_no_candidate_and_its_reason_is_kept() -> None:
    aluminium = PAYLOADS / "aluminium-sphere.yaml"
    found = grid("stvf", aluminium, ceiling("stvf", aluminium), "5 mm")
    assert found.candidates == ()
    assert "Not identifiable" in found.because


@pytest.mark.usefixtures("one_hold")
def test_a_force_beyond_the_limit_is_refused_by_preflight_whatever_the_ceiling_says() -> None:
    payload = PAYLOADS / "plastic-sphere.yaml"
    honest = ceiling("stvf", payload)
    bold = Ceiling(honest.rig, honest.payload, 2.0 * honest.top_n, "")
    found = grid("stvf", payload, bold, "5 mm")
    assert max(each.top_n for each in found.candidates) <= honest.top_n * 1.01
    assert found.refused >= len(room.STEPS) * len(room.HOLDS_S) * len(room.RAMPS_S)


@pytest.mark.long
def test_a_plan_on_an_arm_that_clings_takes_its_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(room, "HOLDS_S", (1.0, 8.0))
    monkeypatch.setattr(room, "STEPS", (4, 12))
    rig = str(tmp_path / "ur5e.yaml")
    Path(rig).write_text(SLIDING_ARM)
    silicone = PAYLOADS / "silicone-sphere.yaml"
    limit = ceiling(rig, silicone)
    found = grid(rig, silicone, limit, "5 mm")
    assert {each.share for each in found.candidates} == {0.25, 0.5, 0.75, 1.0}
    for each in found.candidates:
        preflight = derive(plan_of(rig, silicone, each.top_n, each.order))
        assert preflight.loading_times is not None
        loading = each.expected.run.tracks[0][1]
        lasts_s = sum(preflight.loading_times.up_s) + each.order.steps * each.order.hold_s
        assert loading.time_s[-1] == pytest.approx(lasts_s, abs=0.1)


@pytest.mark.usefixtures("one_hold")
def test_where_a_material_is_known_as_a_range_the_stiffest_is_designed_for(tmp_path: Path) -> None:
    payload = tmp_path / "range.yaml"
    text = SPHERE.read_text().replace("  yield_strength: 70 MPa\n", "")
    text = text.replace("modulus: 2.75 GPa", "modulus: 2 GPa to 3.5 GPa")
    payload.write_text(text + "force_limit: 400 N\n")
    found = grid("stvf", payload, ceiling("stvf", payload), "5 mm").candidates[0]
    preflight = derive(plan_of("stvf", payload, found.top_n, found.order))
    stiff, soft = (
        0.9 * found.top_n / (law.deformation(found.top_n) - law.deformation(0.1 * found.top_n))
        for law in (preflight.theory.stiffest, preflight.theory.softest)
    )
    assert found.expected.chord.value_n_per_m == pytest.approx(stiff, rel=5e-3)
    assert found.expected.chord.value_n_per_m > 1.2 * soft


def test_a_plan_whose_first_level_is_left_out_is_no_candidate(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Twelve steps of 0.77 N begin below the touch force of 1 N: such a plan has fewer levels."""
    for name, only in (("HOLDS_S", 1.0), ("RAMPS_S", 1.0), ("SHARES", 0.25)):
        monkeypatch.setattr(room, name, (only,))
    ball = tmp_path / "ball.yaml"
    ball.write_text(
        "name: ball\nforce_limit: 60 N\ngeometry: {shape: sphere, radius: 20 mm}\n"
        "material: {name: silicone, youngs_modulus: 2 MPa, poisson_ratio: 0.49}\n"
        "plate: {name: steel, youngs_modulus: 70 GPa, poisson_ratio: 0.33,"
        " yield_strength: 250 MPa}\n"
    )
    found = grid("ur5e", ball, Ceiling("UR5e", "ball", 37.2, ""), "5 mm")
    assert found.candidates
    assert 12 not in [each.order.steps for each in found.candidates]
    for each in found.candidates:
        held = each.expected.run.tracks[0][1].held
        assert len({*held} - {0}) == each.order.steps
