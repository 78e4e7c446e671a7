"""An approach goes no further than a surface could bear beyond where every channel last spoke."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import pytest
from course_feed import PERIOD_S, PLANNED, Stage

from stepload.engine.approach import LISTEN_S, Approach
from stepload.engine.listening import Listening
from stepload.engine.operator import StopLevel
from stepload.envelope.unseen import EVERY, Tells
from stepload.record.outcome import Tare
from stepload.record.rows import Phase

LEASH_M = 20e-6
MAIN, SECOND = Tells(main=True, second=False), Tells(main=False, second=True)
NONE = Tells(main=False, second=False)
TICKS = round(3.0 * LISTEN_S / PERIOD_S)
REACTION_M = PLANNED.guarded_speed_m_s * PLANNED.reaction_s


def guarded(tells: Tells) -> tuple[Stage, float]:
    """A guarded approach that has just begun, and where."""
    stage = Stage({"leash_free_m": LEASH_M, "ahead_m": 1.0}, {"surface_distance_m": 0.1})
    stage.course.tares.append(Tare(9.0, 0.3, 300, 0.0, 0.1, 0.0, 0.0, 0.1))
    part = Approach(stage.course, stage.stopped.append, stage.zero, tells)
    part.begin(stage.now_s, "first", 1, stage.then.append)
    part._begin_guarded(stage.now_s)
    stage.course.goal_m = 1.0
    return stage, stage.course.target_m


def speak(stage: Stage, tells: Tells, count: int) -> None:
    """So many ticks in which these channels say something new each time."""
    for index in range(count):
        stage.sup.force.raw_n += 1e-3 * tells.main * (-1) ** index
        stage.sup.second_raw_n += 1e-3 * tells.second * (-1) ** index
        stage.ticks()


def travelled(tells: Tells, speaking: Tells) -> tuple[float, int]:
    stage, begin_m = guarded(tells)
    speak(stage, speaking, TICKS)
    return stage.course.target_m - begin_m, stage.course.phase


FAR_M = PLANNED.guarded_speed_m_s * 2.0 * LISTEN_S


def test_the_figures_of_this_file_tell_far_from_near() -> None:
    assert FAR_M > 2.0 * LEASH_M
    assert REACTION_M < LEASH_M


@pytest.mark.parametrize(
    ("tells", "speaking"),
    [(EVERY, MAIN), (EVERY, SECOND), (EVERY, NONE), (MAIN, SECOND), (SECOND, MAIN)],
)
def test_where_one_is_silent_the_approach_stands_and_says_so(tells: Tells, speaking: Tells) -> None:
    way_m, phase = travelled(tells, speaking)
    assert way_m == pytest.approx(LEASH_M, abs=1e-7)
    assert phase == Phase.LISTENING


@pytest.mark.parametrize(
    ("tells", "speaking"), [(EVERY, EVERY), (MAIN, MAIN), (SECOND, SECOND), (NONE, NONE)]
)
def test_who_is_not_listened_to_holds_nothing_up(tells: Tells, speaking: Tells) -> None:
    way_m, phase = travelled(tells, speaking)
    assert way_m > FAR_M
    assert phase == Phase.GUARDED_APPROACH


def test_it_goes_on_from_where_it_stands_once_the_channel_has_spoken() -> None:
    stage, begin_m = guarded(EVERY)
    speak(stage, MAIN, TICKS)
    assert stage.course.phase == Phase.LISTENING
    speak(stage, EVERY, 2)
    assert stage.course.phase == Phase.GUARDED_APPROACH
    assert stage.course.target_m - begin_m == pytest.approx(LEASH_M, abs=1e-6)
    speak(stage, MAIN, TICKS)
    assert stage.course.target_m - begin_m == pytest.approx(2.0 * LEASH_M, abs=1e-6)
    assert stage.course.phase == Phase.LISTENING


@pytest.mark.parametrize(
    ("tells", "late_s"),
    [(MAIN, PLANNED.reaction_s), (SECOND, PLANNED.second_late_s), (EVERY, PLANNED.second_late_s)],
)
def test_what_a_channel_told_was_true_as_long_ago_as_it_is_late(
    tells: Tells, late_s: float
) -> None:
    """Spoken once under way: the leash counts from where the target was when that was true."""
    stage, begin_m = guarded(tells)
    quiet = MAIN if tells == SECOND else SECOND
    targets_m = []
    while stage.course.target_m - begin_m < 0.95 * LEASH_M:
        targets_m.append(stage.course.target_m)
        speak(stage, quiet if tells != EVERY else NONE, 1)
    targets_m.append(stage.course.target_m)
    late = math.ceil(late_s / PLANNED.period_s)
    assert 0.0 < targets_m[-1 - late] - begin_m < 0.9 * LEASH_M
    speak(stage, EVERY, 1)
    speak(stage, quiet if tells != EVERY else NONE, TICKS)
    assert stage.course.target_m == pytest.approx(targets_m[-1 - late] + LEASH_M, abs=2e-8)


def test_a_channel_that_is_late_tells_nothing_of_where_the_arm_has_just_come_to_rest() -> None:
    """Under way until now: what is read in this tick is of before."""
    listening = Listening(SECOND, 2, 5)
    sup = SimpleNamespace(force=SimpleNamespace(raw_n=0.0), second_raw_n=0.0)
    listening.begin(0.0)
    heard = []
    for tick in range(12):
        sup.second_raw_n += 1.0
        listening.hear(sup, 1e-6 * min(tick + 1, 4))  # type: ignore[arg-type]
        heard.append(round(1e6 * listening.heard_m, 3))
    assert heard == [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0, 4.0, 4.0]


def test_an_answer_is_of_after_the_question() -> None:
    listening = Listening(EVERY, 2, 5)
    sup = SimpleNamespace(force=SimpleNamespace(raw_n=0.0), second_raw_n=0.0)
    listening.begin(0.0)
    listening.ask()
    answered = []
    for _ in range(8):
        sup.second_raw_n += 1.0
        sup.force.raw_n += 1.0
        listening.hear(sup, 0.0)  # type: ignore[arg-type]
        answered.append(listening.answered)
    assert answered == [False] * 5 + [True] * 3


@pytest.mark.parametrize(
    ("speaking", "name"), [(MAIN, "the second force channel"), (SECOND, "the force sensor")]
)
def test_one_that_does_not_speak_any_more_ends_the_run(speaking: Tells, name: str) -> None:
    for patience_s, ends in ((1.9 * LISTEN_S, True), (2.1 * LISTEN_S, False)):
        stage, begin_m = guarded(replace(EVERY, patience_s=patience_s))
        while stage.course.target_m < begin_m + 0.9999 * LEASH_M:
            speak(stage, speaking, 1)
        speak(stage, speaking, TICKS)
        failure = stage.course.failure
        assert (failure is not None) == ends
        if failure is not None:
            assert failure.rule == "silent"
            assert failure.value > failure.limit == LISTEN_S + patience_s
            assert name in failure.message


def test_a_surface_is_felt_while_it_listens() -> None:
    stage, _ = guarded(EVERY)
    speak(stage, MAIN, TICKS)
    stage.ticks(3, 2.0 * PLANNED.touch_force_n)
    assert stage.course.phase == Phase.DWELL


def test_a_stop_is_heard_while_it_listens() -> None:
    stage, _ = guarded(EVERY)
    speak(stage, NONE, TICKS)
    stage.operator.request_stop(StopLevel.AFTER_STEP)
    stage.ticks()
    assert stage.stopped


@pytest.mark.parametrize("guarded_way", [True, False])
def test_it_slows_down_before_it_has_to_wait(guarded_way: bool) -> None:
    """The target never steps from its full speed to rest."""
    speeds = {"guarded_speed_m_s": 5e-3, "fast_speed_m_s": 5e-3, "acceleration_m_s2": 1.0}
    stage = Stage({"leash_free_m": LEASH_M, "ahead_m": 1.0, **speeds}, {"surface_distance_m": 0.1})
    stage.course.tares.append(Tare(9.0, 0.3, 300, 0.0, 0.1, 0.0, 0.0, 0.1))
    part = Approach(stage.course, stage.stopped.append, stage.zero, EVERY)
    part.begin(stage.now_s, "first", 1, stage.then.append)
    if guarded_way:
        part._begin_guarded(stage.now_s)
    targets = []
    for _ in range(200):
        speak(stage, MAIN, 1)
        targets.append(stage.course.target_m)
    steps = [b - a for a, b in pairwise(targets)]
    assert max(steps) / PERIOD_S > 3e-3
    changes = [a - b for a, b in pairwise(steps)]
    assert max(changes) / PERIOD_S**2 < 3.0 * speeds["acceleration_m_s2"]
    assert targets[-1] == pytest.approx(LEASH_M, rel=1e-3)


def dwelling(tells: Tells, *, patience_s: float = 20.0) -> Stage:
    """A guarded approach that has just felt a touch, or what it takes for one."""
    stage, _ = guarded(replace(tells, patience_s=patience_s))
    stage.ticks(3, 2.0 * PLANNED.touch_force_n)
    assert stage.course.phase == Phase.DWELL
    return stage


RUNG_OUT = round(0.5 / PERIOD_S)


@pytest.mark.parametrize(
    ("tells", "speaking", "goes_on"),
    [(EVERY, MAIN, False), (EVERY, SECOND, False), (EVERY, EVERY, True), (MAIN, MAIN, True),
     (SECOND, SECOND, True), (NONE, NONE, True)],
)  # fmt: skip
def test_nothing_is_pressed_on_what_a_channel_told_before_the_touch(
    tells: Tells, speaking: Tells, goes_on: bool
) -> None:
    stage = dwelling(tells)
    speak(stage, speaking, RUNG_OUT)
    assert bool(stage.then) == goes_on
    assert stage.course.failure is None
    if not goes_on:
        speak(stage, EVERY, 2)
        assert stage.then


def test_a_channel_that_does_not_speak_after_the_touch_ends_the_run() -> None:
    for speaking, name in ((MAIN, "second force channel"), (SECOND, "force sensor")):
        stage = dwelling(EVERY, patience_s=0.1)
        speak(stage, speaking, 2 * RUNG_OUT)
        failure = stage.course.failure
        assert failure is not None
        assert failure.rule == "silent"
        assert name in failure.message
        assert not stage.then


def test_going_back_a_little_gives_no_new_way() -> None:
    """A touch of noise, a gap that does not open the contact, and the same again."""
    listening = Listening(EVERY, 0, 0)
    sup = SimpleNamespace(force=SimpleNamespace(raw_n=0.0), second_raw_n=0.0)
    listening.begin(0.0)
    listening.hear(sup, 1e-5)  # type: ignore[arg-type]
    assert listening.heard_m == 1e-5
    listening.begin(3e-5)
    assert listening.heard_m == 1e-5
    listening.begin(0.5e-5)
    assert listening.heard_m == 0.5e-5
