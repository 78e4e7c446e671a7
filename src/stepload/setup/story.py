"""The set-up of a rig, from the first address to a rig file; it can be left anywhere."""

from __future__ import annotations

from collections.abc import Callable
from datetime import date
from pathlib import Path

from stepload.errors import BadInputError
from stepload.setup import devices, hand, proof, way
from stepload.setup.answers import Answers
from stepload.setup.bench import Opener, opened
from stepload.setup.context import Setup
from stepload.setup.state import Done, Found, read_state, state_path, write_state

Step = Callable[[Setup], Found]

STEPS: dict[str, tuple[str, Step]] = {
    "arm": ("the arm answers and is set up", devices.arm),
    "sensor": ("the force sensor answers", devices.sensor),
    "push": ("axis and sign of the force, by a push by hand", hand.push),
    "weigh": ("the mass of the tool, by its weight in two poses", hand.weigh),
    "start": ("the start pose, as the arm is led there", way.start),
    "way": ("the way is free: the first motion", way.way),
    "plan": ("the plan of the first payload", proof.plan),
    "doctor": ("noise, rates, delays, stop and watchdog", proof.doctor),
    "touch": ("the first touch, at the lowest force", proof.touch),
}
"""In this order: each rests on those before it."""


def set_up(
    rig: Path,
    answers: Answers,
    *,
    redo: str = "",
    until: str = "",
    today: date | None = None,
    open_devices: Opener = opened,
) -> list[str]:
    """Do the steps that are left, and keep each as soon as it is done; returns those left then.

    Args:
        rig: the rig file, written anew after each step.
        answers: what is answered beforehand, and who is asked for the rest.
        redo: a step to be done again, with all that rest on it.
        until: the last step of this start.
        today: the day that measurements are dated with; None: today.
        open_devices: opens devices, in place of real drivers.

    Raises:
        BadInputError: an answer is missing or cannot be used, or a file cannot.
        RefusedError: a step found what must not be gone on with; those before it are kept.
        DeviceError: a device failed; the steps before are kept.
    """
    names = list(STEPS)
    for name in (redo, until):
        if name and name not in STEPS:
            raise BadInputError(f"{name!r} is no step", hint=f"one of {', '.join(names)}")
    state = read_state(rig)
    if redo:
        for name in names[names.index(redo) :]:
            state.done.pop(name, None)
    answers.kept = state.answers
    setup = Setup(rig, state, answers, open_devices, today or date.today())
    if state.done or state.answers:
        done = ", ".join(f"{name} ({step.on})" for name, step in state.done.items()) or "no step"
        setup.tell(
            f"taken up again from {state_path(rig)}; done: {done}; answers are kept, a flag gives"
            " another"
        )
    for number, (name, (about, step)) in enumerate(STEPS.items(), start=1):
        if name in state.done:
            continue
        setup.tell(f"\n{number} of {len(names)}, {name}: {about}")
        try:
            found = step(setup)
        except BaseException:
            write_state(rig, state, _left(state.done))
            raise
        state.done[name] = Done(setup.today.isoformat(), found)
        write_state(rig, state, _left(state.done))
        if name == until:
            break
    return _left(state.done)


def _left(done: dict[str, Done]) -> list[str]:
    return [name for name in STEPS if name not in done]
