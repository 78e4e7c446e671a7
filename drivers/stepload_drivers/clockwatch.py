"""Does a device's clock keep pace with the host's?"""

from __future__ import annotations

from typing import Any

from stepload.rig.faults import FaultCode
from stepload_drivers.stream import Stream

SHARE = 0.01
SLACK_S = 0.5
JUMP_S = 2.0
"""A step of the device's clock from one sample to the next that only a restart explains."""


class ClockWatch:
    """Latches `clock` when the two clocks part by more than the slack and 1 % of the time.

    Args:
        name: the device, for messages.
        slack_s: how late samples may come, at least 0.5 s.
    """

    def __init__(self, name: str, slack_s: float) -> None:
        self._name = name
        self._slack_s = max(SLACK_S, slack_s)
        self._start: tuple[float, float] | None = None

    def look(self, device_s: float, host_s: float, stream: Stream[Any]) -> None:
        """Compare the newest sample's device time with the host's time of its arrival."""
        if self._start is None:
            self._start = (device_s, host_s)
        device_s, host_s = device_s - self._start[0], host_s - self._start[1]
        limit_s = self._slack_s + SHARE * host_s
        if abs(device_s - host_s) > limit_s:
            stream.latch(
                FaultCode.CLOCK,
                f"{self._name}: its clock counts {device_s:.3f} s while the host counts "
                f"{host_s:.3f} s (limit ± {limit_s:.3f} s)",
                "the host reads too slowly, or the sensor's clock is wrong",
            )
