"""`stepload emulate ur` and the fault commands, without serving anything."""

from __future__ import annotations

import pytest
import typer
from typer.testing import CliRunner

from stepload.errors import BadInputError
from stepload_verify.emulators.ur_axis import FreeAirAxis
from stepload_verify.emulators.ur_command import register
from stepload_verify.emulators.ur_controller import UrController
from stepload_verify.emulators.ur_emulator import parse_version, run_ur_emulator
from stepload_verify.emulators.ur_faults import HELP, SWITCHES, Faults
from stepload_verify.emulators.ur_robot import Robot


@pytest.fixture
def app():
    app = typer.Typer()
    app.callback()(lambda: None)
    register(app)
    return app


def test_help_names_every_fault(app):
    result = CliRunner().invoke(app, ["ur", "--help"], terminal_width=120)
    assert result.exit_code == 0
    for line in HELP.splitlines():
        assert line.split()[0] in result.output


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--host", "192.168.0.4"], "127.0.0.0/8"),
        (["--version", "five"], "five"),
        (["--version", "5.1.2.3.4"], "5.12"),
    ],
)
def test_bad_arguments(app, arguments, says):
    result = CliRunner().invoke(app, ["ur", *arguments])
    assert isinstance(result.exception, BadInputError)
    assert says in str(result.exception)


def test_only_loopback_is_served():
    with pytest.raises(ValueError, match="127"):
        run_ur_emulator("0.0.0.0")


def test_versions():
    assert parse_version("5.12") == (5, 12, 0, 0)
    assert parse_version("3.15.8.106339") == (3, 15, 8, 106339)


@pytest.mark.parametrize("name", SWITCHES)
def test_every_switch_goes_on_and_off(name):
    faults = Faults()
    assert faults.switch([name, "on"])
    assert faults != Faults()
    assert faults.switch([name, "off"])
    assert faults == Faults()
    with pytest.raises(ValueError, match="on or off"):
        faults.switch([name, "maybe"])


def test_unknown_commands_are_refused():
    controller = UrController(Robot(FreeAirAxis(), (0.0, 0.0, -1.0), 0.002))
    with pytest.raises(ValueError, match="explode"):
        controller.command("explode")
