"""A Universal Robots arm (CB3, e-Series) as one position-controlled axis along an approach line."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Mapping
from typing import Any, ClassVar

from stepload.errors import DeviceError
from stepload.rig.device import Arm, ArmConfiguration, Health, Identity, StopProof
from stepload.rig.faults import TAKEN_OVER, Fault, FaultCode
from stepload.rig.samples import ArmSample, Status
from stepload_drivers.motion import (
    NO_SHIFT,
    Shift,
    require_finite_target,
    require_positive,
    require_shift,
)
from stepload_drivers.ur import dashboard_watch, direct_control, state, wire
from stepload_drivers.ur.direct_control import Unloading
from stepload_drivers.ur.last_state import LastState, Reach
from stepload_drivers.ur.preflight import preflight
from stepload_drivers.ur.process import ChildProcess, end_of
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import PacketCounter

CONNECTION_LOST = frozenset(
    {
        FaultCode.STALE,
        FaultCode.NOT_CONNECTED,
        FaultCode.NOT_FINITE,
        FaultCode.OUT_OF_RANGE,
        FaultCode.CLOCK,
        FaultCode.DRIVER,
    }
)
"""Faults after which no message of the child is trusted: it is killed."""

PROGRAM_ENDED = TAKEN_OVER | {FaultCode.WATCHDOG_STOP}
"""Faults after which no target can reach the arm, or none may."""

RESCUE_S = 1.0
_log = logging.getLogger(__name__)
WHY_S = 0.5
"""Time limit longer than the child needs to ask the dashboard why the program does not run."""


class UrArm(Arm):
    """ur_rtde in a child process, guarded from outside.

    Travel is measured from the TCP pose at `open` along `approach`; the orientation is kept.
    `wrench` is the controller's own, in the pressing frame, and `force_n` its component along the
    approach: a second channel of about ±10 N in each component.
    """

    OPTIONS: ClassVar[type] = Settings
    SETTINGS_AT: ClassVar[Mapping[str, str]] = {
        "tcp_offset": "the pendant: Installation, General, TCP",
        "payload_kg": "the pendant: Installation, General, Payload",
        "speed_fraction": "the foot of the pendant's screen",
        "safety": "they stand on the pendant under Installation, Safety (Robot Limits, Planes)",
    }
    has_force = has_wrench = True
    can_shift = True

    def __init__(self, **options: Any) -> None:
        self._settings = Settings(**options)
        self._axes = state.pressing_axes(self._settings.approach)
        self._child: ChildProcess | None = None
        self._loaded = ""
        self._number = 0
        self._sent_s = 0.0
        self._begin(0.002)

    def _begin(self, period_s: float) -> None:
        """Know nothing of the arm but its control period."""
        self.period_s = period_s
        self._tally = PacketCounter(period_s)
        self._samples: list[ArmSample] = []
        self._start: state.Vector6 | None = None
        self._target_m = 0.0
        self._shift_m = NO_SHIFT
        self._last: ArmSample | None = None
        self._configuration: ArmConfiguration | None = None
        self._fault: Fault | None = None
        self._unloading: Unloading | None = None
        self._reach = Reach(self._settings)
        self._fault_logged = self._opened = False
        self._stage = ""
        self._replies: dict[int, dict[str, Any]] = {}

    def open(self, timeout_s: float) -> Identity:
        self.close()
        deadline_s = time.monotonic() + timeout_s
        controller = preflight(self._settings, deadline_s)
        self._begin(controller.period_s)
        left_s = max(0.1, deadline_s - time.monotonic())
        self._child = ChildProcess(self._settings, self.period_s, left_s)
        try:
            self._wait_for_first_sample(deadline_s, timeout_s)
        except BaseException:  # an interrupt too must not leave a child behind
            self._kill()
            raise
        self._loaded = dashboard_watch.loaded_program(self._settings.host)
        self._opened = True
        _log.info(
            "%s: open, %s, serial number %s, %s, period %g s, %s",
            self._settings.host, controller.model, controller.serial_number, controller.firmware,
            self.period_s, self._configuration,
        )  # fmt: skip
        return Identity(
            driver="ur",
            model=controller.model or "unknown",
            serial_number=controller.serial_number or "unknown",
            firmware=controller.firmware,
            calibration_revision="unknown",
        )

    def _wait_for_first_sample(self, deadline_s: float, timeout_s: float) -> None:
        stage = ""
        while self._last is None:
            self._pump(min(0.05, max(0.001, deadline_s - time.monotonic())))
            if self._stage != stage:
                stage = self._stage
                _log.debug("%s: opening, %s", self._settings.host, stage)
            if self._last is None and time.monotonic() > deadline_s:
                self._latch(
                    FaultCode.NOT_CONNECTED,
                    f"{self._settings.host}: not ready within {timeout_s:g} s "
                    f"(got as far as: {self._stage or 'start of the process'})",
                    "check the pendant for messages, and the network",
                )
            if (fault := self._fault) is not None:
                self._log_fault()
                raise fault.error()

    def drain(self) -> list[ArmSample]:
        self._pump()
        samples, self._samples = self._samples, []
        return samples

    def command(self, position_m: float, shift_m: Shift = NO_SHIFT) -> None:
        require_finite_target(position_m)
        self._require_shift(shift_m)
        self._pump()
        if self._fault is not None and self._fault.code in PROGRAM_ENDED:
            raise self._gone()
        from_m = min(self._last.position_m, self._target_m) if self._last else self._target_m
        lead_m = position_m - from_m
        if lead_m > self._settings.max_lead_m:
            raise DeviceError(
                f"position target {lead_m * 1e3:.2f} mm ahead of the arm or of its last target, "
                f"limit {self._settings.max_lead_m * 1e3:.2f} mm",
                code=FaultCode.OUT_OF_RANGE,
                hint="approach in smaller steps, or raise the option max_lead",
            )
        if not self._send(wire.pack_target(position_m, shift_m)):
            self._pump()
            raise self._gone()
        self._target_m, self._shift_m = position_m, shift_m
        self._reach.sent(position_m, self._sent_s)

    def _require_shift(self, shift_m: Shift) -> None:
        """A shift must be near the last one, and a new one near the arm's position."""
        lead_m = self._settings.max_lead_m
        require_shift(shift_m, self._shift_m, lead_m)
        if shift_m != self._shift_m and self._last is not None and self._start is not None:
            at_m = state.shift_of(self._last.pose, self._start, self._settings.approach)
            require_shift(shift_m, at_m, lead_m)

    def configuration(self) -> ArmConfiguration | None:
        """Configuration last reported by the controller, at most 0.1 s before the newest sample."""
        self._pump()
        return self._configuration

    def held_m(self) -> float:
        """Position by the controller's own target pose; as old as `configuration`."""
        told = self.configuration()
        if told is None or told.held_pose is None or self._start is None:
            return math.nan
        return state.travel_m(told.held_pose, self._start, self._settings.approach)

    def health(self) -> Health:
        self._pump()
        return self._tally.health(time.monotonic())

    def fault(self) -> Fault | None:
        self._pump()
        return self._fault

    def safe(self, timeout_s: float) -> None:
        deadline_s = time.monotonic() + timeout_s
        self._log_fault()
        if self._child is not None:
            reply = self._request("safe", min(0.6 * timeout_s, 2.5))
            if reply is not None and reply["ok"]:
                stopped = reply["runtime_state"] not in (state.PLAYING, state.PAUSED)
                if reply["confirmed"] or stopped:
                    return
            if reply is None or not reply["ok"]:
                self._kill()
        unloading = self._unloading
        if unloading is not None and not unloading.ended(deadline_s - 0.3 * timeout_s):
            raise DeviceError(
                "no stop was sent: it would cancel the retract that was handed over "
                f"{unloading.age_s:.1f} s ago and was not seen to end; it ends by itself, and may "
                "begin only when the controller answers again",
                code=FaultCode.NOT_CONNECTED,
                hint="keep clear of the arm; use the emergency stop before anybody goes near it",
            )
        direct_control.stop(self._settings.host, deadline_s)

    def retract(self, distance_m: float, speed_m_s: float, timeout_s: float) -> None:
        require_positive("retract", distance_m=distance_m, speed_m_s=speed_m_s, timeout_s=timeout_s)
        self._log_fault()
        deadline_s = time.monotonic() + timeout_s
        self._pump()
        self._refuse_if_taken_over()
        if self._child is not None:
            limit_s = max(0.5 * timeout_s, timeout_s - RESCUE_S)
            self._reach.requested_back(distance_m)
            reply = self._request("retract", limit_s, distance_m=distance_m, speed_m_s=speed_m_s)
            if reply is not None and reply["ok"]:
                self._reach.arrived()
                return
            self._hear_who_stopped_it()
            self._refuse_if_taken_over()
            self._kill()
        self._unloading = self._unloading or Unloading(self._settings, self._last_seen())
        self._unloading.retract(distance_m, speed_m_s, deadline_s)

    def _last_seen(self) -> LastState:
        last = self._last
        band = self._reach.after(last) if last else (0.0, 0.0)
        return LastState(self._settings, last, band, self._configuration, self._loaded)

    def _hear_who_stopped_it(self) -> None:
        """Give the child time to ask why the program does not run: a person may have ended it."""
        until_s = time.monotonic() + WHY_S
        while self._last is not None and self._last.status and self._fault is None:
            if self._child is None or time.monotonic() > until_s:
                return
            self._pump(0.02)

    def _refuse_if_taken_over(self) -> None:
        """Refuse a motion after a person or a safety system has taken over."""
        fault = self._fault
        if fault is not None and fault.code in TAKEN_OVER:
            raise fault.error("no retract was sent: ")

    def prove_stop(self, distance_m: float, speed_m_s: float, timeout_s: float) -> StopProof:
        """Move slowly away from the plate, stop sending, and check that the arm stops by itself.

        For free air only. The program is started and the watchdog armed again afterwards.

        Raises:
            DeviceError: the arm did not stop by itself, or could not be started again; it was
                stopped.
        """
        require_positive(
            "prove_stop", distance_m=distance_m, speed_m_s=speed_m_s, timeout_s=timeout_s
        )
        self._reach.requested_back(distance_m)
        reply = self._request("prove", timeout_s, distance_m=distance_m, speed_m_s=speed_m_s)
        if reply is None or not reply["ok"]:
            why = reply["message"] if reply else f"no answer within {timeout_s:g} s"
            self._kill()
            direct_control.stop(self._settings.host, time.monotonic() + RESCUE_S)
            raise DeviceError(
                f"the stop of the arm's watchdog is not proven: {why}",
                code=FaultCode.REFUSED_COMMAND,
                hint="do not run; see the pendant's log",
            )
        self._reach.arrived()
        return StopProof(reply["stop_s"], reply["still_s"], reply["travel_m"])

    def close(self) -> None:
        self._log_fault()
        if self._child is not None:
            self._child.quit()
            self._child = None
        if self._opened:
            self._opened = False
            _log.info("%s: closed, %s", self._settings.host, self._tally.health(time.monotonic()))
        if self._unloading is not None:
            self._unloading.close()

    # the child's messages

    def _pump(self, wait_s: float = 0.0) -> None:
        """Process all messages, send the child a sign of life, detect its silence or end."""
        if self._child is None:
            return
        for message in self._child.receive(wait_s):
            self._take(message)
        if self._child.ended:
            if self._fault is None:
                self._latch(*end_of(self._child.last_words()))
            self._kill()
            return
        now_s = time.monotonic()
        if self._last is not None:
            age_s = now_s - self._last.receive_time_s
            if age_s > self._settings.max_age_s:
                self._latch(
                    FaultCode.STALE,
                    f"no new sample for {age_s * 1e3:.0f} ms, "
                    f"limit {self._settings.max_age_s * 1e3:.0f} ms",
                    "check cable, switch and the load of this computer",
                )
        if self._fault is not None and self._fault.code in CONNECTION_LOST:
            self._kill()
        elif now_s - self._sent_s > 0.2 * self._settings.command_timeout_s:
            self._send(wire.BEAT)

    def _take(self, message: bytes) -> None:
        kind = message[:1]
        if kind == wire.SAMPLE:
            if self._start is not None:
                self._take_sample(*wire.unpack_sample(message))
            return
        if kind == wire.CONFIGURATION:
            self._configuration = wire.unpack_configuration(message)
            return
        fields = wire.unpack_json(message)
        if kind == wire.HELLO:
            x, y, z, rx, ry, rz = fields["start"]
            self._start = (x, y, z, rx, ry, rz)
        elif kind == wire.STAGE:
            self._stage = fields["name"]
        elif kind == wire.REPLY:
            self._replies[fields["number"]] = fields
        elif kind == wire.FAULT and self._fault is None:
            self._fault = Fault(
                FaultCode(fields["code"]), fields["message"], fields["hint"], fields["time_s"]
            )

    def _take_sample(self, receive_time_s: float, package: state.UrState) -> None:
        assert self._start is not None
        settings = self._settings
        wrench = state.pressing_wrench(package.wrench, self._axes, settings.wrench_sign)
        self._last = ArmSample(
            sequence=self._tally.add(package.timestamp_s, receive_time_s),
            device_time_s=package.timestamp_s,
            receive_time_s=receive_time_s,
            status=0 if state.can_move(package) else int(Status.STOPPED),
            position_m=state.travel_m(package.pose, self._start, settings.approach),
            force_n=wrench[2],
            pose=package.pose,
            wrench=wrench,
        )
        self._samples.append(self._last)

    def _latch(self, code: FaultCode, message: str, hint: str) -> None:
        if self._fault is None:
            self._fault = Fault(code, message, hint, time.monotonic())

    def _log_fault(self) -> None:
        """Log the fault once; not where it is found, for that may be a tick."""
        fault = self._fault
        if fault is not None and not self._fault_logged:
            self._fault_logged = True
            host, code = self._settings.host, fault.code.value
            _log.warning("%s: fault %s: %s (%s)", host, code, fault.message, fault.hint)

    def _send(self, message: bytes) -> bool:
        self._sent_s = time.monotonic()
        return self._child is not None and self._child.send(message)

    def _request(self, op: str, timeout_s: float, **fields: float) -> dict[str, Any] | None:
        """The child's reply, None when there is none in time."""
        self._number += 1
        number = self._number
        self._pump()
        if not self._send(wire.pack_json(wire.REQUEST, op=op, number=number, **fields)):
            return None
        until_s = time.monotonic() + timeout_s
        while self._child is not None and time.monotonic() < until_s:
            self._pump(min(0.02, max(0.001, until_s - time.monotonic())))
            if number in self._replies:
                reply = self._replies.pop(number)
                _log.debug("%s: %s %s -> %s", self._settings.host, op, fields, reply)
                return reply
        _log.debug("%s: %s %s -> no answer", self._settings.host, op, fields)
        return None

    def _gone(self) -> DeviceError:
        if self._fault is not None:
            return self._fault.error("position target not sent: ")
        return DeviceError(
            "position target not sent: the arm is not open",
            code=FaultCode.NOT_CONNECTED,
            hint="open the arm first",
        )

    def _kill(self) -> None:
        if self._child is not None:
            self._child.kill()
            self._child = None
