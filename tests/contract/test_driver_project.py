"""`stepload drivers new`: what it writes keeps the contract, and what breaks it is seen."""

from __future__ import annotations

import importlib
import subprocess
import sys
import tomllib

import pytest

from stepload.errors import BadInputError, DeviceError
from stepload.rig.contract import CHECKS, CheckStatus, Trial, run_check, trial_of
from stepload.setup.driver_project import KINDS, write_project

BROKEN = [
    ("force", "stale", ("max_age_s=told.max_age_s", "max_age_s=60.0")),
    ("force", "load", ('float(match["value"]) * SI', '-float(match["value"]) * SI')),
    ("force", "load", ("SI = 1.0", "SI = 9.80665")),
    ("arm", "stale", ("data = self._link.read(0.05)", "data = self._link.read(0.05) or OLD")),
    ("arm", "stop", ('self._send(b"S\\n")\n', "return\n")),
    ("arm", "motion", ("MM * float(position_mm)", "-MM * float(position_mm)")),
    ("arm", "targets", ("        require_finite_target(position_m)\n", "")),
]
OLD = 'OLD = b"5.000 N\\n" * 5\n'


def trial(directory, kind, name, edit=None):
    """Driver and emulator of a new project, as its own test tries them."""
    write_project(name, kind, directory / name)
    if edit:
        source = directory / name / name / "driver.py"
        text = source.read_text()
        assert text.count(edit[0]) == 1, edit
        source.write_text(text.replace(*edit) + OLD)
    sys.path.insert(0, str(directory / name))
    try:
        driver, emulator = (
            importlib.import_module(f"{name}.{part}") for part in ("driver", "emulator")
        )
    finally:
        sys.path.remove(str(directory / name))
    device = emulator.Emulator()

    def load():
        device.value += 10.0
        return 10.0

    return device, Trial(
        *trial_of(getattr(driver, name.replace("_", " ").title().replace(" ", "")), device.options),
        silence=lambda: setattr(device, "silent", True),
        restore=lambda: setattr(device, "silent", False),
        load=None if kind == "arm" else load,
        load_axis="" if kind == "arm" else "+fz",
        move_m=2e-3 if kind == "arm" else 0.0,
    )


def checked(directory, kind, name, checks, edit=None):
    device, found = trial(directory, kind, name, edit)
    with device:
        return {
            result.name: result
            for result in (run_check(c, found) for c in CHECKS if c.__name__[6:] in checks)
        }


@pytest.mark.realtime(tolerates_s=0.02)
@pytest.mark.parametrize(
    ("kind", "checks"),
    [
        ("force", {"options", "samples", "load", "stale", "lost_link"}),
        ("arm", {"samples", "targets", "motion", "stop", "stale", "lost_link"}),
    ],
)
def test_what_is_written_keeps_the_contract(tmp_path, kind, checks):
    results = checked(tmp_path, kind, f"sound_{kind}", checks)
    assert {n: r.message for n, r in results.items() if r.status is not CheckStatus.PASSED} == {}
    assert set(results) == checks


@pytest.mark.realtime(tolerates_s=0.02)
@pytest.mark.parametrize(("kind", "check", "edit"), BROKEN)
def test_what_breaks_it_is_seen(tmp_path, kind, check, edit):
    name = f"broken_{BROKEN.index((kind, check, edit))}"
    assert checked(tmp_path, kind, name, {check}, edit)[check].status is CheckStatus.FAILED


def test_a_device_that_never_ends_a_line_takes_no_memory(tmp_path):
    device, found = trial(tmp_path, "arm", "endless_arm")
    with device:
        device.line = lambda: b"1" * 4000
        arm = found.make()
        with pytest.raises(DeviceError):
            arm.open(3.0)
        assert len(arm._rest) <= 1000


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_clean_and_installs_as_a_driver(tmp_path, kind):
    write_project("new_device", kind, tmp_path / "new")
    for verb in (["check"], ["format", "--check"]):
        done = subprocess.run(
            [sys.executable, "-m", "ruff", *verb, "--no-cache", "."], cwd=tmp_path / "new"
        )
        assert done.returncode == 0
    project = tomllib.loads((tmp_path / "new" / "pyproject.toml").read_text())["project"]
    points = project["entry-points"]
    assert points == {KINDS[kind]["group"]: {"new_device": "new_device.driver:NewDevice"}}


@pytest.mark.long
@pytest.mark.parametrize("kind", KINDS)
def test_its_own_tests_pass_and_its_types_hold(tmp_path, kind):
    write_project("new_device", kind, tmp_path / "new")
    for tool in (["mypy", "."], ["pytest", "-q", "-p", "no:cacheprovider"]):
        done = subprocess.run([sys.executable, "-m", *tool], cwd=tmp_path / "new")
        assert done.returncode == 0


@pytest.mark.parametrize("name", ["json", "numpy", "class", "Acme", "9x", "a", "a" * 25, "a-b", ""])
def test_a_name_that_no_package_may_have_is_refused(tmp_path, name):
    with pytest.raises(BadInputError):
        write_project(name, "force", tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_nothing_is_written_over(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for place in ("there", "link"):
        with pytest.raises(BadInputError):
            write_project("new_device", "arm", tmp_path / place)
    assert list((tmp_path / "there").iterdir()) == []
