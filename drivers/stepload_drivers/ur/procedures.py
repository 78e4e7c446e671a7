"""Procedures that the child carries out on request.

Each procedure keeps stepping the loop, so that data continue and the watchdog is fed; a new request
ends it.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable

from stepload_drivers.ur.configuration import RATE_HZ, change, expected, tcp_changed
from stepload_drivers.ur.loop import Loop
from stepload_drivers.ur.ports import ControlPort
from stepload_drivers.ur.state import PLAYING, UrState, arrived_m, can_move, safety_problem
from stepload_drivers.ur.watch import TOLD_S

PROGRAM_START_S = 3.0
STANDSTILL_S = 2.0
SERVO_STOP_M_S2 = 10.0
ORPHAN_M_S = 0.01
ORPHAN_WAIT_S = 1.0
EARLY_SHARE = 0.5
"""A program that ends before this share of the watchdog's time was ended by something else."""


class RequestError(Exception):
    """A request could not be carried out; the text goes to the run."""


def connect(loop: Loop) -> None:
    """Control interface, TCP and payload, watchdog; proves the watchdog where asked.

    Travel counts from where the arm then stands: another program may have moved it until the
    control interface ended that program.

    Raises:
        RuntimeError: ur_rtde could not connect or start its program.
        RequestError: the controller refused something, its watchdog did not act, or the arm does
            not stand still.
    """
    loop.expect_stop = loop.muted = True
    loop.control = ControlPort(loop.settings)
    loop.forgive_pause()
    _begin(loop)
    if loop.settings.prove_watchdog:
        _trip_watchdog(loop)
        _restart(loop)
    _wait_still(loop)
    loop.begin_here()


def stop_servo(loop: Loop) -> dict[str, object]:
    """Leave servo mode and check that the arm stands still. Sent in any state."""
    control = _control(loop)
    loop.follow(None)
    at_s = time.monotonic()
    confirmed = control.stop_servo(SERVO_STOP_M_S2)
    loop.sent_s = at_s
    _wait_still(loop)
    return {"confirmed": confirmed, "runtime_state": loop.state.runtime_state}


def retract(loop: Loop, distance_m: float, speed_m_s: float) -> dict[str, object]:
    """Ramp the servo target back and check that the arm follows."""
    from_m = _back_away(loop, distance_m, speed_m_s)
    goal_m = from_m - arrived_m(distance_m)
    _wait(loop, lambda _: loop.position_m < goal_m, 2.0, "the arm did not follow the retract")
    stop_servo(loop)
    return {"distance_m": from_m - loop.position_m}


def prove(loop: Loop, distance_m: float, speed_m_s: float) -> dict[str, object]:
    """Back away slowly, stop sending on the way, and check that the watchdog stops the arm."""
    _back_away(loop, distance_m, speed_m_s)
    cut_m = loop.position_m
    stop_s = _trip_watchdog(loop)
    more_s = _wait_still(loop)
    went_m = abs(loop.position_m - cut_m)
    _restart(loop)
    return {"stop_s": stop_s, "still_s": stop_s + more_s, "travel_m": went_m}


def unload(loop: Loop) -> None:
    """The run has died: back away if the arm was under way, since a stop alone leaves the force on.

    A failure cannot be reported to anyone; the arm then stands still where it is.
    """
    distance_m = loop.settings.orphan_retract_m
    if loop.target_m is None or distance_m == 0.0:
        return
    with contextlib.suppress(RequestError):
        goal_m = _back_away(loop, distance_m, ORPHAN_M_S) - arrived_m(distance_m)
        until_s = time.monotonic() + ORPHAN_WAIT_S
        while loop.position_m > goal_m and time.monotonic() < until_s:
            loop.received_s = time.monotonic()
            loop.step()


def leave(loop: Loop) -> None:
    """Stop servo and program, as far as they run."""
    if loop.control is not None and loop.state.runtime_state == PLAYING:
        loop.control.stop_servo(SERVO_STOP_M_S2)
        loop.control.end_program()


def _control(loop: Loop) -> ControlPort:
    assert loop.control is not None
    return loop.control


def _wait(loop: Loop, done: Callable[[UrState], bool], timeout_s: float, what: str) -> float:
    """Step until a new package says `done`; returns seconds waited."""
    started_s = time.monotonic()
    known = loop.state
    while loop.state is known or not done(loop.state):
        if time.monotonic() - started_s > timeout_s:
            raise RequestError(f"{what} (within {timeout_s:.2f} s)")
        if loop.requests or loop.link.closed:
            raise RequestError(f"{what}: given up for another request")
        loop.received_s = time.monotonic()
        loop.step()
    return time.monotonic() - started_s


def _wait_still(loop: Loop) -> float:
    still = "the arm does not stand still"
    return _wait(loop, lambda _: loop.standstill.still, STANDSTILL_S, still)


def _begin(loop: Loop) -> None:
    """Wait until both connections report a running program, and prepare it; then a stop is a fault.

    The controller sends to its clients one after the other: the one may still say STOPPED when the
    other says PLAYING, and ur_rtde sends no command before its own does.
    """
    control = _control(loop)

    def started(package: UrState) -> bool:
        return can_move(package) and control.program_runs()

    _wait(loop, started, PROGRAM_START_S, "the control program did not start")
    _prepare(loop)
    loop.muted = False
    _arm(loop)
    loop.expect_stop = False


def _arm(loop: Loop) -> None:
    """Wait until the required settings are reported; from then on a change of them is a fault."""
    watch, since_s = loop.watch, time.monotonic()

    def told_since(_: UrState) -> bool:
        return watch.told.seen_s > since_s + 1.0 / RATE_HZ  # not one that was under way

    _wait(loop, told_since, TOLD_S, "the controller does not tell its settings")
    assert watch.told.configuration is not None
    armed = watch.armed or expected(loop.settings, watch.told.configuration)
    if problem := change(armed, watch.told.configuration):
        raise RequestError(problem.message)
    watch.armed = armed


def _prepare(loop: Loop) -> None:
    """TCP, payload, watchdog: all of it is lost when the program starts anew."""
    at_s = time.monotonic()
    if not _control(loop).prepare():
        raise RequestError("the controller refused TCP, payload or watchdog")
    loop.sent_s = at_s


def _trip_watchdog(loop: Loop) -> float:
    """Send nothing until the controller has ended the program; returns the time that took.

    A safety stop, or a program that ends long before the watchdog is due, proves nothing.
    """
    loop.expect_stop = loop.muted = True
    watchdog_s = 1.0 / loop.settings.watchdog_hz
    took_s = _wait(
        loop,
        lambda package: package.runtime_state != PLAYING,
        watchdog_s + 0.5,
        "the watchdog did not stop the program; the arm must not be used",
    )
    if problem := safety_problem(loop.state):
        raise RequestError(f"{problem.message} while the watchdog was tried")
    silent_s = time.monotonic() - loop.sent_s
    if silent_s < EARLY_SHARE * watchdog_s:
        raise RequestError(
            f"the program ended {silent_s * 1e3:.0f} ms after the last input, not by its watchdog "
            f"({watchdog_s * 1e3:.0f} ms)"
        )
    return took_s


def _restart(loop: Loop) -> None:
    """Upload again, wait until it runs, arm the watchdog again."""
    loop.follow(None)
    control = _control(loop)
    if not control.upload():
        raise RequestError("the controller refused the control program")

    _begin(loop)


def _back_away(loop: Loop, distance_m: float, speed_m_s: float) -> float:
    """Move the target back from where the arm is; returns that position.

    That is the measured position or the last target, whichever is further back: a measured position
    that has jumped ahead, frozen or drifted must not become a push. Further behind the target than
    any target may lead, one of the two is wrong, and no servo target is safe.
    """
    if loop.taken_over:
        raise RequestError("the arm was stopped by a person or a safety system: no motion")
    if tcp_changed(loop.watch.armed, loop.watch.told.configuration):
        raise RequestError("the TCP was changed: left to the controller's own target")
    from_m = min(loop.position_m, loop.commanded_m)
    behind_m, limit_m = loop.commanded_m - from_m, loop.settings.max_lead_m
    if behind_m > limit_m:
        raise RequestError(
            f"the measured position is {behind_m * 1e3:.2f} mm behind the last target, "
            f"limit {limit_m * 1e3:.2f} mm: left to the controller's own target"
        )
    started_s = time.monotonic()
    loop.muted = False
    gone_m = 0.0
    while gone_m < distance_m:
        gone_m = min(distance_m, (time.monotonic() - started_s) * speed_m_s)
        loop.follow(from_m - gone_m)
        known = loop.state
        while loop.state is known:
            if not can_move(known):
                raise RequestError("the control program does not run, or the arm was stopped")
            if loop.requests:
                raise RequestError("given up for another request")
            loop.received_s = time.monotonic()
            loop.step()
    return from_m
