"""Stop and retract without ur_rtde, for when the child process is dead or not to be trusted.

A new ur_rtde would need two TCP handshakes, 23 recipes, a 42 kB upload and a working data stream
before its first command, and its constructor can hang. A dashboard line, or a program of four lines
on a script port, needs one TCP connection; it replaces the program that runs, and starts from the
controller's own target pose: no measured position, right or wrong, can lead it towards the surface.
RTDE is read only to confirm.
"""

from __future__ import annotations

import time

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur.client import RtdeClient, dashboard, send_script
from stepload_drivers.ur.preflight import in_remote_control, not_remote
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PLAYING, Vector6, arrived_m, safety_problem, travel_m

DECELERATION_M_S2 = 2.0
ACCELERATION_M_S2 = 0.2
STILL_M = 2e-5
STILL_PACKAGES = 5
ASK_LIMIT_S = 0.5
START_S = 0.5
"""From a program's upload to its motion, at the most."""
BLIND = frozenset(
    {
        FaultCode.NOT_CONNECTED,
        FaultCode.CORRUPT,
        FaultCode.NOT_FINITE,
        FaultCode.OUT_OF_RANGE,
    }
)
IDLE_LIMIT_S = 1.0
"""No program running for so long: ours has not been started, or has ended."""

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
    """End whatever program runs; by dashboard, else by script. Always sends.

    Raises:
        DeviceError: neither way was confirmed by `deadline_s`.
    """
    try:
        replies = dashboard(host, ["stop", "running"], _within(deadline_s, ASK_LIMIT_S))
        if replies[0] == "Stopped" and replies[1].lower().endswith("false"):
            return
    except DeviceError:
        pass
    send_script(host, STOP_SCRIPT, deadline_s)
    with RtdeClient(host, deadline_s) as rtde:
        rtde.version()
        rtde.start(125.0)
        _wait_still(rtde)


def retract(settings: Settings, distance_m: float, speed_m_s: float, deadline_s: float) -> None:
    """Stop and move back by `distance_m`, and see it done. Always sends.

    Raises:
        DeviceError: not confirmed by `deadline_s`; the code tells why where the controller says.
    """
    host = settings.host
    start = _pose(host, _within(deadline_s, ASK_LIMIT_S))
    send_script(host, retract_script(settings.approach, distance_m, speed_m_s), deadline_s)
    done_s = min(deadline_s, time.monotonic() + START_S + ramp_s(distance_m, speed_m_s))
    try:
        back_m = _watch_retract(settings, start, distance_m, deadline_s)
    except DeviceError as error:
        if error.code in BLIND:  # nobody sees whether the arm moves: let it, before it is stopped
            time.sleep(max(0.0, done_s - time.monotonic()))
        raise
    if back_m >= arrived_m(distance_m):
        return
    if in_remote_control(host, ASK_LIMIT_S) is False:
        raise not_remote(host)
    raise DeviceError(
        f"retract ended {back_m * 1e3:.2f} mm back, {distance_m * 1e3:.2f} mm were asked for",
        code=FaultCode.REFUSED_COMMAND,
        hint="the arm has stopped; move it clear by hand on the pendant",
    )


def ramp_s(distance_m: float, speed_m_s: float) -> float:
    """Time that the retract takes: the way at full speed, and one acceleration."""
    return distance_m / speed_m_s + speed_m_s / ACCELERATION_M_S2


def _watch_retract(
    settings: Settings, start: Vector6 | None, distance_m: float, deadline_s: float
) -> float:
    """How far back the arm is once it has arrived, or no program has run for a while."""
    back_m = 0.0
    with RtdeClient(settings.host, deadline_s) as rtde:
        rtde.version()
        rtde.start(125.0)
        idle_since_s = time.monotonic()
        while time.monotonic() - idle_since_s < IDLE_LIMIT_S:
            package = rtde.read()
            if problem := safety_problem(package):
                raise DeviceError(
                    f"retract not possible: {problem.message}",
                    code=problem.code,
                    hint=problem.hint,
                )
            if start is None:
                start = package.pose
            back_m = -travel_m(package.pose, start, settings.approach)
            if package.runtime_state == PLAYING:
                idle_since_s = time.monotonic()
            elif back_m >= arrived_m(distance_m):
                break
    return back_m


def _within(deadline_s: float, limit_s: float) -> float:
    return min(deadline_s, time.monotonic() + limit_s)


def _pose(host: str, deadline_s: float) -> Vector6 | None:
    try:
        with RtdeClient(host, deadline_s) as rtde:
            rtde.version()
            rtde.start(125.0)
            return rtde.read().pose
    except DeviceError:
        return None


def _wait_still(rtde: RtdeClient) -> None:
    still, last = 0, rtde.read()
    while still < STILL_PACKAGES:
        package = rtde.read()
        moved_m = max(abs(a - b) for a, b in zip(package.pose[:3], last.pose[:3], strict=True))
        still = still + 1 if moved_m < STILL_M and package.runtime_state != PLAYING else 0
        last = package
