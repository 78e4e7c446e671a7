"""`stepload drivers`: the list, and the contract run on any installed driver."""

from __future__ import annotations

import json
import sys
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from types import ModuleType

import pytest
from real_runs import in_process
from typer.testing import CliRunner

from stepload.cli.main import app
from stepload.errors import BadInputError
from stepload.rig import plugins
from stepload_drivers.sim.devices import SimForceSensor

QUICK = ["--seconds", "0.2"]


class Repeater(SimForceSensor):
    """A lab's driver with the commonest mistake: samples are handed out twice."""

    def __init__(self, **options):
        super().__init__(**options)
        self._before = []

    def drain(self):
        fresh = super().drain()
        given, self._before = self._before + fresh, fresh
        return given


@pytest.fixture
def lab_package(monkeypatch):
    """A package of somebody else's, found by entry point."""
    module = ModuleType("some_lab")
    module.Repeater = Repeater
    monkeypatch.setitem(sys.modules, "some_lab", module)
    own = EntryPoint("repeater", "some_lab:Repeater", "stepload.force_sensors")
    broken = EntryPoint("half", "some_lab:Nothing", "stepload.force_sensors")

    def found(group):
        theirs = EntryPoints((own, broken)).select(group=group)
        return EntryPoints((*entry_points(group=group), *theirs))

    monkeypatch.setattr(plugins, "installed", found)


def invoke(*words):
    return CliRunner().invoke(app, ["drivers", *words])


def test_a_sound_driver_passes():
    result = invoke("test", "sim", "--kind", "force_sensors", *QUICK, "--json")
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["kept"]
    verdicts = {check["name"]: check["verdict"] for check in told["checks"]}
    assert verdicts["samples"] == "passed"
    assert verdicts["motion"] == "skipped"
    assert {check["name"]: check["status"] for check in told["checks"]} == verdicts
    assert set(told["checks"][0]) == {"name", "verdict", "status", "message", "seconds"}


def test_an_arm_moves_only_when_asked():
    result = invoke("test", "sim", "--kind", "arms", "--move", "1 mm", *QUICK, "--json")
    verdicts = {check["name"]: check["verdict"] for check in json.loads(result.stdout)["checks"]}
    assert verdicts["motion"] == "passed", result.output


@pytest.mark.usefixtures("lab_package")
def test_a_labs_own_driver_that_breaks_the_contract_is_told_how():
    result = invoke("test", "repeater", *QUICK)
    assert result.exit_code == 4
    assert "repeated or out of order" in " ".join(result.stdout.split())


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["nobody"], "bota_serial"),
        (["sim"], "force_sensors"),
        (["sim", "--kind", "lamps"], "force_sensors"),
        (["bota_serial", "--options", "prt=/dev/x"], "port"),
        (["bota_serial", "--options", "port=/dev/x", "--options", "rate=5 s"], "Hz"),
        (["bota_serial", "--options", "port=/dev/x", "--options", "rate"], "KEY=VALUE"),
        (["bota_serial", "--options", "/nowhere.yaml"], "no such file"),
    ],
)
def test_what_cannot_be_tried_is_refused(words, says):
    result = invoke("test", *words)
    assert isinstance(result.exception, BadInputError)
    assert says in str(result.exception)


@pytest.mark.parametrize("name", ["ur", "line_serial", "gauge_serial", "sim"])
def test_a_driver_shows_its_options(name: str) -> None:
    shown = in_process("drivers", name)
    assert shown.returncode == 0, shown.stderr
    assert f"driver: {name}" in shown.stdout
    told = json.loads(in_process("drivers", "show", name, "--json").stdout)
    assert told["name"] == name
    for options in told["options"].values():
        for key, option in options.items():
            assert key in shown.stdout
            assert option["help"]
    assert in_process("drivers", name + "x").returncode == 2
