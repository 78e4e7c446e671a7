"""The temperature line of the budget, from the keys of a plan to the results of a run."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from real_runs import QUICK, in_process, results

PAYLOAD = """
payload:
  name: ball
  geometry: {shape: sphere, radius: 28.7 mm}
  material: {name: acetal, youngs_modulus: 2.75 GPa, poisson_ratio: 0.3, yield_strength: 70 MPa}
  plate: {name: aluminium, youngs_modulus: 70 GPa, poisson_ratio: 0.33}
  height: 57.4 mm
  thermal_expansion: 110e-6 1/K
  modulus_change: 0.4 %/K
"""
RIG = """\
  profile: stvf
  load_path: 0.6 m
  thermal_expansion: 11.7e-6 1/K"""


def _temperature(found: dict[str, Any]) -> dict[str, Any]:
    (line,) = (line for line in found["headline"]["lines"] if line["source"] == "temperature")
    return dict(line)


def test_a_plan_says_how_well_the_temperature_is_known(tmp_path: Path) -> None:
    named = next(line for line in QUICK.splitlines() if line.startswith("payload:"))
    plan = tmp_path / "plan.yaml"
    text = QUICK.replace(named, PAYLOAD).replace("  profile: stvf", RIG)
    plan.write_text(text + "identify: {temperature_uncertainty: 0.5 K}\n")
    out = tmp_path / "run"
    done = in_process("run", plan, "--dry-run", "--quiet", "--out", out)
    assert done.returncode == 0, done.stderr
    line = _temperature(results(tmp_path / "run"))
    assert line["size"] == "0.5 K"
    # The travel grows by 6.7 µm where the sphere gives way by 59 µm; the holds show most of it.
    assert 0.005 < line["relative"] < 0.2
    again = in_process("identify", tmp_path / "run" / "run.mcap", "--json")
    assert _temperature(json.loads(again.stdout)) == pytest.approx(line)


def test_otherwise_its_line_is_zero(cycles_run: Path) -> None:
    line = _temperature(results(cycles_run))
    assert (line["size"], line["relative"]) == ("0 K", 0.0)
