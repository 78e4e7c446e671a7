"""A calibration goes into the rig file without ending what the set-up has done."""

from __future__ import annotations

import shutil
from dataclasses import replace
from datetime import date

import pytest
from bench_fakes import DAY, Hands, Rig, opener, press_nothing

from stepload.errors import RefusedError
from stepload.plan.calibration import CalibrationRecord, write_calibration
from stepload.plan.load import load_plan
from stepload.plan.model import Provenance
from stepload.setup.answers import Answers
from stepload.setup.state import put_record
from stepload.setup.wizard import set_up

GIVEN = {
    "name": "bench", "host": "127.0.0.1", "sensor": "bota-sensone-serial",
    "sensor_options": "port=/dev/null", "hazards_read_by": "A. Tester", "payload_name": "ball",
    "shape": "sphere", "radius": "25 mm", "material": "silicone rubber, 50 Shore A",
    "force_limit": "100 N", "surface_distance": "3 mm", "procedure": "retract=8 mm",
    "keys": "system_stiffness.sigma=2e3 N/m",
}  # fmt: skip
RECORD = CalibrationRecord(
    stepload_calibration=1,
    rig="bench", direction="-fz", measured_on=DAY, valid_until=date(2027, 5, 21),
    stiffness_n_per_m=1.23e5, sigma_n_per_m=1e3, msde_m=1e-6, force_from_n=1.0, force_to_n=50.0,
)  # fmt: skip


def go(path, rig, given, **how):
    answers = Answers(given, Hands(rig), yes=True)
    return set_up(path, answers, press=press_nothing, today=DAY, open_devices=opener(rig), **how)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """The directory of a set-up with its plan; each test takes a copy."""
    path = tmp_path_factory.mktemp("found") / "rig.yaml"
    go(path, Rig(), GIVEN, until="plan")
    return path.parent


@pytest.fixture
def rig_file(tmp_path, found):
    shutil.copytree(found, tmp_path, dirs_exist_ok=True)
    return tmp_path / "rig.yaml"


@pytest.fixture
def record_file(tmp_path):
    path = tmp_path / "calibration" / "bench.json"
    path.parent.mkdir()
    write_calibration(RECORD, path)
    return path


def test_the_plan_takes_the_record_and_the_set_up_goes_on(rig_file, record_file):
    put_record(rig_file, record_file, RECORD, DAY)
    assert "record: calibration/bench.json" in rig_file.read_text()
    stiffness = load_plan(rig_file.parent / "first-payload.yaml", today=DAY).rig.system_stiffness
    assert stiffness.stiffness_n_per_m == pytest.approx(1.23e5)
    assert stiffness.provenance is Provenance.MEASURED
    assert go(rig_file, Rig(), {}, redo="push", until="push") == ["doctor", "touch"]
    assert "record: calibration/bench.json" in rig_file.read_text()


def test_another_rigs_record_and_a_simulated_one_are_refused(rig_file, record_file):
    before = rig_file.read_text()
    with pytest.raises(RefusedError, match="of the rig 'other'"):
        put_record(rig_file, record_file, replace(RECORD, rig="other"), DAY)
    with pytest.raises(RefusedError, match="dry run"):
        put_record(rig_file, record_file, replace(RECORD, simulated=True), DAY)
    assert rig_file.read_text() == before
