"""Every impossibility of a plan: just possible, just not, and said at its place."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from stepload.plan.load import load_plan
from stepload.plan.problems import PlanError, Problem

SECTIONS = {
    "payload": "{name: ball, geometry: {shape: sphere, radius: 20 mm}, "
    "material: {name: a, youngs_modulus: 3 GPa, poisson_ratio: 0.3, yield_strength: 70 MPa}, "
    "plate: {name: b, youngs_modulus: 70 GPa, poisson_ratio: 0.3}}",
    "rig": "stvf",
    "procedure": "{step: 50 N, top_force: 300 N, surface_distance: 5 mm}",
}
BALL = SECTIONS["payload"]
PUNCH = BALL.replace("{shape: sphere, radius: 20 mm}", "{shape: flat_punch, radius: 20 mm}")
LIMITED = PUNCH.replace("{name: ball", "{name: ball, force_limit: 400 N")
POWER = LIMITED.replace("{shape: flat_punch, radius: 20 mm}", "{shape: power, %s}")
SENSOR = "driver: sim, axis: +fz, rate: 1 kHz, resolution: 1 N, noise: 1 N, delay: 1 ms"
OTHER_SENSOR = "force: {profile: bota-rokubi-serial, axis: +fz, options: {port: x}}"
"""With it the stiffness of the profile does not hold."""


def payload(old: str, new: str, base: str = BALL) -> dict[str, str]:
    assert old in base
    return {"payload": base.replace(old, new, 1)}


def rig(text: str) -> dict[str, str]:
    return {"rig": f"{{profile: stvf, {text}}}"}


def procedure(text: str, steps: str = "step: 50 N", **sections: str) -> dict[str, str]:
    more = f", {text}" if text else ""
    given = f"{{{steps}, top_force: 300 N, surface_distance: 5 mm{more}}}"
    return {"procedure": given, **sections}


def table(forces: str, deflections: str) -> str:
    return (
        f"system_stiffness: {{value: 3 MN/m, sigma: 1 kN/m, deflection_force: {forces}, "
        f"deflection: {deflections}, deflection_sigma: [1 µm, 1 µm]}}"
    )


def _rising(count: int) -> str:
    return ", ".join(f"{300.0 - 0.2 * n:.1f} N" for n in reversed(range(count)))


QUIET = rig("force: {noise: 1 mN, resolution: 1 mN}")


class Case(NamedTuple):
    """Sections that can just be, others that just cannot, and what is said where."""

    name: str
    possible: dict[str, str]
    impossible: dict[str, str]
    message: str
    at: str


CASES = [
    Case("a control loop without delay", rig("loop_delay: 10 µs"), rig("loop_delay: 0 s"),
         "loop_delay: 0 s is out of range", "0 s}"),
    Case("simulated pad without depth", rig("simulation: {pad_stiffness: 2 MN/m, pad_depth: 3 µm}"),
         rig("simulation: {pad_stiffness: 2 MN/m}"),
         "`pad_stiffness` and `pad_depth` belong together", "simulation"),
    Case("simulated pad without stiffness", rig("simulation: {pad_depth: 0 m}"),
         rig("simulation: {pad_depth: 3 µm}"), "`pad_stiffness` and `pad_depth` belong together",
         "simulation"),
    Case("simulated roughness of a smooth law", rig("simulation: {law: declared, roughness: 5 µm}"),
         rig("simulation: {law: smooth, roughness: 5 µm}"),
         "a roughness, but the simulated law is smooth", "5 µm"),
    Case("simulated rough law that is smooth", rig("simulation: {law: declared, roughness: 0 m}"),
         rig("simulation: {law: rough, roughness: 0 m}"), "a rough law without roughness", "0 m"),
    Case("simulated adhesion of asperities", rig("simulation: {roughness: 5 µm, adhesion: 1 N}"),
         rig("simulation: {roughness: 5 µm, adhesion: 1 N, adhesion_law: jkr}"),
         "jkr adhesion of a rough contact", "jkr"),
    Case("simulated cross-talk of nothing", rig("simulation: {cross_talk: 2 %, lateral: 1 %}"),
         rig("simulation: {cross_talk: 2 %}"), "cross-talk without a lateral force has no effect",
         "2 %"),
    Case("yield strength of the payload", payload("70 MPa", "2.99 GPa"), payload("70 MPa", "3 GPa"),
         "yield strength 3 GPa is not below Young's modulus 3 GPa", "3 GPa}, plate"),
    Case("yield strength of the plate", payload("70 GPa,", "70 GPa, yield_strength: 69.9 GPa,"),
         payload("70 GPa,", "70 GPa, yield_strength: 70 GPa,"),
         "yield strength 70 GPa is not below Young's modulus 70 GPa", "70 GPa, poisson"),
    Case("roughness of a sphere", payload("{name: ball", "{name: ball, roughness: 19.9 mm"),
         payload("{name: ball", "{name: ball, roughness: 20 mm"),
         "roughness 20 mm is not below the radius 20 mm", "20 mm, geometry"),
    Case("roughness of a punch", payload("{name: ball", "{name: ball, roughness: 19.9 mm", LIMITED),
         payload("{name: ball", "{name: ball, roughness: 21 mm", LIMITED),
         "roughness 21 mm is not below the radius 20 mm", "21 mm, force_limit"),
    Case("hardness without roughness",
         payload("{name: ball", "{name: ball, roughness: 1 µm, micro_hardness: 1 GPa"),
         payload("{name: ball", "{name: ball, micro_hardness: 1 GPa"),
         "micro-hardness without roughness", "1 GPa, geometry"),
    Case("no elastic limit for this shape", {"payload": LIMITED}, {"payload": PUNCH},
         "missing key 'force_limit': theory gives no elastic limit", "payload:"),
    Case("no elastic limit without yield strength",
         payload("yield_strength: 70 MPa", "yield_strength: 70 MPa"),
         payload(", yield_strength: 70 MPa", ""),
         "missing key 'force_limit': the yield strength of 'a'", "payload:"),
    Case("a profile that is too steep to compute",
         {"payload": POWER % "exponent: 50, gap: 1 mm, at_radius: 10 mm"},
         {"payload": POWER % "exponent: 50, gap: 1 mm, at_radius: 0.1 µm"},
         "the contact law of this geometry is beyond what can be computed", "geometry:"),
    Case("a profile of no number", {"payload": POWER % "exponent: 2, gap: 1 mm, at_radius: 10 mm"},
         {"payload": POWER % "exponent: 40, gap: 10 m, at_radius: 0.016 µm"},
         "profile coefficient b is inf", "geometry:"),
    Case("a payload too soft to say how far to retract", {"payload": LIMITED},
         {"payload": LIMITED.replace("radius: 20 mm", "radius: 1e-320 m")}, "missing key 'retract'",
         "procedure:"),
    Case("resolution of the force sensor", rig("force: {range: 60 N, resolution: 5.99 N}"),
         rig("force: {range: 60 N, resolution: 6 N}"),
         "resolution 6 N is more than a tenth of the range 60 N", "6 N}"),
    Case("noise of the force sensor", rig("force: {range: 60 N, noise: 5.99 N}"),
         rig("force: {range: 60 N, noise: 6 N}"),
         "noise 6 N is more than a tenth of the range 60 N", "6 N}"),
    Case("resolution of the second sensor",
         rig(f"second_force: {{source: sensor, sensor: {{{SENSOR}, range: 10.1 N}}}}"),
         rig(f"second_force: {{source: sensor, sensor: {{{SENSOR}, range: 10 N}}}}"),
         "resolution 1 N is more than a tenth of the range 10 N", "1 N, noise"),
    Case("source sensor without sensor",
         rig(f"second_force: {{source: sensor, sensor: {{{SENSOR}, range: 1 kN}}}}"),
         rig("second_force: {source: sensor}"), "source is sensor, but there is no `sensor`",
         "second_force:"),
    Case("sensor with another source", rig("second_force: {source: none}"),
         rig(f"second_force: {{source: arm, sensor: {{{SENSOR}, range: 1 kN}}}}"),
         "a sensor, but source is arm", "sensor: {driver"),
    Case("second channel without tolerance", rig("second_force: {source: none, tolerance: 0 N}"),
         rig("second_force: {source: arm, tolerance: 0 N}"),
         "a tolerance of 0 N would stop every run", "0 N}"),
    Case("no stiffness", rig("system_stiffness: {value: 3 MN/m, sigma: 1 kN/m}"),
         rig(f"{OTHER_SENSOR}, system_stiffness: {{msde: 1 µm}}"), "neither `value` nor `record`",
         "system_stiffness:"),
    Case("stiffness without its error", rig("system_stiffness: {value: 3 MN/m, sigma: 1 kN/m}"),
         rig("system_stiffness: {value: 3 MN/m}"), "`value` and `sigma` belong together",
         "system_stiffness:"),
    Case("error without its stiffness", rig("system_stiffness: {sigma: 1 kN/m}"),
         rig(f"{OTHER_SENSOR}, system_stiffness: {{sigma: 1 kN/m, record: none.json}}"),
         "`value` and `sigma` belong together", "system_stiffness:"),
    Case("a table of other lengths", rig(table("[100 N, 300 N]", "[33 µm, 100 µm]")),
         rig(table("[100 N, 300 N]", "[33 µm]")), "2 forces, 1 deflections and 2 uncertainties",
         "[100 N, 300 N]"),
    Case("a table that does not rise", rig(table("[299 N, 300 N]", "[99 µm, 100 µm]")),
         rig(table("[300 N, 300 N]", "[99 µm, 100 µm]")),
         "a force of 300 after 300; they must rise", "[300 N, 300 N]"),
    Case("a table of another stiffness", rig(table("[100 N, 300 N]", "[33 µm, 107 µm]")),
         rig(table("[100 N, 300 N]", "[33 µm, 108 µm]")),
         "the table has a stiffness of 2.67 MN/m above 40 % of its forces, value is 3 MN/m",
         "[33 µm, 108 µm]"),
    Case("one number across", rig("system_stiffness: {at_share: [10 %, -5 %]}"),
         rig("system_stiffness: {at_share: [10 %]}"),
         "at_share has 1 numbers; there are two other axes", "system_stiffness:"),
    Case("numbers across without their errors",
         rig("system_stiffness: {across: [1 µm/N, 0 m/N], across_sigma: [1 µm/N, 1 µm/N]}"),
         rig("system_stiffness: {across: [1 µm/N, 0 m/N]}"),
         "`across` and `across_sigma` belong together", "[1 µm/N"),
    Case("stiffness not known at all", rig("system_stiffness: {value: 1 MN/m, sigma: 0.99 MN/m}"),
         rig("system_stiffness: {value: 1 MN/m, sigma: 1 MN/m}"),
         "uncertainty 1 MN/m is not below the stiffness 1 MN/m", "1 MN/m}}"),
    Case("validity", rig("system_stiffness: {measured_on: 2025-03-02, valid_until: 2025-03-02}"),
         rig("system_stiffness: {measured_on: 2025-03-02, valid_until: 2025-03-01}"),
         "2025-03-01 is before measured_on 2025-03-02", "2025-03-01}"),
    Case("no steps", procedure(""), procedure("", "touches: 3"), "missing key 'step'",
         "procedure:"),
    Case("steps and levels", procedure(""), procedure("levels: [300 N]"),
         "both `step` and `levels`", "[300 N]"),
    Case("no level", procedure("", "levels: [300 N]"), procedure("", "levels: []"), "0 levels",
         "[]"),
    Case("too many levels", procedure("touch_force: 0.1 N", f"levels: [{_rising(1000)}]", **QUIET),
         procedure("touch_force: 0.1 N", f"levels: [{_rising(1001)}]", **QUIET), "1001 levels",
         "[100.0 N"),
    Case("levels that stand", procedure("", "levels: [100 N, 100.1 N, 300 N]"),
         procedure("", "levels: [100 N, 100 N, 300 N]"), "100 N after 100 N", "[100 N"),
    Case("levels that fall", procedure("", "levels: [100 N, 300 N]"),
         procedure("", "levels: [301 N, 300 N]"), "300 N after 301 N", "[301 N"),
    Case("levels that end elsewhere", procedure("", "levels: [100 N, 0.3 kN]"),
         procedure("", "levels: [100 N, 299 N]"), "the last level 299 N is not the top force 300 N",
         "[100 N"),
    Case("a step above the top", procedure("", "step: 300 N"), procedure("", "step: 300.1 N"),
         "top force 300 N is below one step of 300.1 N", "300 N, surface"),
    Case("too many steps", procedure("touch_force: 0.1 N", "step: 0.3 N", **QUIET),
         procedure("touch_force: 0.1 N", "step: 0.2997 N", **QUIET), "1001 load levels",
         "0.2997 N"),
    Case("uncertain start", procedure("surface_uncertainty: 5 mm"),
         procedure("surface_uncertainty: 5.01 mm"),
         "5.01 mm is more than the surface_distance 5 mm", "5.01 mm"),
    Case("short search", procedure("surface_uncertainty: 2 mm, search_distance: 4 mm"),
         procedure("surface_uncertainty: 2 mm, search_distance: 3.99 mm"),
         "the search ends after 3.99 mm, within the uncertain band of 2 x 2 mm", "3.99 mm"),
    Case("touch above the first level", procedure("touch_force: 49.9 N", "levels: [50 N, 300 N]"),
         procedure("touch_force: 50 N", "levels: [50 N, 300 N]"),
         "contact threshold 50 N is not below the first level 50 N", "50 N}"),
    Case("touch in the noise", procedure("touch_force: 2 N"), procedure("touch_force: 1.99 N"),
         "contact threshold 1.99 N is within 4 sigma of the noise 500 mN", "1.99 N"),
    Case("retract within the elastic travel", procedure("retract: 0.1503 mm"),
         procedure("retract: 0.1502 mm"),
         "does not part the contact: arm and payload give way by 150.231 µm at the top force",
         "0.1502 mm"),
    Case("a tare of too few readings", procedure("tare: 10.1 ms"), procedure("tare: 9.9 ms"),
         "a tare of 9.9 ms holds 9.9 readings of the force sensor (1000 Hz)", "9.9 ms"),
    Case("mechanical fuse", rig("mechanical_fuse: 300.1 N"), rig("mechanical_fuse: 300 N"),
         "the mechanical fuse opens at 300 N, before the top force 300 N", "300 N, surface"),
    Case("secant beyond the data", {"identify": "{secant_force: 300 N}"},
         {"identify": "{secant_force: 300.1 N}"},
         "the secant at 300.1 N is beyond the top force 300 N", "300.1 N"),
    Case("a run that is too long", procedure("hold: 1 h"), procedure("hold: 3601 s"),
         "24 holds of 3601 s last 24.0 h", "3601 s"),
    Case("a run that is too long upwards", procedure("hold: 2 h, unload: false"),
         procedure("hold: 7201 s, unload: false"), "12 holds of 7201 s last 24.0 h", "7201 s"),
    Case("a run of one cycle that is too long", procedure("hold: 2 h, cycles: 1"),
         procedure("hold: 7201 s, cycles: 1"), "12 holds of 7201 s last 24.0 h", "7201 s"),
    Case("nothing left to decide", procedure("until: ±5 %", "step: 75 N"),
         procedure("until: ±5 %", "step: 100 N"), "3 load levels", "±5 %"),
    Case("a calibration that ends early", procedure("", identify="{kind: system}"),
         procedure("until: ±5 %", identify="{kind: system}"), "has no chord stiffness of a payload",
         "±5 %"),
    Case("an early end of what is never identified", procedure("until: ±5 %, unload: false"),
         procedure("until: ±5 %, unload: false, cycles: 1"),
         "no figure of such a run is identified", "±5 %"),
    Case("an early end after one cycle of nothing", procedure("until: ±5 %, cycles: 1"),
         procedure("until: ±5 %, cycles: 1, unload: false"), "only a loading", "±5 %"),
    Case("an end before the figure is identified", procedure("until: ±20 %"),
         procedure("until: ±20.1 %"), "±20.1 % is wider than the ±20 %", "±20.1 %"),
    Case("an end by a gauge that is read later", procedure("until: ±5 %"),
         procedure("until: ±5 %")
         | rig("displacement: {driver: sim, rate: 100 Hz, resolution: 1 µm, noise: 1 µm}"),
         "a gauge across the contact", "±5 %"),
    Case("limits the wrong way round",
         {"identify": "{acceptance: {chord_min: 5 MN/m, chord_max: 5.1 MN/m}}"},
         {"identify": "{acceptance: {chord_min: 5 MN/m, chord_max: 5 MN/m}}"},
         "chord_max is not above", "5 MN/m}}"),
    Case("no limit", {"identify": "{acceptance: {chord_max: 5 MN/m}}"},
         {"identify": "{acceptance: {}}"}, "no limit", "acceptance"),
    Case("a directory above", {"record": "{directory: runs/x..y}"},
         {"record": "{directory: runs/../y}"}, "a directory with `..` in it", "runs/../y"),
]  # fmt: skip


def problems(directory: Path, sections: dict[str, str]) -> list[Problem]:
    """What is wrong with a plan of these sections."""
    path = directory / "plan.yaml"
    lines = [f"{name}: {text}" for name, text in {**SECTIONS, **sections}.items()]
    path.write_text("\n".join(["stepload: 1", *lines]), encoding="utf-8")
    try:
        load_plan(path)
    except PlanError as error:
        return list(error.problems)
    return []


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_cannot_be_is_refused_at_its_place(case: Case, tmp_path: Path) -> None:
    found = problems(tmp_path, case.impossible)
    (problem,) = [p for p in found if case.message in p.message] or found
    assert case.message in problem.message
    assert problem.source_line[problem.column - 1 :].startswith(case.at)
    assert problem.hint


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_what_can_just_be_is_not(case: Case, tmp_path: Path) -> None:
    assert problems(tmp_path, case.possible) == []


def test_a_bad_value_hides_nothing_of_other_sections(tmp_path: Path) -> None:
    """What sections say together waits until each is good by itself."""
    bad = {
        "payload": BALL.replace("70 GPa", "70 GP").replace("70 MPa", "3 GPa"),
        "rig": "{profile: stvf, force: {noise: 5, resolution: 1 kN}, mechanical_fuse: 200 N, "
        "system_stiffness: {value: 3 MN/m, sigma: 4 MN/m}, arm: {options: {sed: 1}}}",
        "procedure": "{step: 50 N, top_force: 300 N, surface_distance: 5 mm, touch_force: 300 N, "
        "search_distance: 1 mm}",
        "identify": "{secant_force: 1 kN, p: 0}",
    }
    expected = [
        "youngs_modulus: '70 GP'", "yield strength 3 GPa", "noise: 5 has no unit",
        "uncertainty 4 MN/m", "unknown key 'sed'", "the search ends after 1 mm",
        "p: 0 is out of range",
    ]  # fmt: skip
    found = problems(tmp_path, bad)
    said = " | ".join(p.message for p in found)
    assert [text for text in expected if text not in said] == []
    assert len(found) == len(expected)
