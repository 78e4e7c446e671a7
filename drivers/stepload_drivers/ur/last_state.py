"""The last known state of the arm before an outage, and what it can have done by itself since.

A larger distance, another orientation, posture or setting, or a new program after the outage shows
that a person has intervened.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

from stepload.rig.device import ArmConfiguration
from stepload.rig.samples import ArmSample
from stepload_drivers.ur.configuration import change, tcp_changed
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PLAYING, UrState, Vector6, travel_m

SETTLED_M = 3e-4
"""Shift allowed for stopping and holding: three times the worst repeatability stated by UR."""
TURNED_RAD = 5e-3
BENT_RAD = 0.1
"""A reach of 2 mm at a lever of 20 mm. Where the TCP of the options ended with our program, no pose
can be compared: then only the joints show that the arm was moved."""

Band = tuple[float, float]
"""Lowest and highest travel along the approach, in m, counted from the position last seen."""


class Reach:
    """How far the targets that were sent can still take the arm after its last package.

    The controller's program follows the newest target with its look-ahead and repeats it until its
    watchdog ends it, 1/`watchdog` after the last input; a target that is on its way for longer
    finds no program. So the arm comes to rest between the position last seen and the outermost of
    the targets sent since one look-ahead and one watchdog's time before. At a commanded speed v
    that is at most v · (look-ahead + 1/`watchdog` + age of the package), and ahead never more than
    `max_lead`; an arm that stood still when the link was lost has no reach at all.
    """

    def __init__(self, settings: Settings) -> None:
        self._before_s = settings.lookahead_s + 1.0 / settings.watchdog_hz
        self._kept_s = self._before_s + settings.max_age_s + settings.command_timeout_s
        self._targets: deque[tuple[float, float]] = deque()
        self._back_m = 0.0

    def sent(self, position_m: float, now_s: float) -> None:
        """A target was sent."""
        self._targets.append((now_s, position_m))
        while self._targets[0][0] < now_s - self._kept_s:
            self._targets.popleft()

    def requested_back(self, distance_m: float) -> None:
        """The child was asked to move the arm back by a distance; `arrived` when it is done."""
        self._back_m = distance_m

    def arrived(self) -> None:
        """The arm stands still at its last known position, and follows no target."""
        self._targets.clear()
        self._back_m = 0.0

    def after(self, last: ArmSample) -> Band:
        """Range in which the arm can come to rest after its `last` sample."""
        since_s = last.receive_time_s - self._before_s
        targets_m = [to_m for sent_s, to_m in self._targets if sent_s >= since_s]
        targets_m += [to_m for _, to_m in list(self._targets)[-1:]]  # repeated until the end
        ways_m = [0.0, *(to_m - last.position_m for to_m in targets_m)]
        return min(ways_m) - self._back_m, max(ways_m)


class LastState:
    """Compares the last known state of the arm with the present one.

    Args:
        settings: of the driver.
        sample: the newest sample, None where there was none.
        band: from `Reach.after`.
        configuration: as last reported, None where it was not.
        loaded: the program loaded according to the dashboard, "" where it was not asked.
    """

    def __init__(
        self,
        settings: Settings,
        sample: ArmSample | None,
        band: Band = (0.0, 0.0),
        configuration: ArmConfiguration | None = None,
        loaded: str = "",
    ) -> None:
        self.pose: Vector6 | None = sample.pose if sample else None
        self.configuration = configuration
        self.loaded = loaded
        self._settings = settings
        self._low_m, self._high_m = band
        self._stamp_s = sample.device_time_s if sample else -math.inf

    def take(self, package: UrState) -> None:
        """Record the present state as the last known one."""
        went_m = self._went_m(package)
        self._low_m, self._high_m = (0.0, 0.0) if package.runtime_state != PLAYING else (
            min(0.0, self._low_m - went_m), max(0.0, self._high_m - went_m)
        )  # fmt: skip
        self.pose, self._stamp_s = package.pose, package.timestamp_s

    def sent_back(self, distance_m: float) -> None:
        """A retract was sent: the arm may go back by a distance."""
        self._low_m -= distance_m

    def moved(self, package: UrState, now: ArmConfiguration | None) -> str:
        """Changes that the arm cannot have made by itself; "" for none.

        Args:
            package: the newest package.
            now: the configuration reported now, None where it is not.
        """
        if package.timestamp_s < self._stamp_s:
            return "the controller was started anew"
        return self._set_otherwise(now) or self._bent(now) or self._away(package, now)

    def _went_m(self, package: UrState) -> float:
        if self.pose is None:
            return 0.0
        return travel_m(package.pose, self.pose, self._settings.approach)

    def _set_otherwise(self, now: ArmConfiguration | None) -> str:
        """Settings from the options may return to the installation's at the end of our program."""
        settings, before = self._settings, self.configuration
        if before is None or now is None:
            return ""
        if settings.tcp_offset_m is not None:
            before = replace(before, tcp_offset=None)
        if settings.payload_mass_kg is not None:
            before = replace(before, payload_kg=None, payload_cog_m=None)
        problem = change(before, now)
        return problem.message if problem else ""

    def _bent(self, now: ArmConfiguration | None) -> str:
        before = self.configuration
        if before is None or now is None or not before.joints_rad or not now.joints_rad:
            return ""
        pairs = zip(before.joints_rad, now.joints_rad, strict=True)
        bent_rad = max(abs(a - b) for a, b in pairs)
        return f"a joint is turned by {bent_rad:.2f} rad" if bent_rad > BENT_RAD else ""

    def _away(self, package: UrState, now: ArmConfiguration | None) -> str:
        if self.pose is None or tcp_changed(self.configuration, now):  # a pose of another point
            return ""
        went_m = self._went_m(package)
        aside_m = math.sqrt(max(0.0, math.dist(package.pose[:3], self.pose[:3]) ** 2 - went_m**2))
        beyond_m = max(self._low_m - went_m, went_m - self._high_m, 0.0)
        away_m = math.hypot(aside_m, beyond_m)
        if away_m > SETTLED_M:
            return (
                f"the arm stands {away_m * 1e3:.2f} mm from where it can have come by itself, "
                f"limit {SETTLED_M * 1e3:g} mm"
            )
        turned_rad = _angle_rad(package.pose, self.pose)
        if turned_rad > TURNED_RAD:
            return f"the tool is turned by {turned_rad:.3f} rad, limit {TURNED_RAD:g} rad"
        return ""


def _angle_rad(pose: Vector6, before: Vector6) -> float:
    """Angle between the orientations of two poses, whose rotations stand as rotation vectors."""
    quaternions = []
    for vector in (pose[3:], before[3:]):
        half_rad = 0.5 * math.hypot(*vector)
        scale = 0.5 * math.sin(half_rad) / half_rad if half_rad > 0.0 else 0.5
        quaternions.append((math.cos(half_rad), *(scale * part for part in vector)))
    one, other = quaternions
    apart = min(
        math.dist(one, other), math.dist(one, [-part for part in other])
    )  # a quaternion and its negative are one rotation
    return 4.0 * math.asin(min(1.0, 0.5 * apart))
