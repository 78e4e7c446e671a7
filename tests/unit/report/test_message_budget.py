"""The message budget: a preflight is one screen, a finding one sentence, a good plan half a screen.

Plans of the package, and those of other rigs and payloads, some of them with several faults.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from stepload.cli.preflight import show_preflight, show_verdict
from stepload.feasibility.hazards import hazards_of
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.feasibility.reason import PlanVerdict, Severity, findings
from stepload.plan.load import load_plan
from stepload.report.preflight import figure_lines, finding_lines, headline
from stepload.report.preflight_results import preflight_data
from stepload.report.terminal import Output

ROOT = Path(__file__).resolve().parents[3]
SHIPPED = sorted(
    path
    for path in (ROOT / "procedures").glob("*.yaml")
    if "procedure:" in path.read_text() and path.stem not in ("campaign", "falsify")
)
ACETAL = "{name: acetal, youngs_modulus: 2.75 GPa, poisson_ratio: 0.38, yield_strength: 70 MPa}"
STEEL = "{name: steel, youngs_modulus: 210 GPa, poisson_ratio: 0.3, yield_strength: 800 MPa}"
RUBBER = "{name: rubber, youngs_modulus: 6 MPa, poisson_ratio: 0.495}"
BALL = "{shape: sphere, radius: 28.7 mm}"


@dataclass(frozen=True)
class Case:
    """A plan: its rig, body, limit (one line or none), and the lines of its procedure."""

    name: str
    rig: str
    material: str
    limit: str
    procedure: str
    geometry: str = BALL
    more: str = ""

    def write(self, folder: Path) -> Path:
        """The plan as a file."""
        path = folder / "plan.yaml"
        limit = f"  force_limit: {self.limit}\n" if self.limit else ""
        path.write_text(
            f"stepload: 1\npayload:\n  name: {self.name}\n  geometry: {self.geometry}\n"
            f"  material: {self.material}\n  plate: {STEEL}\n{limit}rig: {self.rig}\n"
            "procedure:\n  surface_distance: 3 mm\n  surface_uncertainty: 0.5 mm\n"
            f"{self.procedure}{self.more}"
        )
        return path


def levels(top: str, step: str, more: str = "") -> str:
    return f"  top_force: {top}\n  step: {step}\n  hold: 3 s\n  cycles: 2\n  unload: true\n{more}"


CASES = (
    Case("acetal ball", "stvf", ACETAL, "", levels("280 N", "40 N")),
    Case("acetal ball far too hard", "stvf", ACETAL, "", levels("900 N", "100 N")),
    Case("acetal ball nearly too hard", "stvf", ACETAL, "", levels("600 N", "100 N")),
    Case("steel ball", "stvf", STEEL, "", levels("30 N", "10 N")),
    Case("steel ball beyond all", "stvf", STEEL, "40 N", levels("2 kN", "500 N")),
    Case("rubber ball", "stvf", RUBBER, "80 N", levels("30 N", "5 N")),
    Case("rubber pressed deep", "stvf", RUBBER, "400 N", levels("200 N", "20 N")),
    Case("one cycle", "stvf", ACETAL, "", 
         levels("280 N", "40 N").replace("cycles: 2", "cycles: 1")),
    Case("interval asked", "stvf", ACETAL, "", levels("280 N", "40 N", "  until: 1 %\n")),
    Case("short search", "stvf", RUBBER, "80 N",
         levels("30 N", "5 N", "  search_distance: 1.1 mm\n")),
    Case("drifting sensor", "{profile: stvf, force: {drift: 200 mN/s}}", ACETAL, "",
         levels("280 N", "40 N")),
    Case("one channel", "{profile: stvf, second_force: {source: none}}", ACETAL, "",
         levels("280 N", "40 N")),
    Case("tilted", "stvf", ACETAL, "", levels("280 N", "40 N", "  alignment: {radius: 1 mm}\n")),
    Case("rubber ball on an arm", "{profile: ur5e, arm: {driver: sim}, force: {driver: sim}}",
         RUBBER, "100 N", levels("50 N", "10 N")),
    Case("tip", "stvf", ACETAL, "", levels("280 N", "40 N"), "{shape: cone_tip, radius: 2 mm}"),
)  # fmt: skip


@pytest.fixture(params=[*SHIPPED, *CASES], ids=lambda each: getattr(each, "stem", "") or each.name)
def planned(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The preflight of each plan, from the directory of its file."""
    path = request.param if isinstance(request.param, Path) else request.param.write(tmp_path)
    monkeypatch.chdir(path.parent)
    return preflight_of(load_plan(Path(path.name)))


def words(text: str) -> int:
    return len(text.split())


def test_what_is_said_fits(planned: Preflight, capsys: pytest.CaptureFixture[str]) -> None:
    show_preflight(planned, Output(as_json=False))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert len(lines) <= 24
    found = finding_lines(planned)
    assert words(" ".join((headline(planned), *found))) <= 120
    assert len(figure_lines(planned)) <= 12
    assert sum(line.startswith("  ") and line[2:3].isdigit() for line in found) <= 3
    if planned.verdict is PlanVerdict.GO:
        assert not found
        assert len(lines) <= 12
    else:
        assert found
    assert len(lines) == len({line for line in lines if line.strip()}) + lines.count("")
    for reason in findings(planned.reasons):
        assert words(reason.message) <= 25, reason
        assert words(reason.remedy) <= 20, reason
    of_rig = {each.code for each in hazards_of(planned.plan.rig)}
    assert of_rig
    assert not of_rig & {reason.code for reason in planned.reasons}
    refused = planned.verdict is PlanVerdict.REFUSED
    told = findings(planned.reasons)
    assert {each.severity for each in told} <= {Severity.REFUSE if refused else Severity.WARN}
    costs = [each.cost for each in told]
    assert refused or costs == sorted(costs, reverse=True)
    assert preflight_data(planned)["verdict"] == planned.verdict


def test_a_refusal_names_the_key_to_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = CASES[1].write(tmp_path)
    monkeypatch.chdir(tmp_path)
    show_verdict(preflight_of(load_plan(Path("plan.yaml"))), Output(as_json=False))
    line = 1 + path.read_text().splitlines().index("  top_force: 900 N")
    assert f"plan.yaml:{line}:14" in capsys.readouterr().out
