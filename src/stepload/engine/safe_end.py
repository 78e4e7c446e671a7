"""The commands that make a rig safe: a retract unless the loop did one, then a stop per device.

In real time an arm that does not answer is asked again and again for `PATIENCE_S`, except where the
loop hung in a device: that one cannot be asked.

Should the safing itself be broken, the arm alone is sent a retract and a stop, directly.
"""

from __future__ import annotations

import time
from collections.abc import Callable

from stepload.engine.interfaces import RigDevices, by_role
from stepload.engine.notices import Say, nothing
from stepload.engine.safing import Action, make_safe
from stepload.engine.tick import Engine
from stepload.engine.unload import ForceLeft, Way, unload
from stepload.errors import in_words
from stepload.record.outcome import ActionResult
from stepload.rig.device import Arm, Device

RETRACT = "arm retract"
SAFE_DEADLINE_S = 3.0
RETRACT_EXTRA_S = 2.0
PATIENCE_S = 120.0
DEADLINE_SLACK_S = 1.0
"""A device is given its own timeout; its thread a little more."""
BLIND_RETRACT_M, BLIND_SPEED_M_S, BLIND_TIMEOUT_S = 1e-3, 1e-3, 4.0
"""The retract of last resort, where the plan's cannot be obtained."""


def make_rig_safe(
    engine: Engine, rig: RigDevices, errors: list[str], say: Say = nothing
) -> tuple[ActionResult, ...]:
    """Make the rig safe after its loop has ended, however it ended; never raises.

    Where safing itself breaks, `errors` says how, and the arm is sent a retract and a stop anyway.
    `say` takes a line for the operator at each turn.
    """
    try:
        done = make_safe(_actions(engine, rig, say), engine.operator)
    except BaseException as error:
        errors.append(f"safing: {in_words(error)}")
        return _last_resort(rig.arm)
    for action in done:
        if action.error and action.name != RETRACT:
            say(f"safing: {action.name} NOT confirmed: {action.error}")
    return done


def _actions(engine: Engine, rig: RigDevices, say: Say) -> list[Action]:
    stops = [_stop(role, device) for role, device in by_role(rig)]
    if engine.safe_reached or engine.course.done or not engine.retract_distance_m > 0.0:
        return stops
    return [_retract(engine, rig, say), *stops]


def _retract(engine: Engine, rig: RigDevices, say: Say) -> Action:
    distance_m, speed_m_s = engine.retract_distance_m, engine.course.back_speed_m_s
    timeout_s = 2.0 * distance_m / speed_m_s + RETRACT_EXTRA_S
    hung = engine.cause is not None and engine.cause.rule == "hang"
    patience_s = 0.0 if rig.clock.virtual or hung else PATIENCE_S
    way = Way(distance_m, speed_m_s, timeout_s, patience_s)
    force = ForceLeft(engine, rig.force, rig.clock)
    return Action(
        RETRACT,
        lambda: unload(rig.arm, way, force, engine.operator, say),
        2.0 * timeout_s + patience_s + DEADLINE_SLACK_S,
        arm=True,
    )


def _stop(role: str, device: Device) -> Action:
    is_arm = role == "arm"
    return Action(
        "arm stop" if is_arm else role,
        lambda: device.safe(SAFE_DEADLINE_S),
        SAFE_DEADLINE_S + DEADLINE_SLACK_S,
        arm=is_arm,
    )


def _last_resort(arm: Arm) -> tuple[ActionResult, ...]:
    return (
        _sent(RETRACT, lambda: arm.retract(BLIND_RETRACT_M, BLIND_SPEED_M_S, BLIND_TIMEOUT_S)),
        _sent("arm stop", lambda: arm.safe(SAFE_DEADLINE_S)),
    )


def _sent(name: str, call: Callable[[], None]) -> ActionResult:
    begin_s, error_text = time.monotonic(), ""
    try:
        call()
    except BaseException as error:  # what comes after it must be sent as well
        error_text = in_words(error)
    return ActionResult(name, True, error_text, begin_s, time.monotonic() - begin_s)
