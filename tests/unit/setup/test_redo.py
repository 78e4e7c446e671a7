"""A step again: what rests on it stays where it finds the same; a late answer is an error."""

from __future__ import annotations

import copy
import math
import shutil
from datetime import date

import pytest
from bench_fakes import DAY, Hands, Rig, failing, opener, press_nothing

from stepload.errors import BadInputError, DeviceError, RefusedError
from stepload.setup.answers import Answers
from stepload.setup.questions import STEP_OF
from stepload.setup.state import CALIBRATION, Found, read_state, write_state
from stepload.setup.wizard import STEPS, set_up
from stepload.setup.yaml_keys import Value

GIVEN = {
    "name": "bench", "host": "127.0.0.1", "sensor": "bota-sensone-serial",
    "sensor_options": "port=/dev/null", "hazards_read_by": "A. Tester",
}  # fmt: skip
LATER = date(2026, 12, 24)


class Typing(Hands):
    """Somebody at a terminal, who types what is asked for by name and else takes the default."""

    def __init__(self, rig, **typed):
        super().__init__(rig)
        self.typed, self.asked = typed, {}

    def ask(self, question):
        self.asked[question.name] = question.default
        return self.typed.get(question.name, question.default or "")


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


def test_a_push_that_finds_the_same_leaves_the_later_steps_done(rig_file, rig):
    assert go(rig_file, rig, {}, redo="push", today=LATER, until="push")[0] == "plan"
    text = rig_file.read_text()
    assert f"wiring_checked_on: {LATER}" in text
    assert f"hazards_read_on: {DAY}" in text


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


def test_a_step_after_one_that_found_something_else_brings_nothing_back(rig_file, rig):
    left = go(rig_file, rig, {"host": "127.0.0.2"}, redo="arm", until="sensor")
    assert left[0] == "push"


@pytest.mark.parametrize("consent", ["given", "refused"])
def test_a_redo_that_nobody_answers_changes_nothing(rig_file, rig, consent):
    before, done = rig_file.read_text(), read_state(rig_file).done
    given = {"host": "127.0.0.2", "limits_set": "yes"}
    how = {"redo": "arm", "open_devices": failing}
    if consent == "refused":
        given, how = {"may_push": "no"}, {"redo": "push"}
    with pytest.raises((DeviceError, RefusedError)):
        go(rig_file, rig, given, **how)
    assert rig_file.read_text() == before
    assert read_state(rig_file).done == done
    assert read_state(rig_file).answers["host"] == GIVEN["host"]


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


@pytest.mark.parametrize("what", ["calibration", "edit"])
def test_what_somebody_writes_during_a_step_is_not_lost(rig_file, rig, what, monkeypatch):
    def meanwhile(setup):
        if what == "edit":
            rig_file.write_text(rig_file.read_text() + "# mine\n")
        else:
            with_a_calibration(rig_file)
        return Found()

    monkeypatch.setitem(STEPS, "plan", ("the plan", meanwhile))
    with pytest.raises(BadInputError, match="somebody else"):
        go(rig_file, rig, {}, until="plan")
    assert ("# mine" if what == "edit" else "k.json") in rig_file.read_text()


def test_an_answer_that_somebody_gives_during_a_step_is_not_lost(rig_file, rig, monkeypatch):
    """The rig file does not tell of it."""

    def meanwhile(setup):
        state = read_state(rig_file)
        state.answers["radius"] = "25 mm"
        write_state(rig_file, state)
        return Found()

    monkeypatch.setitem(STEPS, "plan", ("the plan", meanwhile))
    with pytest.raises(BadInputError, match="somebody else meanwhile"):
        go(rig_file, rig, {}, until="plan")
    assert read_state(rig_file).answers["radius"] == "25 mm"


def test_a_rig_file_behind_a_link_is_written_in_its_place(rig_file, rig, tmp_path):
    link = tmp_path / "link" / "rig.yaml"
    link.parent.mkdir()
    link.symlink_to(rig_file)
    go(link, rig, {}, redo="push", today=LATER, until="push")
    assert link.is_symlink()
    assert f"wiring_checked_on: {LATER}" in rig_file.read_text()
    assert sorted(each.name for each in link.parent.iterdir()) == ["rig.yaml"]


def test_a_read_only_rig_file_is_left_alone(rig_file, rig):
    before = rig_file.read_text()
    rig_file.chmod(0o444)
    with pytest.raises(BadInputError, match="read-only"):
        go(rig_file, rig, {}, redo="push", today=LATER, until="push")
    assert rig_file.read_text() == before


def test_a_redo_that_is_refused_leaves_nothing_to_rest_on(rig_file, rig):
    rig.feel = lambda f: (0.0, 0.0, 0.0)
    with pytest.raises(RefusedError, match="force sensor"):
        go(rig_file, rig, {}, redo="push")
    assert list(read_state(rig_file).done) == ["arm", "sensor"]
    assert "axis" not in rig_file.read_text()


def test_a_new_answer_to_a_step_that_is_done_is_refused(rig_file, rig):
    before = rig_file.read_text()
    with pytest.raises(BadInputError, match=r"--host '127\.0\.0\.2' comes too late") as late:
        go(rig_file, rig, GIVEN | {"host": "127.0.0.2"})
    assert "--redo arm" in late.value.hint
    assert rig_file.read_text() == before
    with pytest.raises(BadInputError, match="was done on 2026-11-22 without it"):
        go(rig_file, rig, {"second_sensor": "ati-axia80-m20-net"})


def test_the_same_answers_and_consents_are_no_news(rig_file, rig):
    assert go(rig_file, rig, GIVEN | {"limits_set": "yes"})[0] == "plan"


def test_an_answer_that_made_its_step_fail_is_asked_again(tmp_path, rig):
    path = tmp_path / "rig.yaml"
    with pytest.raises(DeviceError):
        go(path, rig, open_devices=failing)
    person = Typing(rig, host="127.0.0.9")
    go(path, rig, {}, person=person, until="arm")
    assert person.asked["host"] == GIVEN["host"]
    assert "host: 127.0.0.9" in path.read_text()


def test_without_a_terminal_the_kept_answer_is_tried_again(tmp_path, rig):
    path = tmp_path / "rig.yaml"
    with pytest.raises(DeviceError):
        go(path, rig, open_devices=failing)
    assert go(path, rig, {}, until="arm")[0] == "sensor"
