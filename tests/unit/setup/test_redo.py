"""A step again: what rests on it stays where it finds the same; a late answer is an error."""

from __future__ import annotations

import copy
import math
import shutil
from datetime import date

import pytest
from bench_fakes import DAY, Hands, Rig, opener, press_nothing

from stepload.errors import BadInputError, RefusedError
from stepload.setup.answers import Answers
from stepload.setup.questions import STEP_OF
from stepload.setup.state import CALIBRATION, Found, read_state, write_state
from stepload.setup.wizard import set_up
from stepload.setup.yaml_keys import Value

GIVEN = {
    "name": "bench", "host": "127.0.0.1", "sensor": "bota-sensone-serial",
    "sensor_options": "port=/dev/null", "hazards_read_by": "A. Tester",
}  # fmt: skip
LATER = date(2026, 12, 24)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A set-up up to the way, and the rig after it: each test takes copies."""
    path, rig = tmp_path_factory.mktemp("found") / "rig.yaml", Rig()
    go(path, rig)
    return path.parent, rig


@pytest.fixture
def rig(found):
    return copy.deepcopy(found[1])


@pytest.fixture
def rig_file(tmp_path, found):
    shutil.copytree(found[0], tmp_path, dirs_exist_ok=True)
    return tmp_path / "rig.yaml"


def go(path, rig, given=GIVEN, yes=True, person=None, today=DAY, open_devices=None, **how):
    answers = Answers(given, person or Hands(rig), yes=yes)
    how = {"until": "way", **how}
    return set_up(path, answers, today=today, press=press_nothing,
                  open_devices=open_devices or opener(rig), **how)  # fmt: skip


def test_a_push_that_finds_another_axis_does_not(rig_file, rig):
    rig.feel = lambda f: (f[0], f[1], -f[2])
    assert go(rig_file, rig, {}, redo="push", today=LATER, until="push")[0] == "start"


class Elsewhere(Hands):
    """Leads the arm to another start pose, a degree off the first."""

    def tell(self, line):
        super().tell(line)
        if "start pose: above" in line:
            self.rig.tool.turned = (0.0, math.pi - 0.02, 0.0)


def test_another_start_pose_is_another_way(rig_file, rig):
    assert go(rig_file, rig, {}, redo="start", until="start")[0] == "plan"
    left = go(rig_file, rig, {}, person=Elsewhere(rig), redo="start", until="start")
    assert left[0] == "way"


def test_a_calibration_holds_in_its_own_pose_only(rig_file, rig):
    with_a_calibration(rig_file)
    go(rig_file, rig, {}, redo="start", until="start")
    assert "k.json" in rig_file.read_text()
    go(rig_file, rig, {}, person=Elsewhere(rig), redo="start", until="start")
    assert "k.json" not in rig_file.read_text()


@pytest.mark.parametrize("fact", ["limits_set", "towards_plate"])
def test_a_fact_that_is_not_so_is_not_believed_any_more(rig_file, rig, fact):
    step = STEP_OF[fact]
    with pytest.raises(RefusedError, match="answer was no"):
        go(rig_file, rig, {fact: "no"}, redo=step)
    assert step not in read_state(rig_file).done


def with_a_calibration(rig_file):
    state = read_state(rig_file)
    value = Value("k.json", "measured")
    state.done[CALIBRATION] = Found({"system_stiffness.record": value})
    write_state(rig_file, state)


@pytest.mark.parametrize("axis", ["same", "other"])
def test_a_calibration_does_not_outlive_what_it_was_made_with(rig_file, rig, axis):
    with_a_calibration(rig_file)
    if axis == "other":
        rig.feel = lambda f: (f[0], f[1], -f[2])
    go(rig_file, rig, {}, redo="push", today=LATER, until="push")
    assert ("k.json" in rig_file.read_text()) == (axis == "same")


def test_a_new_answer_to_a_step_that_is_done_is_refused(rig_file, rig):
    before = rig_file.read_text()
    with pytest.raises(BadInputError, match=r"--host '127\.0\.0\.2' comes too late") as late:
        go(rig_file, rig, GIVEN | {"host": "127.0.0.2"})
    assert "--redo arm" in late.value.hint
    assert rig_file.read_text() == before
    with pytest.raises(BadInputError, match="was done on 2026-11-22 without it"):
        go(rig_file, rig, {"second_sensor": "ati-axia80-m20-net"})
