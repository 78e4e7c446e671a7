"""Remedies: what is told is written into the plan's file, and the file is read and judged again."""

from __future__ import annotations

import copy
import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from stepload.errors import BadInputError, RefusedError
from stepload.feasibility.advice import NONE_HELPS, advised
from stepload.feasibility.bounds import Measured
from stepload.feasibility.preflight import Preflight, derive, preflight_of
from stepload.feasibility.reason import Reason, Severity
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.units import parse_quantity

PROCEDURES = Path(__file__).resolve().parents[3] / "procedures"
ALUMINIUM = {"name": "aluminium", "youngs_modulus": "70 GPa", "poisson_ratio": 0.33,
             "yield_strength": "276 MPa"}  # fmt: skip
BASE: dict[str, Any] = {
    "stepload": 1,
    "payload": {
        "name": "ball",
        "geometry": {"shape": "sphere", "radius": "28.7 mm"},
        "material": {"name": "acetal", "youngs_modulus": "2.75 GPa", "poisson_ratio": 0.3,
                     "yield_strength": "70 MPa"},
        "plate": dict(ALUMINIUM),
    },
    "rig": {
        "profile": "stvf",
        "arm": {"max_push": "1 kN"},
        "force": {"range": "1 kN", "noise": "0.5 N", "resolution": "1.5 N"},
        "second_force": {"source": "arm", "tolerance": "4 N", "tolerance_relative": "2 %",
                         "noise": "0.5 N"},
        "system_stiffness": {"value": "3.49e6 N/m", "sigma": "3.49e4 N/m",
                             "damping": "3.87e4 N s/m"},
    },
    "procedure": {"step": "50 N", "top_force": "300 N", "surface_distance": "5 mm"},
    "identify": {},
}  # fmt: skip

Q = r"([-+.\de]+ \S+)"
"""A quantity in a sentence."""


def put(data: dict[str, Any], path: str, value: object) -> None:
    *parents, key = path.split(".")
    for parent in parents:
        data = data.setdefault(parent, {})
    data[key] = value


def assumed_bodies(data: dict[str, Any]) -> list[dict[str, Any]]:
    bodies = [data["payload"][key] for key in ("material", "plate")]
    return [body for body in bodies if "±" not in body.get("yield_strength", "±")]


def written(data: dict[str, Any], remedy: str) -> dict[str, Any]:
    """A plan's file with one remedy written into it as a person would; KeyError: not understood."""
    data = copy.deepcopy(data)
    keys = {
        rf"top_force: {Q}": "procedure.top_force",
        rf"touch_force: {Q}": "procedure.touch_force",
        rf"step: {Q}": "procedure.step",
        rf"secant_force: {Q}": "identify.secant_force",
        rf"search_distance: {Q}": "procedure.search_distance",
        rf"second_force.tolerance: {Q}, if both channels agree within that": (
            "rig.second_force.tolerance"
        ),
        rf"settle_timeout: {Q}": "procedure.settle_timeout",
        rf"a blunter \w+, radius {Q}": "payload.geometry.radius",
    }
    for part in re.split(r", and |, (?=step|secant_force)", remedy):
        for pattern, path in keys.items():
            if found := re.fullmatch(pattern, part):
                put(data, path, found[1])
                break
        else:
            written_device(data, part)
    return data


def written_device(data: dict[str, Any], part: str) -> None:
    if found := re.fullmatch(rf"a displacement gauge across the contact, resolution {Q}", part):
        put(data, "rig.displacement", {"driver": "sim", "rate": "1 kHz", "resolution": found[1]})
    elif found := re.fullmatch(
        rf"the arm's own force as second_force, if it agrees within {Q} \+ (\S+)%", part
    ):
        data["rig"]["second_force"] |= {
            "source": "arm", "tolerance": found[1], "tolerance_relative": f"{found[2]} %",
            "noise": f"{0.1 * parse_quantity(found[1], 'N')} N",
        }  # fmt: skip
    elif found := re.fullmatch(r"measure the yield strength of .* to ± (\S+) %", part):
        for body in assumed_bodies(data):
            body["yield_strength"] += f" ± {found[1]} %"
    elif part == "accept it in writing: identify.accept_unidentifiable":
        put(data, "identify.accept_unidentifiable", "accepted")
    else:
        raise KeyError(part)


def read(directory: Path, data: dict[str, Any]) -> Plan:
    path = directory / "plan.yaml"
    path.write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")
    return load_plan(path)


def codes(preflight: Preflight, severity: Severity) -> set[str]:
    return {reason.code for reason in preflight.reasons if reason.severity is severity}


def check(directory: Path, data: dict[str, Any], preflight: Preflight, reason: Reason) -> None:
    """Write the only remedy of a plan into the file: the reason is lifted, and none comes."""
    after = derive(read(directory, written(data, reason.remedy)))
    found = codes(after, Severity.REFUSE) | codes(after, Severity.WARN)
    assert reason.code not in found, reason.remedy
    before = codes(preflight, Severity.REFUSE) | codes(preflight, Severity.WARN)
    assert reason.severity is Severity.REFUSE or found <= before, reason.remedy


def n(low: float, high: float) -> st.SearchStrategy[float]:
    exponents = st.floats(math.log(low), math.log(high))
    return exponents.map(lambda x: float(f"{math.exp(x):.5g}"))


@st.composite
def plans(draw: st.DrawFn) -> dict[str, Any]:
    """Plans of which most are refused: hard and soft balls and tips, weak arms, loud sensors.

    They are not shrunk: every step would try all remedies again.
    """
    data = copy.deepcopy(BASE)
    radius_mm = draw(n(0.5, 100.0))
    shape = draw(st.sampled_from(["sphere", "sphere", "cone_tip", "pyramid_tip", "flat_punch"]))
    put(data, "payload.geometry", {"shape": shape, "radius": f"{radius_mm} mm"})
    modulus_gpa = draw(n(0.002, 200.0))
    put(data, "payload.material.youngs_modulus", f"{modulus_gpa} GPa")
    put(data, "payload.material.yield_strength", f"{modulus_gpa * draw(n(0.003, 0.3))} GPa")
    top_n = draw(n(5.0, 900.0))
    put(data, "procedure.top_force", f"{top_n} N")
    put(data, "procedure.step", f"{top_n / draw(st.sampled_from([2, 5, 6.5]))} N")
    put(data, "rig.arm.max_push", f"{draw(n(100.0, 2000.0))} N")
    put(data, "rig.force.range", f"{draw(n(100.0, 2000.0))} N")
    noise_n = draw(n(0.02, 1.5))
    put(data, "rig.force.noise", f"{noise_n} N")
    put(data, "rig.force.resolution", f"{noise_n * draw(n(0.1, 3.0))} N")
    if draw(st.booleans()):
        put(data, "rig.second_force.tolerance", f"{draw(n(0.3, 12.0))} N")
    else:
        data["rig"]["second_force"] = {
            "source": "none", "tolerance": "0 N", "tolerance_relative": "0 %", "noise": "0 N",
        }  # fmt: skip
    value = draw(n(4e4, 1e7))
    put(data, "rig.system_stiffness.value", f"{value} N/m")
    put(data, "rig.system_stiffness.sigma", f"{value * 0.01} N/m")
    if draw(st.booleans()):
        put(data, "payload.force_limit", f"{draw(n(5.0, 2000.0))} N")
    return data


@settings(
    max_examples=8, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.filter_too_much],
)  # fmt: skip
@given(plans())
def test_what_is_advised_lifts_what_it_is_told_against_and_refuses_nothing_else(
    tmp_path: Path, data: dict[str, Any]
) -> None:
    try:
        preflight = preflight_of(read(tmp_path, data))
    except (BadInputError, RefusedError):
        assume(False)
    assume(preflight.verdict == "refused")
    refused = [reason for reason in preflight.reasons if reason.severity is Severity.REFUSE]
    assert all(reason.remedy for reason in refused)
    if any(reason.remedy == NONE_HELPS for reason in refused):
        return
    (remedy,) = {reason.remedy for reason in refused}
    data = written(data, remedy)
    assert not codes(derive(read(tmp_path, data)), Severity.REFUSE), refused


def advice(
    directory: Path, **values: object
) -> tuple[dict[str, Any], Preflight, dict[str, Reason]]:
    data = copy.deepcopy(BASE)
    for path, value in values.items():
        put(data, path.replace("__", "."), value)
    preflight = preflight_of(read(directory, data))
    return data, preflight, {reason.code: reason for reason in preflight.reasons}


@pytest.mark.parametrize(
    ("values", "code", "words"),
    [
        ({"rig__arm__max_push": "200 N"}, "arm_too_weak", "top_force: 1"),
        ({"rig__force__range": "250 N"}, "sensor_range", "top_force: 2"),
        ({"payload__geometry__radius": "60 mm"}, "close_to_k_max", "gauge"),
        (
            {
                "payload__material__youngs_modulus": "30 MPa",
                "payload__material__yield_strength": "9 MPa",
                "payload__geometry__radius": "12 mm",
            },
            "deep_contact",
            "top_force:",
        ),
        ({"payload__height": "12 mm"}, "thin_payload", "top_force: 2"),
        ({"procedure__search_distance": "2 mm"}, "search_short", "search_distance:"),
    ],
)
def test_each_remedy_helps_where_it_is_told(
    tmp_path: Path, values: dict[str, object], code: str, words: str
) -> None:
    data, preflight, reasons = advice(tmp_path, **values)
    assert words in reasons[code].remedy
    check(tmp_path, data, preflight, reasons[code])


def test_where_no_change_helps_that_is_said(tmp_path: Path) -> None:
    _, _, reasons = advice(
        tmp_path, payload__force_limit="6 N", payload__geometry__shape="flat_punch",
        procedure__top_force="900 N",
    )  # fmt: skip
    assert reasons["top_force_above_safe_limit"].remedy == NONE_HELPS


def test_nothing_is_tried_during_a_run_and_for_a_plan_that_goes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    refused = load_plan(PROCEDURES / "aluminium-sphere.yaml")
    assert (
        preflight_of(refused, Measured(0.5, 0.1)).reasons
        == derive(refused, Measured(0.5, 0.1)).reasons
    )
    requested: list[Plan] = []

    def judge(plan: Plan) -> tuple[Reason, ...]:
        requested.append(plan)
        return ()

    sphere = load_plan(PROCEDURES / "plastic-sphere.yaml")
    reasons = derive(sphere).reasons
    assert advised(sphere, reasons, judge) == reasons
    assert not requested
    slow = replace(sphere, procedure=replace(sphere.procedure, search_distance_m=0.002))
    advised(slow, derive(slow).reasons, judge)
    assert 0 < len(requested) < 50


def test_no_advice_names_a_force_above_what_counts_of_f_c() -> None:
    plan = load_plan(Path(__file__).parents[3] / "procedures" / "plastic-pyramid.yaml")
    found = preflight_of(plan)
    counted_n = found.theory.counted.lower_n
    advised = [re.search(r"top_force: ([\d.]+ \w+)", reason.remedy) for reason in found.reasons]
    forces = [parse_quantity(match.group(1), "N") for match in advised if match]
    assert all(force <= counted_n for force in forces)
