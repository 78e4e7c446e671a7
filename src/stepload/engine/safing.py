"""Makes the rig safe at the end of every run, whatever ended it: the arm first, and always sent.

Each action runs in its own thread with its own deadline, so that a device that hangs cannot keep
the next one from being sent; a thread that does not return is abandoned and reported. (A timer
signal would need the main thread and cannot interrupt a call that does not return to Python; a
child process could not reach a driver's open connection.) All actions run, all errors are kept.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from signal import Signals

from stepload.engine.operator import Operator, StopLevel
from stepload.errors import in_words
from stepload.record.outcome import ActionResult, Cause

POLL_S = 0.02
ELSEWHERE_M = 1e-4
"""An arm this far from its start pose stands elsewhere: the next run would begin there."""


@dataclass(frozen=True, slots=True)
class Action:
    """One step of safing; `arm` marks those that the third Ctrl+C does not skip."""

    name: str
    call: Callable[[], object]
    deadline_s: float
    arm: bool = False


def make_safe(actions: list[Action], operator: Operator) -> tuple[ActionResult, ...]:
    """Run the actions in order, the arm's first; never raises.

    The third Ctrl+C skips what is not the arm's, also while it is being waited for.
    """
    ordered = sorted(actions, key=lambda action: not action.arm)
    return tuple(_run(action, operator) for action in ordered)


def _run(action: Action, operator: Operator) -> ActionResult:
    start_s = time.monotonic()
    if not action.arm and operator.stop_level >= StopLevel.ARM_ONLY:
        return ActionResult(action.name, False, "skipped on the operator's request", start_s, 0.0)
    errors: list[str] = []

    def call() -> None:
        try:
            action.call()
        except BaseException as error:  # whatever it is, the next action must run
            errors.append(in_words(error))

    worker = threading.Thread(target=call, name=f"safing {action.name}", daemon=True)
    try:
        worker.start()
    except RuntimeError:  # no thread: better to hang in the arm's stop than not to send it
        call()
    end_s = start_s + action.deadline_s
    while worker.is_alive() and time.monotonic() < end_s:
        worker.join(POLL_S)
        if not action.arm and operator.stop_level >= StopLevel.ARM_ONLY:
            break
    duration_s = time.monotonic() - start_s
    if worker.is_alive():
        error = f"no answer within {duration_s:.2f} s; sent, and left behind"
        return ActionResult(action.name, True, error, start_s, duration_s)
    return ActionResult(action.name, True, "; ".join(errors), start_s, duration_s)


def stop_notice(cause: Cause | None, start_s: float) -> str:
    """What the operator reads in the moment of a stop; `start_s` counts as zero."""
    if cause is None:
        return "STOPPING on request: the arm retracts. Use the emergency stop if it does not."
    if cause.planned:
        return (
            f"ENDING at {cause.time_s - start_s:.3f} s, as the plan asks ({cause.rule}): "
            f"{cause.message}. The arm retracts. Use the emergency stop if it does not."
        )
    return (
        f"STOPPED by {cause.rule} at {cause.time_s - start_s:.3f} s: {cause.message}"
        f"{cause.numbers}. USE THE EMERGENCY STOP if the arm presses on."
    )


def why_it_stopped(
    status: str,
    cause: Cause | None,
    retracted: bool,
    still_closed: str,
    outcomes: tuple[ActionResult, ...],
    start_s: float,
    loop_end_s: float,
    signal_number: int = 0,
    stands_m: float = 0.0,
    turned: str = "",
) -> str:
    """One paragraph: what triggered, its value and limit, what safing did and when.

    `still_closed` says why the contact cannot be said to be open after the retract. `start_s`
    is the time on the run's clock that counts as zero, `loop_end_s` when the loop ended,
    `signal_number` the first signal that asked for the end, 0 for none. `turned` says why the
    way back was wrong, "" where it was not. `stands_m` is how far the target is from where it
    began: no run leads the arm back. It is told of an arm that is known to be there, and
    clear.
    """
    text = first_sentence(status, cause, start_s, signal_number)
    if turned and turned not in text:
        text += f" In the retract {turned}."
    if status != "completed":
        text += _retract_told(retracted, still_closed, loop_end_s - start_s, bool(turned))
    if retracted and not still_closed and abs(stands_m) >= ELSEWHERE_M:
        text += (
            f" The arm is {abs(stands_m) * 1e3:.3g} mm {'past' if stands_m > 0.0 else 'behind'} its"
            " start pose. Move it back before the next run."
        )
    begun_s = outcomes[0].start_s if outcomes else 0.0
    for outcome in (each for each in outcomes if each.error):
        text += f" Safing, {outcome.name}: {outcome.error} "
        text += f"({(outcome.start_s - begun_s) * 1e3:+.0f} ms, took"
        text += f" {outcome.duration_s * 1e3:.0f} ms)."
    return text


def first_sentence(status: str, cause: Cause | None, start_s: float, signal_number: int) -> str:
    """How a run ended, without what the arm did then; arguments as of `why_it_stopped`."""
    if cause is None and status == "completed":
        return "The run was completed."
    if cause is None:
        requested = f" ({Signals(signal_number).name})" if signal_number else ""
        return f"The run was interrupted on the operator's request{requested}."
    requested = ", as its plan asks" if cause.planned else ""
    at = f"{cause.time_s - start_s:.3f} s"
    says = f"{cause.message}{cause.numbers}"
    return f"The run was stopped by {cause.rule} at {at}{requested}: {says}."


def _retract_told(retracted: bool, still_closed: str, end_s: float, turned: bool) -> str:
    if not retracted:
        return " No retract is confirmed."
    told = " The arm went to the least force" if turned else " The arm drew back"
    if still_closed:
        return f"{told} until {end_s:.1f} s; {still_closed}."
    return f"{told} and was clear at {end_s:.1f} s."
