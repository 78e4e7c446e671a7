"""The set-up of a rig, from the first address to a rig file; it can be left anywhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import date
from pathlib import Path

from stepload.errors import BadInputError, RefusedError, SteploadError
from stepload.setup import acceptance, devices, hand_push, start_pose
from stepload.setup.answers import Answers, DeclinedError
from stepload.setup.context import Press, Setup
from stepload.setup.open_devices import Opener, opened
from stepload.setup.questions import ASKED_IN, QUESTIONS, STEP_OF
from stepload.setup.state import (
    CALIBRATION,
    Done,
    Found,
    State,
    read_state,
    state_path,
    write_state,
)

Step = Callable[[Setup], Found]

STEPS: dict[str, tuple[str, Step]] = {
    "arm": ("the arm answers and is set up", devices.arm),
    "sensor": ("the force sensor answers", devices.sensor),
    "push": ("axis and sign of the force, by a push by hand", hand_push.push),
    "start": ("the start pose, as the arm is led there", start_pose.start),
    "way": ("the way is free: the first motion", start_pose.way),
    "plan": ("the plan of the first payload", acceptance.plan),
    "doctor": ("noise, rates, delays, stop and watchdog", acceptance.doctor),
    "touch": ("the first touch, at the lowest force", acceptance.touch),
}
"""In this order: each rests on those before it."""
CALIBRATED_WITH = ("arm", "sensor", "push", "start")
"""The steps on whose findings a measured system stiffness depends."""


def set_up(
    rig: Path,
    answers: Answers,
    *,
    press: Press,
    redo: str = "",
    until: str = "",
    today: date | None = None,
    open_devices: Opener = opened,
) -> list[str]:
    """Do the steps that are left, and keep each as soon as it is done; returns those left then.

    Args:
        rig: the rig file, written anew after each step.
        answers: what is answered beforehand, and who is asked for the rest.
        press: presses the plan of the first touch: `stepload.session.experiment.press`.
        redo: a step to be done again; those after it as well, unless it finds the same as before.
        until: the last step of this start.
        today: the day that measurements are dated with; None: today.
        open_devices: opens devices, in place of real drivers.

    Raises:
        BadInputError: an answer is missing, cannot be used or comes too late, or a file cannot.
        RefusedError: a step found a reason not to go on; those before it are kept.
        DeviceError: a device failed; the steps before are kept.
    """
    names = list(STEPS)
    for name in (redo, until):
        if name and name not in STEPS:
            raise BadInputError(f"{name!r} is no step", hint=f"one of {', '.join(names)}")
    state = read_state(rig)
    if redo in state.done and redo not in state.redoing:
        state.redoing.add(redo)
        write_state(rig, state, _left(state.done))
    former = _again(state)
    before = dict(state.answers)
    answers.kept, answers.doubted = state.answers, state.doubted
    _refuse_too_late(state, answers.given)
    setup = Setup(rig, state, answers, open_devices, press, today or date.today())
    if state.done or state.answers:
        done = ", ".join(f"{name} ({step.on})" for name, step in state.done.items()) or "no step"
        setup.tell(
            f"taken up again from {state_path(rig)}; done: {done}; answers are kept, a flag gives"
            " another"
        )
    if former:
        setup.tell(
            f"{next(iter(former))} is done again; until it is, the rig file says what it found"
            " before: do not run"
        )
    for number, (name, (about, step)) in enumerate(STEPS.items(), start=1):
        if name in state.done and name in state.redoing:
            former = _again(state)
        if name in state.done:
            if name == until:
                break
            continue
        setup.tell(f"\n{number} of {len(names)}, {name}: {about}")
        try:
            found = step(setup)
        except BaseException as error:
            if not isinstance(error, RefusedError) or isinstance(error, DeclinedError):
                state.done |= former  # nothing was found against them
                if former:  # what is done rests on the answers that it was done with
                    state.answers.clear()
                    state.answers |= before
            if isinstance(error, SteploadError) and not isinstance(error, DeclinedError):
                state.doubted |= {asked for asked in ASKED_IN[name] if asked in state.answers}
            write_state(rig, state, _left(state.done))
            raise
        state.done[name] = Done(setup.today.isoformat(), found)
        state.redoing.discard(name)
        for asked in ASKED_IN[name]:
            if asked in answers.given and not QUESTIONS[asked].consent:
                state.answers[asked] = answers.given[asked]
        state.doubted -= set(ASKED_IN[name])
        if former:
            if _alike(former.pop(name).found, found):
                state.done |= former
                later = next((each for each in STEPS if each in state.redoing), "")
                setup.tell(
                    f"{name} found what it had found before: the later steps"
                    f"{later and f' before {later}'} stay done"
                )
            elif name in CALIBRATED_WITH and CALIBRATION in state.done:
                del state.done[CALIBRATION]
                setup.tell(
                    "the system stiffness was measured before that: the rig file no more names its"
                    " record; calibrate again"
                )
            former = {}
        write_state(rig, state, _left(state.done))
        if name == until:
            break
    return _left(state.done)


def _again(state: State) -> dict[str, Done]:
    """Take the first step that is to be done again, and all after it, out of what is done."""
    first = next((name for name in STEPS if name in state.redoing & state.done.keys()), None)
    if first is None:
        return {}
    names = list(STEPS)
    again = names[names.index(first) :]
    return {name: state.done.pop(name) for name in again if name in state.done}


def _refuse_too_late(state: State, given: Mapping[str, str]) -> None:
    """Refuse a flag that would change a step that is done.

    Raises:
        BadInputError: an answer is given to a step that is done, and it is another one.
    """
    for name, answer in given.items():
        question, step = QUESTIONS[name], STEP_OF[name]
        if question.consent or step not in state.done or state.answers.get(name) == answer:
            continue
        was = f"with {state.answers[name]!r}" if name in state.answers else "without it"
        raise BadInputError(
            f"{question.flag} {answer!r} comes too late: the step `{step}` was done on"
            f" {state.done[step].on} {was}",
            hint=f"add --redo {step}, which does it again, and the steps after it where it finds"
            " something else",
        )


def _alike(old: Found, new: Found) -> bool:
    """Whether two findings are equal except for their dates, so that later steps stay valid."""
    texts = [
        {key: value.text for key, value in found.values.items() if not key.endswith("_on")}
        for found in (old, new)
    ]
    return texts[0] == texts[1] and old.facts == new.facts


def _left(done: dict[str, Done]) -> list[str]:
    return [name for name in STEPS if name not in done]
