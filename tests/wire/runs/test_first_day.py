"""The set-up of a whole emulated rig through the real drivers, all answers given beforehand."""

from __future__ import annotations

import io

import pytest

from stepload.errors import RefusedError
from stepload.plan.load import load_plan
from stepload_verify.trials.first_day import emulated_rig, first_day


@pytest.mark.long
@pytest.mark.realtime(tolerates_s=0.02)
def test_from_the_first_address_to_a_rig_file_and_a_plan(free_host, tmp_path):
    told = io.StringIO()
    with emulated_rig(free_host) as rig:
        left = first_day(tmp_path, rig, told, until="plan")
        truth = rig.state()
    assert left == ["doctor", "touch"]
    found = load_plan(tmp_path / "first-payload.yaml").rig
    assert found.force.axis == "-fz"
    assert found.wiring_checked_on == found.hazards_read_on
    assert found.arm.options["host"] == free_host
    assert found.arm.options["serial_number"] == "20235500001"
    assert truth["peak_n"] == 0.0
    assert abs(truth["position_m"]) < 1e-4


@pytest.mark.long
@pytest.mark.realtime(tolerates_s=0.02)
def test_a_sensor_that_does_not_feel_the_hand_ends_the_set_up(free_host, tmp_path):
    with emulated_rig(free_host) as rig:
        rig.command("bota_serial gain:0.001")
        with pytest.raises(RefusedError, match="the force sensor: it read"):
            first_day(tmp_path, rig, io.StringIO(), until="push")
        assert rig.state()["peak_n"] == 0.0
    assert "axis" not in (tmp_path / "rig.yaml").read_text()


@pytest.mark.long
@pytest.mark.realtime(tolerates_s=0.02)
def test_the_whole_first_day_ends_with_a_touch(free_host, tmp_path):
    with emulated_rig(free_host) as rig:
        assert first_day(tmp_path, rig, io.StringIO()) == []
        truth = rig.state()
    plan = load_plan(tmp_path / "rig-touch.yaml")
    assert 1.0 < truth["peak_n"] < 1.25 * plan.procedure.top_force_n
    assert truth["contact_n"] == 0.0
    assert "finished" in (tmp_path / "rig.yaml").read_text().splitlines()[0]
