"""The set-up of a rig, from the first address to a rig file; it can be left anywhere."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import date
from pathlib import Path

from stepload.errors import BadInputError, RefusedError
from stepload.setup import acceptance, devices, hand_push, start_pose
from stepload.setup.answers import Answers, DeclinedError
from stepload.setup.bench import Opener, Press, Setup, opened
from stepload.setup.questions import QUESTIONS, REQUESTED_IN, STEP_OF
from stepload.setup.state import CALIBRATION, Found, State, read_state, state_path, write_state

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
        DeviceError: a device failed; the steps before are kept, of a `redo` all.
    """
    names = list(STEPS)
    for name in (redo, until):
        if name and name not in STEPS:
            raise BadInputError(f"{name!r} is no step", hint=f"one of {', '.join(names)}")
    state = read_state(rig)
    former, before = {}, dict(state.answers)
    if redo in state.done:
        again = names[names.index(redo) :]
        former = {name: state.done.pop(name) for name in again if name in state.done}
    _refuse_too_late(state, answers.given)
    answers.kept = state.answers
    answers.settled = {
        requested for step in names if step in state.done for requested in REQUESTED_IN[step]
    }
    setup = Setup(rig, state, answers, open_devices, press, today or date.today())
    if state.done or state.answers:
        done = ", ".join(f"{name} ({step.on})" for name, step in state.done.items()) or "no step"
        setup.tell(
            f"taken up again from {state_path(rig)}; done: {done}; answers are kept, a flag gives"
            " another"
        )
    if former:
        setup.tell(
            f"{redo} is done again; until it is, the rig file says what it found before: do not run"
        )
    for number, (name, (about, step)) in enumerate(STEPS.items(), start=1):
        if name not in state.done:
            setup.tell(f"\n{number} of {len(names)}, {name}: {about}")
            try:
                found = replace(step(setup), on=setup.today.isoformat())
            except BaseException as error:
                refused = isinstance(error, RefusedError) and not isinstance(error, DeclinedError)
                if former and not refused:  # nothing was found against what was done
                    state.done |= former
                    state.answers.clear()
                    state.answers |= before
                write_state(rig, state)
                raise
            state.done[name] = found
            for requested in REQUESTED_IN[name]:
                if requested in answers.given and not QUESTIONS[requested].consent:
                    state.answers[requested] = answers.given[requested]
            if former:
                _keep_or_forget(setup, name, former, found)
                former = {}
            write_state(rig, state)
        if name == until:
            break
    return state.left


def _keep_or_forget(setup: Setup, name: str, former: dict[str, Found], found: Found) -> None:
    """The later steps stay done if step `name` found the same again except for its date."""
    if _essence(former.pop(name)) == _essence(found):
        setup.state.done |= former
        setup.answers.settled |= {requested for step in former for requested in REQUESTED_IN[step]}
        setup.tell(f"{name} found what it had found before: the later steps stay done")
    elif name in CALIBRATED_WITH and CALIBRATION in setup.state.done:
        del setup.state.done[CALIBRATION]
        setup.tell(
            "the system stiffness was measured before that: the rig file no more names its record;"
            " calibrate again"
        )


def _essence(found: Found) -> tuple[dict[str, str], dict[str, str]]:
    values = {key: v.text for key, v in found.values.items() if not key.endswith("_on")}
    return values, dict(found.facts)


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
