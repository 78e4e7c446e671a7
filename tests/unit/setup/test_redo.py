"""A step again: what rests on it stays where it finds the same; a late answer is an error."""

from __future__ import annotations

from datetime import date

import pytest
from bench_fakes import DAY, Hands, Rig, failing, opener

from stepload.errors import BadInputError, DeviceError, RefusedError
from stepload.setup.answers import Answers
from stepload.setup.questions import ASKED_IN, QUESTIONS, STEP_OF
from stepload.setup.state import read_state
from stepload.setup.story import STEPS, set_up

GIVEN = {
    "name": "bench", "host": "127.0.0.1", "sensor": "bota-sensone-serial",
    "sensor_options": "port=/dev/null", "hazards_read_by": "A. Tester", "tool_mass": "0.8 kg",
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


@pytest.fixture
def rig():
    return Rig()


@pytest.fixture
def rig_file(tmp_path, rig):
    path = tmp_path / "rig.yaml"
    go(path, rig)
    return path


def go(path, rig, given=GIVEN, yes=True, person=None, today=DAY, open_devices=None, **how):
    answers = Answers(given, person or Hands(rig), yes=yes)
    how = {"until": "way", **how}
    return set_up(path, answers, today=today, open_devices=open_devices or opener(rig), **how)


def test_a_push_that_finds_the_same_leaves_the_later_steps_done(rig_file, rig):
    assert go(rig_file, rig, {}, redo="push", today=LATER, until="push")[0] == "plan"
    text = rig_file.read_text()
    assert f"pushed_on: {LATER}" in text
    assert f"hazards_read_on: {DAY}" in text


def test_a_push_that_finds_another_axis_does_not(rig_file, rig):
    rig.feel = lambda f: (f[0], f[1], -f[2])
    assert go(rig_file, rig, {}, redo="push", today=LATER, until="push")[0] == "weigh"


def test_a_redo_that_nobody_answers_leaves_all_as_it_was(rig_file, rig):
    before = rig_file.read_text()
    with pytest.raises(DeviceError):
        go(rig_file, rig, {}, redo="push", open_devices=failing)
    assert rig_file.read_text() == before
    with pytest.raises(RefusedError, match="answer was no"):
        go(rig_file, rig, {"may_push": "no"}, redo="push")
    assert rig_file.read_text() == before


def test_a_redo_that_nobody_answers_leaves_the_answers_too(rig_file, rig):
    given = {"host": "127.0.0.2"}
    with pytest.raises(DeviceError):
        go(rig_file, rig, given, redo="arm", open_devices=failing)
    assert read_state(rig_file).answers["host"] == GIVEN["host"]
    with pytest.raises(BadInputError, match=r"--host '127\.0\.0\.2' comes too late"):
        go(rig_file, rig, given)


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


def test_a_new_answer_with_redo_is_taken(rig_file, rig):
    go(rig_file, rig, {"host": "127.0.0.2"}, redo="arm", until="arm")
    assert "host: 127.0.0.2" in rig_file.read_text()


def test_an_answer_that_made_its_step_fail_is_asked_again(tmp_path, rig):
    path = tmp_path / "rig.yaml"
    with pytest.raises(DeviceError):
        go(path, rig, open_devices=failing)
    person = Typing(rig, host="127.0.0.9")
    go(path, rig, {}, person=person, until="arm")
    assert person.asked["host"] == GIVEN["host"]
    assert "host: 127.0.0.9" in path.read_text()
    assert read_state(path).doubted == set()


def test_without_a_terminal_the_kept_answer_is_tried_again(tmp_path, rig):
    path = tmp_path / "rig.yaml"
    with pytest.raises(DeviceError):
        go(path, rig, open_devices=failing)
    assert go(path, rig, {}, until="arm")[0] == "sensor"


def test_every_question_belongs_to_one_step():
    assert list(ASKED_IN) == list(STEPS)
    assert sorted(name for names in ASKED_IN.values() for name in names) == sorted(QUESTIONS)
    assert STEP_OF["keys"] == "sensor"
