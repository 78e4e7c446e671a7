"""What the preflight refuses before ur_rtde is touched."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest
from ur_fakes import HOME

from stepload.errors import DeviceError
from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import preflight as preflight_module
from stepload_drivers.ur.preflight import preflight
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PLAYING, ROBOT_RUNNING, UrState

HERE = Path(__file__).parents[3]
SOUND = UrState(1.0, HOME, (0.0,) * 6, ROBOT_RUNNING, 1, PLAYING, 1)


class Controller:
    def __init__(self) -> None:
        self.version = (5, 12, 6, 0)
        self.taken: list[str] = []
        self.state = SOUND
        self.replies = {
            "get serial number": "2024001",
            "get robot model": "UR5",
            "is in remote control": "true",
        }
        self.silent = False
        self.told = ArmConfiguration(speed_fraction=1.0)


@pytest.fixture
def controller(monkeypatch) -> Controller:
    controller = Controller()

    class Rtde:
        def __init__(self, host, deadline_s) -> None:
            pass

        def close(self) -> None:
            pass

        def version(self):
            return controller.version

        def taken_inputs(self, names):
            assert len(names) == 26
            return controller.taken

        def start(self, rate_hz) -> None:
            pass

        def read(self):
            return controller.state

    def dashboard(host, commands, deadline_s):
        if controller.silent:
            raise DeviceError("silent", code=FaultCode.NOT_CONNECTED)
        return [controller.replies[command] for command in commands]

    monkeypatch.setattr(preflight_module, "find_spec", lambda name: True)
    monkeypatch.setattr(preflight_module, "RtdeClient", Rtde)
    monkeypatch.setattr(preflight_module, "dashboard", dashboard)
    monkeypatch.setattr(
        preflight_module, "read_configuration", lambda host, deadline_s: controller.told
    )
    return controller


def look(**options):
    return preflight(Settings(host="10.0.0.2", **options), 1e12)


def test_where_ur_rtde_is_missing_the_versions_that_have_wheels_are_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "rtde_control", None)
    with pytest.raises(DeviceError) as caught:
        look()
    assert caught.value.code == FaultCode.UNSUPPORTED
    project = tomllib.loads((HERE / "pyproject.toml").read_text())["project"]
    [line] = [each for each in project["dependencies"] if each.startswith("ur-rtde")]
    first_without = re.search(r"python_version < '3\.(\d+)'", line)
    named = re.findall(r"3\.(\d+)(?= |,|;)", caught.value.hint)
    assert named == [str(minor) for minor in range(11, int(first_without[1]))]


@pytest.mark.parametrize("fraction", [0.0, 0.5, 0.99])
def test_a_speed_slider_below_100_percent_is_refused(controller, fraction):
    controller.told = ArmConfiguration(speed_fraction=fraction)
    with pytest.raises(DeviceError, match=f"speed slider is at {100 * fraction:.0f} %") as caught:
        look()
    assert caught.value.code == FaultCode.UNSUPPORTED
    assert "Run screen" in caught.value.hint


@pytest.mark.parametrize("reply", ["false", "", "could not understand: 'is in remote control'"])
def test_local_control_is_refused(controller, reply):
    controller.replies["is in remote control"] = reply
    with pytest.raises(DeviceError) as caught:
        look()
    assert caught.value.code == FaultCode.NOT_REMOTE


@pytest.mark.parametrize("reply", ["2024002", "could not understand: 'get serial number'"])
def test_another_controller_is_refused(controller, reply):
    controller.replies["get serial number"] = reply
    with pytest.raises(DeviceError) as caught:
        look(serial_number="2024001")
    assert caught.value.code == FaultCode.WRONG_DEVICE
