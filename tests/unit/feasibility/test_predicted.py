"""Payloads of finite size and profiles in a plan; `predict`, its cache, and what preflight uses."""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepload.cli.main import app
from stepload.contact.materials import Body, Profile, RoundedCone, RoundedPyramid
from stepload.errors import BadInputError
from stepload.feasibility.predicted import MESHED, cache_directory, predict
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.reason import PlanVerdict
from stepload.feasibility.theory import theory_of
from stepload.plan.load import load_payload, load_plan
from stepload.plan.problems import PlanError
from stepload.report.tip_factors import tip_factors

CONE = "{shape: rounded_cone, radius: 20 mm, half_angle: 36 deg, base_radius: 30 mm}"
PYRAMID = """{shape: rounded_pyramid, radius: 20 mm ± 1 %, half_angle: 30 deg,
  base_half_width: 30 mm, body: {height: 80 mm, radius: 40 mm}}"""
SUM = """{shape: profile, exponents: [2, 4], gaps: [1 mm, 1 um], at_radius: 7.6 mm,
  body: {height: 30 mm, radius: 20 mm}}"""
TABLE = "{shape: profile, table: table.csv}"
REST = """
name: part
material: {name: acetal, youngs_modulus: 2.75 GPa, poisson_ratio: 0.3, yield_strength: 70 MPa}
plate: {name: alu, youngs_modulus: 70 GPa, poisson_ratio: 0.33, yield_strength: 276 MPa}
"""
PLAN = """
stepload: 1
payload: part.yaml
rig: stvf
procedure: {step: 50 N, top_force: 200 N, hold: 1 s, surface_distance: 5 mm}
"""


def main(arguments: list[str]) -> int:
    """The exit code of a command in this process; its error is raised."""
    return int(app(arguments, standalone_mode=False, obj=ExitStack()) or 0)


@pytest.fixture(autouse=True)
def _cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def verdict_on(plan: Path) -> tuple[PlanVerdict, bool]:
    """The verdict of a plan, and whether its body is too narrow for a half-space."""
    found = preflight_of(load_plan(plan))
    return found.verdict, "narrow_body" in {reason.code for reason in found.reasons}


def part(tmp_path: Path, geometry: str, more: str = "") -> Path:
    """A payload file, a table and a plan beside it."""
    radii = np.linspace(0.0, 8.0, 41)
    rows = [f"{r * r / 57.4 * 1e3:.4f},{r:.3f}" for r in radii]
    (tmp_path / "table.csv").write_text("\n".join(["z [um], r [mm]", *rows]))
    (tmp_path / "plan.yaml").write_text(PLAN)
    path = tmp_path / "part.yaml"
    path.write_text(f"geometry: {geometry}{REST}{more}")
    return path


def test_shapes_are_what_is_written(tmp_path: Path) -> None:
    assert load_payload(part(tmp_path, CONE)).geometry == RoundedCone(
        0.02, np.deg2rad(36.0), 0.03
    )  # fmt: skip
    pyramid = load_payload(part(tmp_path, PYRAMID)).geometry
    assert isinstance(pyramid, RoundedPyramid)
    assert (pyramid.radius_sigma_m, pyramid.body) == (2e-4, Body(0.08, 0.04))
    total = load_payload(part(tmp_path, SUM)).geometry
    assert isinstance(total, Profile)
    assert total.coefficients == pytest.approx((1e-3 / 7.6e-3**2, 1e-6 / 7.6e-3**4))
    inline = '{shape: profile, table: [["0 mm", "0 mm"], ["1 mm", "10 um"], ["2 mm", "40 um"]]}'
    points = load_payload(part(tmp_path, inline, "force_limit: 9 N")).geometry
    assert isinstance(points, Profile)
    assert points.table_m == ((0.0, 0.0), (1e-3, 1e-5), (2e-3, 4e-5))


@pytest.mark.parametrize(
    ("geometry", "more", "line", "told"),
    [
        (CONE.replace("30 mm", "10 mm"), "", 1, "base"),
        (PYRAMID.replace("radius: 40 mm", "radius: 20 mm"), "", 2, "narrower"),
        ("{shape: profile}", "", 1, "table or a sum"),
        (SUM.replace("[2, 4]", "[4, 2]"), "", 1, "rise"),
        (SUM.replace("[2, 4]", "[2]"), "", 1, "2 gaps of 1"),
        (SUM.replace("[2, 4]", "[3, 4]"), "", 1, "force_limit"),
        (TABLE, "", 1, "force_limit"),
        (TABLE, "force_limit: 100 kN", 1, "leaves the profile"),
        ("{shape: profile, table: none.csv}", "", 1, "no such file"),
        ('{shape: profile, table: [["0 mm"]]}', "", 1, "not a point"),
        ('{shape: profile, table: [["0 mm", "0 mm"], ["1 mm", "1 mm"], ["2 mm", "1 mm"]]}',
         "force_limit: 9 N", 1, "not convex"),
    ],
)  # fmt: skip
def test_a_bad_shape_is_named_at_its_place(
    tmp_path: Path, geometry: str, more: str, line: int, told: str
) -> None:
    with pytest.raises(PlanError) as caught:
        load_payload(part(tmp_path, geometry, more))
    first = caught.value.problems[0]
    assert (first.line, told in first.message) == (line, True)


@pytest.mark.parametrize(
    ("text", "line"),
    [("a,b\n0,0\n", 1), ("", 1), ("r [mm],z [mm]\n0,0\n1\n", 3), ("r [mm],z [s]\n0,0\n1,1\n", 2),
     ("r [mm],z [mm]\n0,0\n1,x\n2,2\n", 3)],
)  # fmt: skip
def test_a_bad_table_is_named_in_its_file(tmp_path: Path, text: str, line: int) -> None:
    path = part(tmp_path, TABLE, "force_limit: 400 N")
    (tmp_path / "table.csv").write_text(text)
    with pytest.raises(PlanError) as caught:
        load_payload(path)
    first = caught.value.problems[0]
    assert (Path(first.file).name, first.line) == ("table.csv", line)


@pytest.mark.parametrize(
    ("geometry", "more"), [(CONE, ""), (PYRAMID, ""), (SUM, ""), (TABLE, "force_limit: 400 N")]
)
def test_a_plan_with_each_shape_is_rehearsed(tmp_path: Path, geometry: str, more: str) -> None:
    part(tmp_path, geometry, more)
    plan = load_plan(tmp_path / "plan.yaml")
    assert ("table.csv" in [Path(s.name).name for s in plan.sources]) is (geometry == TABLE)
    assert preflight_of(plan).limits is not None
    assert main(["preflight", str(tmp_path / "plan.yaml")]) in (0, 3)
    assert not cache_directory().exists()


def test_preflight_uses_the_curve_that_is_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    payload = load_payload(part(tmp_path, CONE))
    before = theory_of(payload, 200.0)
    csv, plot = tmp_path / "curve.csv", tmp_path / "curve.svg"
    asked = ["predict", str(tmp_path / "plan.yaml"), "--json"]
    assert main([*asked, "--csv", str(csv), "--plot", str(plot)]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["theory"] == MESHED
    assert before.law.n == 1.5
    assert told["fit"]["secant_n_per_m"] > 1.01 * before.law.secant(200.0)  # held at its base
    assert told["coarse"]["secant_n_per_m"] == pytest.approx(
        told["smooth"]["secant_n_per_m"], rel=2e-3
    )
    assert told["mesh"]["yield_force_n"] == pytest.approx(told["elastic_limit_n"], rel=0.08)
    columns = np.loadtxt(csv, delimiter=",", skiprows=1)
    assert columns[:, 1] == pytest.approx(told["force_n"])
    assert columns[:, 0] == pytest.approx(told["deformation_m"])
    assert plot.read_text().lstrip().startswith("<?xml")
    after = theory_of(payload, 200.0)
    assert after.law.equation == MESHED
    assert after.counted.lower_n <= before.counted.lower_n  # F_c never rises by a mesh
    assert (after.law.k, after.law.n) == pytest.approx((told["fit"]["k"], told["fit"]["n"]))
    assert theory_of(payload, 190.0).law == theory_of(payload, 190.0).stiffest != after.law
    monkeypatch.setitem(sys.modules, "gmsh", None)  # what is kept needs no mesh
    assert main(asked) == 0
    assert json.loads(capsys.readouterr().out)["mesh"] == told["mesh"]
    with pytest.raises(BadInputError) as caught:
        main([*asked, "--to", "190 N"])
    assert "stepload[fem]" in caught.value.hint
    (kept,) = cache_directory().iterdir()
    data = json.loads(kept.read_text())
    data["deformation_m"] = [10.0 * each for each in data["deformation_m"]]
    empty = json.dumps({key: [] if isinstance(data[key], list) else data[key] for key in data})
    for text in (json.dumps(data), empty, "{}"):  # not believed, not readable
        kept.write_text(text)
        assert theory_of(payload, 200.0).law == before.law


def test_a_body_that_yields_below_the_limit_of_its_tip(tmp_path: Path) -> None:
    narrow = "{shape: profile, exponents: [2], gaps: [69.7 um], at_radius: 2 mm, body: {B}}"
    path = part(tmp_path, narrow.replace("B", "height: 20 mm, radius: 2.5 mm"))
    before = theory_of(load_payload(path), 300.0)
    assert verdict_on(tmp_path / "plan.yaml") == (PlanVerdict.REFUSED, True)
    found = predict(load_payload(path), 700.0).mesh
    assert found is not None
    assert found.yield_force_n == pytest.approx(447.0, rel=0.02)
    assert verdict_on(tmp_path / "plan.yaml")[1] is False
    for top_n in (300.0, 700.0, None):  # whatever the force that the mesh was made for
        after = theory_of(load_payload(path), top_n)
        assert (after.elastic_limit_n, after.limit_equation) == (found.yield_force_n, MESHED)
        assert after.counted.sigma_ln == pytest.approx(before.counted.sigma_ln)
    declared = replace(load_payload(path), declared_force_limit_n=99.0)
    assert theory_of(declared).elastic_limit_n == 99.0
    (kept,) = cache_directory().iterdir()
    kept.rename(kept.with_name(kept.name.replace("-700", "-600")))  # not of these forces
    assert theory_of(load_payload(path)).elastic_limit_n == before.elastic_limit_n


def test_no_mesh_and_factors(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bare = load_payload(part(tmp_path, CONE))
    rough = load_payload(part(tmp_path, CONE, "roughness: 7.5 um\nmicro_hardness: 0.7 GPa"))
    smooth = predict(bare, 300.0, mesh=False)
    assert smooth.mesh is None
    assert smooth.fit.n == pytest.approx(1.5, abs=1e-2)
    factors = tip_factors(rough, rough=True, plastic=False)
    curve = predict(rough, 300.0, factors=factors, mesh=False)
    assert curve.fit.n > smooth.fit.n + 0.03
    factors = tip_factors(bare, rough=False, plastic=True)
    assert predict(bare, 3000.0, factors=factors, mesh=False).fit.n < smooth.fit.n - 0.03
    asked = ["predict", str(tmp_path / "part.yaml"), "--no-mesh", "--rough"]
    table = tmp_path / "rough.csv"
    assert main([*asked, "--csv", str(table)]) == 0
    with pytest.raises(BadInputError, match=r"already.*\(10\)"):  # never twice
        main(["identify", str(table), "--payload", str(tmp_path / "part.yaml"), "--rough"])
    with pytest.raises(BadInputError, match="--plot"):
        main(["predict", str(tmp_path / "part.yaml"), "--plot", str(tmp_path / "curve.jpg")])
    part(tmp_path, CONE)
    with pytest.raises(BadInputError, match="highest force"):
        main(["predict", str(tmp_path / "part.yaml"), "--to", "0 N"])
    with pytest.raises(BadInputError, match="roughness"):
        main(asked)
    asked += ["--to", "300 N", "--json", "--surface", "7.5 um, 0.7 GPa"]
    capsys.readouterr()
    assert main(asked) == 0
    assert json.loads(capsys.readouterr().out)["fit"]["n"] == pytest.approx(curve.fit.n)
    assert main([*asked, "--tip-radius", "40 mm"]) == 0
    assert json.loads(capsys.readouterr().out)["fit"]["n"] > curve.fit.n + 0.01
    part(tmp_path, TABLE, "force_limit: 400 N")
    with pytest.raises(BadInputError, match="no tip radius"):
        main(["predict", str(tmp_path / "part.yaml"), "--plastic"])


def test_the_screen_is_80_columns_wide(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = part(tmp_path, CONE, "roughness: 7.5 um")
    assert main(["predict", str(path), "--rough", "--to", "200 N"]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 80
