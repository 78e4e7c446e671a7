"""The whole examination of a rig, and the figures it offers for the rig file."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from stepload.engine.open_rig import OpenRig, opened
from stepload.engine.realtime import realtime_conditions
from stepload.errors import BadInputError, DeviceError
from stepload.feasibility.preflight import Preflight
from stepload.plan.model import ForceSpec, Plan
from stepload.rig.usb import MAX_LATENCY_MS, USB_SERIAL, latency_timer_ms
from stepload.setup import host, motion, streams
from stepload.setup.check_line import CheckLine, Mark, graded, without_number
from stepload.setup.streams import Watched, devices, watch
from stepload.setup.yaml_keys import Value, written
from stepload.units import format_quantity

Tell = Callable[[CheckLine], None]
SAFE_S = 3.0
LEAST_WATCH_S = 0.5
"""Below this a rate, a noise or a lateness says nothing."""
NEEDED_TO_MOVE = (
    "arm: data", "arm: status", "arm: longest age", "arm: held", "arm: stop", "arm: watchdog",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Checkup:
    """All lines, and the measured figures as YAML for the rig file ("" without any).

    `figures` are the same by key of the rig: value in SI, its unit, and how it was measured.
    """

    lines: tuple[CheckLine, ...]
    snippet: str
    figures: Mapping[tuple[str, ...], tuple[float, str, str]]

    @property
    def failed(self) -> bool:
        """Whether a line failed."""
        return any(line.mark is Mark.FAIL for line in self.lines)


class _Examination:
    def __init__(self, preflight: Preflight, tell: Tell) -> None:
        self.preflight = preflight
        self.plan = preflight.plan
        self.lines: list[CheckLine] = []
        self.figures: dict[tuple[str, ...], tuple[float, str, str]] = {}
        self._tell = tell

    def add(self, *lines: CheckLine) -> None:
        for line in lines:
            self.lines.append(line)
            self._tell(line)

    def failed(self, *names: str) -> bool:
        """Whether one of these lines has failed."""
        return any(line.mark is Mark.FAIL and line.name in names for line in self.lines)

    def offer(self, *path: str, value: float, unit: str, remark: str) -> None:
        """A measured figure at a key of the rig; 0 is none (a resolution hides it)."""
        if value > 0.0:
            self.figures[path] = (value, unit, remark)

    def snippet(self) -> str:
        """YAML below `rig:`; "" without a figure."""
        rows = {
            ".".join(("rig", *path)): Value(format_quantity(value, unit), remark)
            for path, (value, unit, remark) in sorted(self.figures.items())
        }
        return written(rows).replace(" # ", "  # ") if rows else ""


def _latency_lines(plan: Plan) -> Iterator[CheckLine]:
    most_s = MAX_LATENCY_MS * 1e-3
    for name, spec in plan.rig.devices.items():
        for value in spec.options.values():
            ms = latency_timer_ms(value) if isinstance(value, str) else None
            if ms is not None:
                file = USB_SERIAL / Path(str(value)).resolve().name / "latency_timer"
                yield graded(
                    f"{name}: latency timer", ms * 1e-3, "s", warn=most_s, fail=most_s,
                    message=f"of the USB adapter of {value}", remedy=f"echo 1 | sudo tee {file}",
                )  # fmt: skip


def _data(exam: _Examination, seen: Watched, seconds: float) -> None:
    """The lines and figures from watching the data at rest."""
    plan, rig = exam.plan, exam.plan.rig
    for name, spec in rig.devices.items():
        if name not in seen.samples:
            continue
        exam.add(*streams.check_stream(name, spec, seen, seconds))
        exam.add(*(dead := list(streams.check_live(name, spec, seen, rig))))
        if dead or streams.no_data(seen.samples[name], seconds):
            continue  # the noise of a frozen sensor is no figure for the rig
        if name == "arm":
            lines, found = streams.check_arm(plan, seen)
            exam.add(*lines)
            for path, (value, unit) in found.items():
                exam.offer(*path, value=value, unit=unit, remark="at rest")
        elif isinstance(spec, ForceSpec):
            lines, rest = streams.check_force(plan, spec, name, seen)
            exam.add(*lines)
            keys = name.split(".")
            exam.offer(*keys, "noise", value=rest.noise, unit="N", remark="at rest")
            drift = abs(rest.slope) + 2.0 * rest.slope_sigma
            exam.offer(*keys, "drift", value=drift, unit="N/s",
                       remark=f"upper bound from {seconds:g} s")  # fmt: skip


def _at_rest(exam: _Examination, rig: OpenRig, seconds: float) -> None:
    seen = watch(rig, seconds)
    if not rig.clock.virtual:
        exam.add(*host.check_lateness(seen.late_s, rig.arm.period_s))
    _data(exam, seen, seconds)


def _motion(exam: _Examination, rig: OpenRig) -> None:
    """Each motion is made only if the checks that it relies on have passed."""
    plan = exam.plan
    try:
        start_m = motion.position_now(rig)
        exam.add(motion.check_held(plan, rig))
        for check in (motion.check_stop, motion.check_watchdog):
            if exam.failed(*NEEDED_TO_MOVE):
                exam.add(without_number("arm: motion", Mark.SKIPPED,
                                        "not moved: the arm failed before"))  # fmt: skip
                return
            exam.add(check(rig))
            if not exam.failed(*NEEDED_TO_MOVE):
                motion.return_to(rig, start_m)
        if exam.failed(*NEEDED_TO_MOVE):
            return
        line, response_s = motion.check_response(plan, rig)
        motion.return_to(rig, start_m)
    except DeviceError as error:
        exam.add(_no("arm: motion", error))
        return
    exam.add(line)
    if response_s is None:
        return
    force, arm = plan.rig.force, plan.rig.arm
    loop_s = response_s + force.delay_s + 1.0 / force.rate_hz + 2.0 / arm.rate_hz
    limit_s = exam.preflight.bounds.loop_s + motion.backlash_s(arm)
    line = graded(
        "loop delay T", loop_s, "s", warn=limit_s, fail=1.3 * limit_s,
        message="measured response in free air, the plan's force delay, one force period, two "
        "ticks",
        remedy="state it as rig.loop_delay",
    )  # fmt: skip
    exam.add(line)
    exam.offer("loop_delay", value=loop_s, unit="s", remark="free air, with the plan's force delay")


def _no(name: str, error: DeviceError) -> CheckLine:
    return without_number(name, Mark.FAIL, error.message, error.hint)


def _faults(rig: OpenRig) -> list[CheckLine]:
    return [
        without_number(
            f"{name}: fault", Mark.FAIL, f"{fault.code.value}: {fault.message}", fault.hint
        )
        for name, device in devices(rig).items()
        if (fault := device.fault())
    ]


def examine(
    preflight: Preflight,
    *,
    dry_run: bool,
    seconds: float,
    still: bool,
    tell: Tell,
) -> Checkup:
    """Run every check; a device that does not open ends the examination.

    Args:
        dry_run: the simulated rig in virtual time instead of the plan's devices.
        seconds: how long the data are watched at rest.
        still: nothing is moved.
        tell: is given every line as soon as it is known.

    Raises:
        BadInputError: `seconds` is no time, or too short; nothing is opened.
    """
    if not LEAST_WATCH_S <= seconds < math.inf:
        raise BadInputError(
            f"the data at rest cannot be watched for {seconds:g} s: at least {LEAST_WATCH_S:g} s"
            " are needed",
            hint="give another --seconds, such as 10",
        )
    plan = preflight.plan
    exam = _Examination(preflight, tell)
    stage = "open"
    exam.add(host.check_disk(plan), host.check_priority(), *_latency_lines(plan))
    try:
        with opened(preflight, dry_run=dry_run) as rig:
            for role, identity in rig.identities.items():
                exam.add(without_number(
                    f"{role.replace('_', ' ')}: open", Mark.OK,
                    f"{identity.driver}: {identity.model} {identity.serial_number}, "
                    f"firmware {identity.firmware}"))  # fmt: skip
            stage = "examination"
            try:
                with realtime_conditions(rig.clock.virtual):
                    _at_rest(exam, rig, seconds)
                    if not still:
                        _motion(exam, rig)
            finally:
                rig.arm.safe(SAFE_S)
            exam.add(*_faults(rig))
    except DeviceError as error:
        exam.add(_no(stage, error))
    return Checkup(tuple(exam.lines), exam.snippet(), exam.figures)
