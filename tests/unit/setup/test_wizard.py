"""Left and taken up again: what is done stays done, what was changed by hand is not lost."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from bench_fakes import DAY, Hands, Rig, failing, opener, press_nothing

from stepload.errors import BadInputError, DeviceError, RefusedError
from stepload.plan.load import load_plan
from stepload.record.outcome import RunStatus, Touch
from stepload.setup import acceptance
from stepload.setup.answers import Answers
from stepload.setup.bench import Press
from stepload.setup.checkup import Checkup
from stepload.setup.state import read_state, state_path
from stepload.setup.wizard import STEPS, set_up

GIVEN = {
    "name": "bench", "host": "127.0.0.1", "sensor": "bota-sensone-serial",
    "sensor_options": "port=/dev/null", "hazards_read_by": "A. Tester", "payload_name": "ball",
    "shape": "sphere", "radius": "25 mm", "material": "silicone rubber, 50 Shore A",
    "force_limit": "100 N", "surface_distance": "3 mm", "procedure": "retract=8 mm",
    "keys": "system_stiffness.sigma=2e3 N/m",
}  # fmt: skip


def go(path: Path, rig: Rig, open_devices=None, given=GIVEN, press=press_nothing, **how):
    answers = Answers(given, Hands(rig), yes=True)
    left = set_up(path, answers, today=DAY, press=press,
                  open_devices=open_devices or opener(rig), **how)  # fmt: skip
    return left, answers.person.said


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    return tmp_path / "rig.yaml"


def test_the_rig_file_loads_in_its_plan_and_every_value_says_where_it_is_from(rig_file):
    left, _ = go(rig_file, Rig(), until="plan")
    assert left == ["doctor", "touch"]
    plan = load_plan(rig_file.parent / "first-payload.yaml", today=DAY)
    assert plan.rig.force.axis == "-fz"
    assert plan.rig.wiring_checked_on == DAY
    assert plan.rig.force.options["port"] == "/dev/null"
    assert plan.rig.hazards_read_by == "A. Tester"
    assert plan.rig.arm.options["serial_number"] == "2023"
    assert plan.procedure.top_force_n > 10.0
    rows = [row for row in rig_file.read_text().splitlines() if ": " in row and row[0] != "#"]
    origins = ("default of profile ur5e", "data sheet bota", "measured 2026", "told by", "stated")
    assert len(rows) > 30
    assert [row for row in rows if not any(f"# {word}" in row for word in origins)] == []
    assert "UNFINISHED, to come: doctor, touch" in rig_file.read_text()


def test_a_later_start_goes_on_and_asks_nothing_twice(rig_file):
    rig = Rig()
    assert go(rig_file, rig, until="push")[0][0] == "start"
    done = rig.openings
    left, said = go(rig_file, rig, given={"hazards_read_by": "A. Tester"}, until="way")
    assert left[0] == "plan"
    assert rig.openings == done + 2
    assert "done: arm (2026-11-22), sensor (2026-11-22), push (2026-11-22)" in said[0]


def test_killed_in_a_step_only_that_step_is_lost(rig_file):
    rig = Rig()
    go(rig_file, rig, until="sensor")

    class KilledError(BaseException):
        pass

    class Killed(Hands):
        def tell(self, line):
            if "push 2" in line:
                raise KilledError
            super().tell(line)

    answers = Answers(GIVEN, Killed(rig), yes=True)
    with pytest.raises(KilledError):
        set_up(rig_file, answers, press=press_nothing, today=DAY, open_devices=opener(rig))
    assert list(read_state(rig_file).done) == ["arm", "sensor"]
    rig.tool.hand_n = (0.0, 0.0, 0.0)
    assert go(rig_file, rig, until="push")[0][0] == "start"


def test_redo_forgets_the_step_and_what_rests_on_it(rig_file):
    rig = Rig()
    go(rig_file, rig, until="way")
    rig.feel = lambda f: (f[0], f[1], -f[2])
    left, _ = go(rig_file, rig, redo="push", until="push")
    assert left[0] == "start"
    text = rig_file.read_text()
    assert 'axis: "+fz"' in text
    assert "hazards_read_by" not in text


def test_a_step_that_fails_keeps_those_before_it(rig_file):
    rig = Rig()
    go(rig_file, rig, until="arm")
    with pytest.raises(DeviceError, match="nobody answers"):
        go(rig_file, rig, open_devices=failing)
    assert list(read_state(rig_file).done) == ["arm"]
    assert json.loads(state_path(rig_file).read_text())["answers"]["sensor"] == GIVEN["sensor"]


def test_a_sensor_that_does_not_feel_the_hand_ends_the_set_up(rig_file):
    rig = Rig(feel=lambda f: tuple(1e-3 * part for part in f))
    with pytest.raises(RefusedError, match="the force sensor: it read"):
        go(rig_file, rig, until="push")
    steps = list(STEPS)
    assert list(read_state(rig_file).done) == steps[: steps.index("push")]
    assert "axis" not in rig_file.read_text()
    assert rig.targets == []


def test_a_rig_file_changed_by_hand_is_not_overwritten(rig_file):
    rig = Rig()
    go(rig_file, rig, until="arm")
    changed = rig_file.read_text() + "mechanical_fuse: 100 N\n"
    rig_file.write_text(changed)
    with pytest.raises(BadInputError, match="not as the set-up left it"):
        go(rig_file, rig)
    assert rig_file.read_text() == changed


def test_a_plan_that_preflight_refuses_is_not_written(rig_file):
    with pytest.raises(RefusedError, match="preflight refuses"):
        go(rig_file, Rig(), given=GIVEN | {"top_force": "95 N"})
    assert not (rig_file.parent / "first-payload.yaml").exists()
    assert [path.name for path in rig_file.parent.glob(".*")] == []


def test_a_sensor_needs_a_data_sheet_and_the_axis_no_statement(rig_file):
    with pytest.raises(BadInputError, match="is no data sheet"):
        go(rig_file, Rig(), given=GIVEN | {"sensor": "bathroom-scales"})
    sheet = rig_file.parent / "mine.yaml"
    sheet.write_text("driver: bota_serial\naxis: -fz\n")
    with pytest.raises(BadInputError, match="`axis` is on no data sheet"):
        go(rig_file, Rig(), given=GIVEN | {"sensor": "mine.yaml"})


def sound(preflight, **how):
    """In place of the doctor, whose devices are real ones."""
    return Checkup((), "", {})


def ended(status: RunStatus, pressed: list) -> Press:
    """A session that ends so."""

    def press(preflight, out):
        pressed.append((preflight.plan, out))
        return SimpleNamespace(
            status=status,
            why="stopped: R3",
            peak_force_n=4.0,
            touches=[Touch(0.0, 3e-3, 1.0, 1e-3, 1, "")],
        )

    return press


def test_the_first_touch_presses_the_lightest_plan_and_is_done_once_it_is_completed(
    rig_file, monkeypatch
):
    monkeypatch.setattr(acceptance.checkup, "examine", sound)
    pressed, rig = [], Rig()
    with pytest.raises(RefusedError, match="the touch was not completed: stopped: R3") as refused:
        go(rig_file, rig, press=ended(RunStatus.STOPPED, pressed))
    assert "touch" not in read_state(rig_file).done
    [(plan, first)] = pressed
    assert str(first) in str(refused.value.hint)
    whole = load_plan(rig_file.parent / "first-payload.yaml", today=DAY)
    assert plan.procedure.top_force_n < whole.procedure.top_force_n
    assert plan.path.name == "rig-touch.yaml"
    first.mkdir(parents=True)  # as the session leaves it
    left, said = go(rig_file, rig, given={}, press=ended(RunStatus.COMPLETED, pressed))
    assert left == []
    assert "touched with up to 4 N, the surface at 3 mm from the start pose" in said
    assert pressed[1][1] != first
