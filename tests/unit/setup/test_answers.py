"""Answers: from flags and files, checked where they stand; a missing one names its flag."""

from __future__ import annotations

import pytest
from bench_fakes import Hands, Rig

from stepload.errors import BadInputError, RefusedError
from stepload.setup.answers import Answers, from_flags
from stepload.setup.questions import QUESTIONS


def requested(given=None, person=None, **how):
    return Answers(given or {}, person or Hands(Rig()), **how)


def test_a_missing_answer_names_its_flag():
    with pytest.raises(BadInputError) as missing:
        requested().text("surface_distance")
    assert "--surface-distance ANSWER" in missing.value.hint


def test_consent_is_never_kept_and_no_is_no():
    answers = requested({"may_touch": "yes"})
    answers.consent("may_touch")
    assert "may_touch" not in answers.kept
    with pytest.raises(RefusedError, match="The answer was no"):
        requested({"may_touch": "no"}, yes=True).consent("may_touch")
    with pytest.raises(BadInputError, match="no terminal"):
        requested().consent("may_touch")
    with pytest.raises(BadInputError, match="no terminal"):
        requested(kept={"may_touch": "yes"}).consent("may_touch")


def test_a_person_is_asked_until_the_answer_can_be_used():
    class Person(Hands):
        def ask(self, question):
            return ("3 mm", "-3 mm", "far")[2 - len(self.said)]

    person = Person(Rig())
    assert requested(person=person).quantity("surface_distance", "m") == pytest.approx(3e-3)
    assert len(person.said) == 2


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (["--hots", "1"], "'--hots' is no question of the set-up"),
        (["--host"], "its answer is missing"),
        (["--radius", "25"], "--radius"),
        (["--shape", "cube"], "--shape: 'cube' is no answer"),
        (["--keys", "a"], "'a' is no KEY=VALUE"),
        (["--host", ""], "an empty answer"),
        (["--host", "  "], "an empty answer"),
        (["--host", "a", "--host", "b"], "--host is given twice"),
        (["--keys", "a=1", "--keys", "b=1", "--keys", "a =2"], "--keys: a is given twice"),
        (["--keys", "a.b=2", "--keys", "a=1"], "--keys: a and a.b, a key in it"),
        (["--procedure", "hold=1 s", "--procedure", "hold=1 s"], "--procedure: hold is given"),
        (["--arm-options", "a=1", "--arm-options", "a=2"], "--arm-options: a is given twice"),
        (["--back", "0 mm"], "--back: '0 mm' is not above 0"),
        (["--surface-distance", "nan m"], "--surface-distance"),
    ],
)
def test_bad_flags_are_named(words, what):
    with pytest.raises(BadInputError, match=what):
        from_flags(words)


def test_what_moves_the_arm_or_lets_a_hand_near_it_is_a_consent_each_time():
    consents = {name for name, question in QUESTIONS.items() if question.consent}
    assert consents == {
        "limits_set", "may_push", "led_to_start", "towards_plate",
        "may_back", "may_move", "may_touch",
    }  # fmt: skip
    assert all(QUESTIONS[name].default is None for name in consents)
