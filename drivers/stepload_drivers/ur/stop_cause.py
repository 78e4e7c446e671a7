"""Why the control program does not run, or who has taken control, as far as can be determined."""

from __future__ import annotations

from stepload.rig.faults import FaultCode
from stepload_drivers.ur.state import Problem, UrState

PAUSING = (3, 4)
"""Values of `runtime_state` while a program is being paused, or is."""

WATCHDOG_SHARE = 0.9
"""Share of its time without our input after which a stop is attributed to the watchdog."""

_REMOTE_HINT = "when the operator is done: switch the pendant to remote control, then start anew"


def local_control(*, program_runs: bool) -> Problem:
    """The pendant was switched to local control."""
    program = "the program still runs" if program_runs else "our program runs no more"
    return Problem(
        FaultCode.NOT_REMOTE,
        f"somebody at the pendant switched the controller to local control; {program}",
        _REMOTE_HINT,
    )


def stopped(state: UrState, *, remote: bool | None, unsent_s: float, watchdog_s: float) -> Problem:
    """Why the program does not run; no motion is allowed unless the watchdog certainly ended it.

    Args:
        state: the newest package; no safety stop is in force.
        remote: whether the controller is in remote control; None where it does not report it.
        unsent_s: time without sending when the end of the program was detected.
        watchdog_s: time of the controller's watchdog.
    """
    if remote is False:
        return local_control(program_runs=False)
    what = (
        f"the control program on the controller does not run (runtime_state {state.runtime_state})"
    )
    paused = state.runtime_state in PAUSING
    if unsent_s >= WATCHDOG_SHARE * watchdog_s and not paused:
        return Problem(
            FaultCode.WATCHDOG_STOP,
            f"{what}: its watchdog stopped it, nothing was sent for {unsent_s * 1e3:.0f} ms",
            "check the load of this computer, and the leash; then start anew",
        )
    if paused:
        cause = "somebody paused it at the pendant, or a program over the dashboard"
    else:
        cause = (
            "stopped from the pendant or dashboard, replaced by another program, or stopped by its "
            "watchdog because our inputs did not arrive"
        )
    return Problem(
        FaultCode.PROGRAM_STOPPED,
        f"{what}: {cause}",
        "nothing moves the arm now: move it clear on the pendant, see its log, then start anew",
    )
