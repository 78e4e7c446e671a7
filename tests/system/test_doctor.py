"""`stepload doctor` on the simulated rig: a sound one passes, wrong figures are found."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

from stepload.cli.main import app
from stepload.errors import DeviceError
from stepload.units import parse_quantity
from stepload_drivers.sim.arm import WorldArm

PLAN = Path(__file__).parents[2] / "procedures" / "ur5e-silicone-sphere.yaml"


def doctor(*words):
    result = CliRunner().invoke(app, ["doctor", *map(str, words), "--dry-run", "--json"])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, json.loads(result.stdout)


def lines_of(told):
    return {line["name"]: line for line in told["lines"]}


@pytest.fixture
def changed(tmp_path):
    """The plan with keys of its rig replaced: `changed(("force", "noise"), "0.01 N")`."""

    def change(*pairs):
        yaml = YAML(typ="safe")
        plan = yaml.load(PLAN.read_text())
        plan["payload"] = str(PLAN.parent / plan["payload"])
        for path, value in pairs:
            section = plan["rig"]
            for key in path[:-1]:
                section = section.setdefault(key, {})
            section[path[-1]] = value
        file = tmp_path / "plan.yaml"
        with file.open("w") as stream:
            yaml.dump(plan, stream)
        return file

    return change


def test_a_sound_rig_passes_and_offers_its_figures():
    code, told = doctor(PLAN, "--seconds", "3")
    assert code == 0
    assert told["sound"]
    lines = lines_of(told)
    assert lines["arm: stop"]["mark"] == "ok"
    assert lines["arm: watchdog"]["mark"] == "skipped"
    rig = YAML(typ="safe").load(told["rig"])["rig"]
    assert parse_quantity(rig["force"]["noise"], "N") == pytest.approx(0.15, rel=0.1)
    assert parse_quantity(rig["second_force"]["noise"], "N") == pytest.approx(1.0, rel=0.1)
    truth_s = 4e-3 + 40e-3 + 3e-3
    assert truth_s < parse_quantity(rig["loop_delay"], "s") < 1.4 * truth_s


def test_nothing_moves_when_still():
    _, told = doctor(PLAN, "--seconds", "1", "--still")
    lines = lines_of(told)
    assert "arm: stop" not in lines
    assert "arm: response" not in lines


def test_a_drift_beyond_the_plan_is_found(changed):
    plan = changed((("simulation", "force_drift"), "2 N/s"))
    code, told = doctor(plan, "--seconds", "3", "--still")
    line = lines_of(told)["force: drift at rest"]
    assert (code, line["mark"]) == (4, "fail")
    assert line["remedy"]


def test_an_arm_that_does_not_confirm_its_stop_is_not_moved_again(monkeypatch):
    def deaf(self, timeout_s):
        raise DeviceError("no answer", code="refused_command")

    monkeypatch.setattr(WorldArm, "safe", deaf)
    monkeypatch.setattr(WorldArm, "prove_stop", lambda *_: pytest.fail("moved again"))
    code, told = doctor(PLAN, "--seconds", "1")
    lines = lines_of(told)
    assert code == 4
    assert lines["arm: stop"]["mark"] == "fail"
    assert lines["arm: motion"]["mark"] == "skipped"
