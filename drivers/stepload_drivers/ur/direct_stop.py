"""Stop without ur_rtde, and the program that retracts, for when the child is dead or not trusted.

A new ur_rtde would need two TCP handshakes, 23 recipes, a 42 kB upload and a working data stream
before its first command, and its constructor can hang. A dashboard line, or a program of four lines
on a script port, needs one TCP connection; it replaces the program that runs, and starts from the
controller's own target pose: no measured position, right or wrong, can lead it towards the surface.
RTDE is read only to confirm.
"""

from __future__ import annotations

import contextlib
import time

from stepload.errors import DeviceError
from stepload_drivers.ur.client import RtdeClient, dashboard, send_script
from stepload_drivers.ur.state import PLAYING, UrState

DECELERATION_M_S2 = 2.0
ACCELERATION_M_S2 = 0.2
STILL_M = 2e-5
STILL_PACKAGES = 5
ASK_LIMIT_S = 0.5
IDLE_LIMIT_S = 1.0
"""Time without a running program after which ours was not started, or has ended."""

STOP_SCRIPT = f"def stepload_stop():\n  stopl({DECELERATION_M_S2})\nend\n"


def retract_script(
    approach: tuple[float, float, float], distance_m: float, speed_m_s: float
) -> str:
    """URScript: stop, then straight back along the approach axis from where the target stopped."""
    step = ", ".join(f"{-component * distance_m:.9f}" for component in approach)
    return (
        "def stepload_retract():\n"
        f"  stopl({DECELERATION_M_S2})\n"
        f"  movel(pose_add(get_target_tcp_pose(), p[{step}, 0, 0, 0]), "
        f"a={ACCELERATION_M_S2}, v={speed_m_s:.6f})\n"
        "end\n"
    )


def stop(host: str, deadline_s: float) -> None:
    """End the running program; by dashboard, else by script. Always sends.

    Raises:
        DeviceError: neither way was confirmed by `deadline_s`.
    """
    try:
        replies = dashboard(host, ["stop", "running"], soon(deadline_s))
        if replies[0] == "Stopped" and replies[1].lower().endswith("false"):
            return
    except DeviceError:
        pass
    send_script(host, STOP_SCRIPT, deadline_s)
    with contextlib.closing(RtdeClient(host, deadline_s)) as rtde:
        _wait_still(rtde)


def soon(deadline_s: float) -> float:
    """The end of the time for a question, at the latest `deadline_s`."""
    return min(deadline_s, time.monotonic() + ASK_LIMIT_S)


def started(rtde: RtdeClient) -> UrState:
    """Let the controller send; the first package."""
    rtde.version()
    rtde.start(125.0)
    return rtde.read()


def _wait_still(rtde: RtdeClient) -> None:
    still, last = 0, started(rtde)
    while still < STILL_PACKAGES:
        package = rtde.read()
        moved_m = max(abs(a - b) for a, b in zip(package.pose[:3], last.pose[:3], strict=True))
        still = still + 1 if moved_m < STILL_M and package.runtime_state != PLAYING else 0
        last = package
