"""From the command line: K_s by its three ways, its record in a plan, runs side by side."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from real_runs import ROOT, in_process

from stepload.plan.calibration import read_calibration
from stepload.report.run_record import saved_run

KS = 3.49e6
PAYLOADS = ROOT / "procedures" / "payloads"
SMOOTH = "simulation: {law: smooth}"
QUICK = """
procedure:
  step: 75 N
  top_force: 300 N
  hold: 0.3 s
  touches: 1
  cycles: {cycles}
  unload: {unload}
  surface_distance: 1 mm
  surface_uncertainty: 0.1 mm
  tare: 0.3 s
  warm_up: 0 s
  settle_timeout: 0.3 s
identify: {{kind: {kind}, temperature: 22 degC}}
"""


class Ran(NamedTuple):
    """One command: exit code, its JSON object, what it printed for people."""

    code: int
    data: dict[str, Any]
    text: str


def command(*arguments: object, drawn: bool | tuple[str, ...] = ()) -> Ran:
    done = in_process(*arguments, "--json", drawn=drawn)
    return Ran(done.returncode, json.loads(done.stdout or "{}"), done.stderr)


def plan_file(directory: Path, name: str, payload: object, rig: str, **how: object) -> Path:
    path = directory / f"{name}.yaml"
    settings = {"kind": "payload", "cycles": 1, **how}
    procedure = QUICK.format(**settings, unload=str(settings["cycles"] != 1).lower())
    text = f"stepload: 1\npayload: {payload}\nrig: {rig}\n{procedure}"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("lab")


@pytest.fixture(scope="module")
def system_runs(lab: Path) -> list[tuple[Path, Ran]]:
    """Two calibrations against the flat pad, with errors of their own."""
    plan = plan_file(lab, "flat", PAYLOADS / "stiff-flat.yaml", "stvf", kind="system")
    made = []
    for seed in (1, 2):
        directory = lab / f"flat-{seed}"
        ran = command(
            "calibrate", plan, "--dry-run", "--quiet", "--seed", seed, "--out", directory,
            "--record", lab / f"flat-{seed}.json", "--valid-days", 30,
            drawn=("misfit",) if seed == 1 else (),
        )  # fmt: skip
        assert ran.code == 0, ran.text
        made.append((directory, ran))
    return made


@pytest.fixture(scope="module")
def payload_runs(quick_run: Path, cycles_run: Path) -> list[Path]:
    """The plastic sphere pressed in one cycle and in two."""
    return [quick_run, cycles_run]


def test_calibrate_writes_a_record_of_the_run(
    lab: Path, system_runs: list[tuple[Path, Ran]]
) -> None:
    directory, ran = system_runs[0]
    record = read_calibration(lab / "flat-1.json")
    assert abs(record.stiffness_n_per_m - KS) < 3.0 * record.sigma_n_per_m
    assert 0.002 * KS < record.sigma_n_per_m < 0.05 * KS
    assert (record.rig, record.direction, record.temperature_c) == ("STVF", "+fz", 22.0)
    assert (record.valid_until - record.measured_on).days == 30
    assert record.smooth_error_m is not None
    assert record.smooth_error_m >= record.msde_m > 0.0
    assert record.smooth_degrees is not None
    assert record.simulated
    results = json.loads((directory / "results.json").read_text())
    assert results["system_stiffness"]["stiffness_n_per_m"] == pytest.approx(
        record.stiffness_n_per_m
    )
    assert ran.data["calibration"]["run"] == record.run == ran.data["runs"][0]["run_id"]
    assert "misfit" in (directory / "report.html").read_text()


def test_several_runs_are_pooled(lab: Path, system_runs: list[tuple[Path, Ran]]) -> None:
    one, other = (directory for directory, _ in system_runs)
    pooled = lab / "pooled.json"
    ran = command("calibrate", "--from", one, other / "run.mcap", "--record", pooled)
    assert ran.code == 0, ran.text
    record = read_calibration(lab / "pooled.json")
    single = [read_calibration(lab / f"flat-{seed}.json") for seed in (1, 2)]
    low, high = sorted(each.stiffness_n_per_m for each in single)
    assert low <= record.stiffness_n_per_m <= high
    assert record.smooth_degrees is not None
    assert record.smooth_degrees > min(each.smooth_degrees or 0.0 for each in single)
    assert ran.data["pooled"]["runs"] == 2
    twice = command("calibrate", "--from", one, one, "--record", lab / "twice.json")
    assert twice.code == 2
    assert "given twice" in twice.data["error"]
    assert not (lab / "twice.json").exists()


def test_a_plan_goes_by_its_record(lab: Path, system_runs: list[tuple[Path, Ran]]) -> None:
    stiffness = "system_stiffness: {record: flat-2.json, policy: refuse}"
    rig = f"{{profile: stvf, {stiffness}, {SMOOTH}}}"
    plan = plan_file(lab, "with-record", PAYLOADS / "plastic-sphere.yaml", rig)
    record = read_calibration(lab / "flat-2.json")
    checked = command("preflight", plan)
    assert checked.code == 0, checked.text
    assert "calibration_simulated" in {reason["code"] for reason in checked.data["reasons"]}
    ran = command("run", plan, "--dry-run", "--quiet", "--seed", 5, "--out", lab / "recorded")
    assert ran.code == 0, ran.text
    lines = {line["source"]: line["size"] for line in ran.data["headline"]["lines"]}
    common = f"{100 * record.deflection_common:.3g} %"
    assert lines["system stiffness K_s"] == f"{common} and a table of its deflection"
    assert "deflection_table" in {reason["code"] for reason in checked.data["reasons"]}
    assert "smooth deformation error" in lines
    low, high = ran.data["interval_secant_n_per_m"]
    assert low < 5.06e6 < high
    made = saved_run(lab / "recorded").metadata["calibration"]
    assert made == f"sha256 {hashlib.sha256((lab / 'flat-2.json').read_bytes()).hexdigest()}"
    for_real = command("run", plan, "--quiet", "--out", lab / "for-real")
    assert for_real.code == 3
    assert "made in a dry run" in for_real.data["error"]
    assert not (lab / "for-real").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"valid_until": "2020-01-02", "measured_on": "2020-01-01"}, "expired on 2020-01-02"),
        ({"pose": "elbow up"}, "measured in pose 'elbow up'"),
        ({"temperature": "35 degC"}, "measured at 35 °C"),
        ({"rig": "another"}, "made for the rig 'another'"),
        (None, "does not exist"),
    ],
)
def test_a_record_that_does_not_fit_is_warned_of_or_refused(
    lab: Path, tmp_path: Path, system_runs: list[tuple[Path, Ran]], change: Any, said: str
) -> None:
    content = json.loads((lab / "flat-1.json").read_text())
    if change is not None:
        (tmp_path / "record.json").write_text(json.dumps(content | change))
    stiffness = "{{record: record.json, policy: {}}}"
    for policy, code in (("warn", 0), ("refuse", 2)):
        rig = (
            "{profile: stvf, arm: {pose: elbow down}, system_stiffness: "
            + stiffness.format(policy)
            + "}"
        )
        plan = plan_file(tmp_path, policy, PAYLOADS / "plastic-sphere.yaml", rig)
        ran = command("preflight", plan)
        assert ran.code == code, ran.text
        assert said in ran.text
        if policy == "warn":
            assert ran.data["verdict"] == "warn"


def test_what_cannot_be_calibrated_from_is_refused(lab: Path, payload_runs: list[Path]) -> None:
    sphere = plan_file(lab, "wrong-kind", PAYLOADS / "plastic-sphere.yaml", "stvf")
    for arguments, said in (
        ((sphere, "--dry-run"), "identify.kind is payload"),
        (("--from", payload_runs[0], "--record", lab / "no.json"), "a payload run"),
        (("--from", payload_runs[0]), "--record is missing"),
        ((), "give one plan"),
    ):
        ran = command("calibrate", *arguments)
        assert ran.code == 2, ran.text
        assert said in ran.data["error"]
    assert not (lab / "no.json").exists()


def test_compare_sets_runs_side_by_side(lab: Path, payload_runs: list[Path]) -> None:
    out = lab / "compared"
    ran = command("compare", *payload_runs, "--out", out, drawn=True)
    assert ran.code == 0, ran.text
    assert ran.data == json.loads((out / "compare.json").read_text())
    assert ran.data["verdict"] == "agree"
    for run in ran.data["runs"]:
        assert set(run["fits"]) >= {"rs_btls", "rs_rtls", "joint"}
        low, high = run["interval_secant_n_per_m"]
        assert low < 5.06e6 < high
    page = (out / "compare.html").read_text()
    assert "<script" not in page
    assert page.count("data:image/svg+xml") == 2


def write_curve(path: Path, modulus_factor: float, top_n: float = 330.0) -> Path:
    force = np.linspace(5.0, top_n, 80)
    deformation = (force / (6.57e8 * modulus_factor)) ** (1 / 1.5)
    np.savetxt(
        path, np.column_stack([deformation, force]), "%.9g", ",",
        header="displacement_m,force_n", comments="",
    )  # fmt: skip
    return path


def test_a_curve_against_steel_is_corrected_for_the_modulus(
    lab: Path, payload_runs: list[Path]
) -> None:
    """Acetal on aluminium and on steel: E_eq differs by 2.4 % (V-A)."""

    def modulus(plate_pa: float, ratio: float) -> float:
        return 1.0 / ((1 - 0.3**2) / 2.75e9 + (1 - ratio**2) / plate_pa)

    aluminium, steel = modulus(70e9, 0.33), modulus(200e9, 0.29)
    assert steel / aluminium == pytest.approx(1.0246, abs=2e-3)
    curve = write_curve(lab / "steel.csv", steel / aluminium)
    run = payload_runs[0]
    plain = command("compare", run, "--curve", curve)
    by_plate = command("compare", run, "--curve", curve, "--curve-plate", "200 GPa, 0.29")
    by_modulus = command("compare", run, "--curve", curve, "--curve-modulus", f"{steel:.9g} Pa")
    assert by_plate.code == 0, by_plate.text
    found = by_plate.data["curve"][0]
    assert by_plate.data["verdict"] == found["verdict"] == "agree"
    assert found["secant_n_per_m"] == pytest.approx(300 ** (1 / 3) * 6.57e8 ** (2 / 3), rel=1e-3)
    for kind in ("chord", "secant"):
        low, high = found[f"{kind}_interval"]
        assert low < found[f"{kind}_change"] < high
        assert low < 0.0 < high
    assert by_modulus.data["curve"][0]["secant_change"] == pytest.approx(
        found["secant_change"], abs=1e-6
    )
    plain_change = plain.data["curve"][0]["secant_change"]
    ratio = (1.0 + plain_change) / (1.0 + found["secant_change"])
    assert ratio == pytest.approx((steel / aluminium) ** (2 / 3), rel=2e-3)
    assert any("without a modulus" in note for note in plain.data["notes"])


def test_runs_machine_theory_and_roughness_stand_in_one_table(
    lab: Path, payload_runs: list[Path]
) -> None:
    """Table II's form: two tests, a machine corrected to aluminium, theory, theory with (10)."""
    sphere, out = PAYLOADS / "plastic-sphere.yaml", lab / "many"
    (lab / "other").mkdir()
    machine = write_curve(lab / "machine.csv", 1.0246)
    again = write_curve(lab / "other" / "machine.csv", 0.9)
    ran = command(
        "compare", *payload_runs, "--curve", f"Instron={machine}", "--curve", f"soft={again}",
        "--curve", f"smooth={sphere}", "--curve", f"rough={sphere}", "--rough", "rough",
        "--surface", "7.5 um, 0.7 GPa", "--curve-plate", "Instron=200 GPa, 0.29",
        "--bounds", "Instron=1 um, 1.31 um", "--out", out, drawn=True,
    )  # fmt: skip
    assert ran.code == 0, ran.text
    rows = {row["name"]: row for row in ran.data["results"]}
    bounds = {row["name"]: row for row in ran.data["bounds"]}
    assert list(rows)[2:] == ["Instron", "soft", "smooth", "rough"]
    assert (rows["smooth"]["k"], rows["smooth"]["n"]) == (
        pytest.approx(6.57e8, rel=2e-3), pytest.approx(1.5, abs=1e-6),
    )  # fmt: skip
    assert (f"{rows['rough']['k']:.2e}", f"{rows['rough']['n']:.2f}") == ("1.82e+10", "1.85")
    assert rows["Instron"]["k"] == pytest.approx(6.57e8, rel=2e-3)
    assert rows["soft"]["k"] == pytest.approx(0.9 * 6.57e8, rel=2e-3)
    first = ran.data["results"][0]["secant_n_per_m"]
    assert rows["soft"]["secant_change"] == pytest.approx(
        rows["soft"]["secant_n_per_m"] / first - 1.0
    )
    low, high = bounds["Instron"]["bounds_n_per_m"]
    assert 300.0 / low - 300.0 / high == pytest.approx(2 * 2.31e-6, rel=1e-6)
    assert bounds["soft"]["bounds_n_per_m"] is None
    assert len(ran.data["curve"]) == 8
    table = (out / "compare.csv").read_text().splitlines()
    assert len(table) == 1 + len(rows)
    for curves, others in (
        ((machine, again), ()),
        ((f"A={machine}", f"A={again}"), ()),
        ((machine,), ("--bounds", "Instron=1 um, 1 um")),
        ((machine,), ("--rough", "machine")),
        ((machine,), ("--rough", "Instron", "--payload", sphere)),
        ((machine,), ("--bounds", "machine=1 um")),
    ):
        stated = [word for each in curves for word in ("--curve", each)]
        assert command("compare", payload_runs[0], *stated, *others).code == 2
    alone = command("compare", "--curve", f"A={machine}", "--curve", f"B={again}")
    assert (alone.code, alone.data["agreement"]) == (0, "cannot tell")


def test_what_cannot_be_compared_is_refused(
    lab: Path, payload_runs: list[Path], system_runs: list[tuple[Path, Ran]]
) -> None:
    for arguments, said in (
        ((payload_runs[0],), "nothing to compare with"),
        ((payload_runs[0], "vs", "vs", payload_runs[1]), "a group of runs is empty"),
        ((*payload_runs, "--tolerance", "0 %"), "tolerance"),
        ((payload_runs[0], system_runs[0][0]), "a system-stiffness run"),
        ((payload_runs[0], payload_runs[1], "--curve-plate", "200 GPa, 0.29"), "no --curve"),
    ):
        ran = command("compare", *arguments)
        assert ran.code == 2, ran.text
        assert said in ran.data["error"] + ran.data["hint"], said
