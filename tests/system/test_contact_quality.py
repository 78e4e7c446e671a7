"""A whole dry run on a rig with six axes: how its contact was made, wherever a result is read."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from real_runs import CYCLES, in_process

import stepload
from stepload.identification.contact_quality import ContactQuality
from stepload.results.run_results import results_schema

PLAN = CYCLES.replace(
    "profile: stvf",
    "profile: stvf\n  simulation: {law: smooth, mount: {friction: 0.02, coupling_x: 40 %,"
    " eccentricity_y: 3 mm}}",
).replace("  force:\n", '  force:\n    lever: 120 mm\n    axis: "-fz"\n')


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("contact")
    (place / "plan.yaml").write_text(PLAN)
    in_process("run", "plan.yaml", "--dry-run", "--seed", 1, "--out", "made", cwd=place)
    return place / "made"


def test_the_results_hold_it_as_the_schema_says(directory: Path) -> None:
    told = json.loads((directory / "results.json").read_text())
    schema = results_schema()
    jsonschema.validate(told, schema)
    contact = told["contact"]
    assert contact["missing"] == ""
    assert np.hypot(*contact["branches"][0]["share"]) == pytest.approx(0.02, abs=0.01)
    assert contact["place"]["beside_m"] == pytest.approx([0.0, 3e-3], abs=5e-4)


def test_python_has_the_six_components_and_the_object(directory: Path) -> None:
    run = stepload.open(directory)
    wrench, curve = run.wrench, run.curve
    assert wrench.rows == curve.rows
    sign = -1.0 if run.plan.rig.force.axis[0] == "-" else 1.0
    along = f"force_{run.plan.rig.force.axis[2]}_n"
    assert np.allclose(sign * wrench[along], curve["force_n"])
    for name in ("force_x_n", "force_y_n", "force_z_n", "torque_x_n_m", "torque_y_n_m"):
        assert np.isfinite(wrench[name]).all()
        free = np.abs(wrench[name][curve["phase"] == 1])
        assert float(np.median(free)) < 1.0
    assert isinstance(run.contact, ContactQuality)
    assert run.contact.branches[0].size == pytest.approx(0.02, abs=0.01)
