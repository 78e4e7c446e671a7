"""Why the control program does not run, or who has taken over: as far as can be told."""

from __future__ import annotations

from stepload.rig.faults import FaultCode
from stepload_drivers.ur.state import Problem, UrState

PAUSING = (3, 4)
"""Values of `runtime_state` while a program is being paused, or is."""

_REMOTE_HINT = "when the operator is done: switch the pendant to remote control, then start anew"


def local_control(*, program_runs: bool) -> Problem:
    """Somebody has switched the pendant to local control."""
    program = "the program still runs" if program_runs else "our program runs no more"
    return Problem(
        FaultCode.NOT_REMOTE,
        f"somebody at the pendant switched the controller to local control; {program}",
        _REMOTE_HINT,
    )


def stopped(state: UrState, *, remote: bool | None, silent_s: float, leash_s: float) -> Problem:
    """Why the program does not run.

    Args:
        state: the newest package; no safety stop is in force.
        remote: whether the controller is in remote control; None where it does not say.
        silent_s: how long nothing has come from the run.
        leash_s: silence after which the program is left to its watchdog.
    """
    if remote is False:
        return local_control(program_runs=False)
    if state.runtime_state in PAUSING:
        cause = "somebody paused it at the pendant, or a program over the dashboard"
    elif silent_s > leash_s:
        cause = f"its watchdog stopped it: nothing came from the run for {silent_s * 1e3:.0f} ms"
    else:
        cause = (
            "stopped from the pendant or dashboard, replaced by another program, or stopped by its "
            "watchdog because our inputs did not arrive"
        )
    return Problem(
        FaultCode.PROGRAM_STOPPED,
        "the control program on the controller does not run "
        f"(runtime_state {state.runtime_state}): {cause}",
        "see the pendant's log; then start anew",
    )
