"""An arm that friction stiffens, from two calibration runs to a payload, all in dry runs.

The simulated tip gives way along the axis by `lateral_coupling` times the force across it, over
K_s. A block that is pressed with a force across of 25 % and of 5 % stands for dry and greased.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from real_runs import CYCLES, in_process

COUPLING = 0.4
FLAT = CYCLES.replace("plastic-sphere", "stiff-flat") + "identify: {kind: system}\n"


def as_arm(text: str, share: str, more: str = "") -> str:
    """The plan on an arm that gives way sideways, with a lateral force."""
    simulated = f"{{law: smooth, lateral: {share}, lateral_coupling: 40 %}}"
    rig = f"profile: stvf\n  simulation: {simulated}{more}"
    return text.replace("profile: stvf", rig).replace("  arm:\n", "  arm:\n    structure: arm\n")


def done(*arguments: object) -> Any:
    """What a verb says with --json."""
    ran = in_process(*arguments, "--json")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    return json.loads(ran.stdout)


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("friction")
    for number, share in enumerate(("25 %", "5 %")):
        plan = place / f"flat-{number}.yaml"
        plan.write_text(as_arm(FLAT, share))
        done("run", plan, "--dry-run", "--out", place / f"run-{number}", "--seed", number)
    made = place / "arm.json"
    done("calibrate", "--from", place / "run-0", place / "run-1", "--record", made)
    return made


def pressed(place: Path, record: str, share: str = "15 %") -> Any:
    """The result of a payload with this share across."""
    plan = place / "payload.yaml"
    plan.write_text(as_arm(CYCLES, share, f"\n  system_stiffness: {{{record}}}"))
    return done("run", plan, "--dry-run", "--out", place / "run", "--seed", 7)


def fired(result: Any) -> set[str]:
    return {gate["name"] for gate in result["gates"] if gate["fires"]}


@pytest.mark.long
def test_dry_and_greased_tell_what_the_force_across_does(record: Path) -> None:
    made = json.loads(record.read_text())
    c = [float(text.removesuffix(" m/N")) for text in made["across"]]
    k_s = float(made["stiffness"].removesuffix(" N/m"))
    assert max(abs(each) for each in c) * k_s == pytest.approx(COUPLING, rel=0.15)
    assert sum(abs(each) for each in made["at_share"]) == pytest.approx(0.15, abs=0.01)
    assert made["share_reach"] == pytest.approx(0.1, abs=0.01)
    assert "nothing is claimed" in made["across_told"]


@pytest.mark.long
def test_payloads_of_other_frictions_come_out_alike(record: Path, tmp_path: Path) -> None:
    values = {}
    for share in ("20 %", "5 %"):
        place = tmp_path / share[:2].strip()
        place.mkdir()
        result = pressed(place, f"record: {record}", share)
        assert not fired(result) & {"lateral", "lateral_correction", "friction"}
        [line] = [x for x in result["headline"]["lines"] if x["source"] == "lateral force"]
        assert "taken out" in line["size"]
        values[share] = result["headline"]["value_n_per_m"]
    assert values["20 %"] == pytest.approx(values["5 %"], rel=0.03)


@pytest.mark.long
def test_one_number_holds_near_its_own_friction_only(record: Path, tmp_path: Path) -> None:
    one = json.loads(record.read_text()) | {"across": [], "across_sigma": []}
    (tmp_path / "one.json").write_text(json.dumps(one))
    for share, wrong in (("2 %", True), ("15 %", False)):
        place = tmp_path / share[:2].strip()
        place.mkdir()
        result = pressed(place, f"record: {tmp_path / 'one.json'}", share)
        assert ("lateral" in fired(result)) is wrong
