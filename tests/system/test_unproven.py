"""A run on devices whose force nothing proves is refused; a dry run of the same plan is not."""

from __future__ import annotations

from datetime import date, timedelta
from pathlib import Path

import pytest
from real_runs import in_process

PROCEDURES = Path(__file__).parents[2] / "procedures"


def plan_with(directory: Path, proof: str) -> Path:
    text = (PROCEDURES / "ur5e-silicone-sphere.yaml").read_text()
    text = text.replace("payload: payloads/", f"payload: {PROCEDURES}/payloads/")
    text = text.replace("host: 192.168.1.10", "host: 127.0.99.1")
    path = directory / "plan.yaml"
    path.write_text(text.replace("      port: /dev/ttyUSB0\n", f"      port: /nowhere\n{proof}"))
    return path


@pytest.mark.parametrize("days", [None, 31])
def test_an_unproven_rig_is_refused(days: int | None, tmp_path: Path) -> None:
    pushed_on = date.today() - timedelta(days=days or 0)
    proof = f"    pushed_on: {pushed_on}\n" if days else ""
    plan = plan_with(tmp_path, proof)
    said = in_process("run", plan, "--yes", "--out", tmp_path / "run")
    assert said.returncode == 3
    assert "axis and sign of the force are not proven: rig.force" in said.stderr
    assert ("31 days old" if days else "no push by hand") in said.stderr
    assert "rig.force.tool_mass" in said.stderr
    assert said.stdout == ""
    assert said.stderr.startswith("error: axis and sign of the force are not proven")
    assert not (tmp_path / "run").exists()
    told = in_process("preflight", plan)
    assert told.returncode == 0
    assert "without --dry-run will refuse this plan: rig.force" in told.stdout
    assert told.stdout.splitlines()[0].endswith(", and `run` refuses this plan")


def test_preflight_is_short_and_whole_where_it_is_asked_for(tmp_path: Path) -> None:
    plan = plan_with(tmp_path, "    tool_mass: 1.5 kg\n")
    short, whole = (in_process("preflight", plan, *more).stdout for more in ((), ("--verbose",)))
    assert "refuses" not in short.splitlines()[0]
    assert "behind the start pose free" in short  # what a person must see to
    assert "drive_runaway" in short.split("notes, in full with --verbose: ")[1]
    for told in ("a drive that runs away", "Schedule: about", "force_limit_n"):
        assert told not in short
        assert told in whole
    assert "Force budget" in short  # it is printed before any motion
    assert in_process("preflight", plan, "--json").stdout == in_process(
        "preflight", plan, "--verbose", "--json"
    ).stdout  # fmt: skip


def test_a_stated_mass_is_proof_enough_to_begin(tmp_path: Path) -> None:
    """What stops the run then is that there is no such arm."""
    plan = plan_with(tmp_path, "    tool_mass: 1.5 kg\n")
    told = in_process("preflight", plan, "--verbose")
    assert "will refuse" not in told.stdout
    assert "prove the force channels" in told.stdout
    said = in_process("run", plan.name, "--yes", "--json", cwd=tmp_path)
    assert said.returncode == 4
    assert "not proven" not in said.stderr
