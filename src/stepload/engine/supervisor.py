"""Says stop, and nothing else, by the rules of `stepload.engine.rules`.

A function of its own state, the samples and the limits; it reads no clock and touches no device, so
the same code judges a dry run, hardware and a recording. It is asked at arming, in every tick, and
when data are missing. The first cause is latched.

R1 and R2 judge both force channels, and the magnitude of each: a sensor with the wrong sign must
stop a run too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from stepload.engine.cross_check import CrossCheck, SecondFilter, filter_times
from stepload.engine.force_response import ForceResponseWatch
from stepload.engine.motion import SEARCHING, MotionWatch
from stepload.engine.watch import ArmWatch, ForceWatch, Found, Trip
from stepload.engine.wrench import OverloadWatch, WrenchRules
from stepload.feasibility.lateral import arm_error_n
from stepload.feasibility.limits import RunLimits
from stepload.record.outcome import Cause
from stepload.record.rows import Phase
from stepload.rig.samples import ArmSample, ForceSample
from stepload.units import beside_limit

WRONG_WAY_SAMPLES = 2
"""Fresh samples in a row with a wrong force before R11 trips; as many make a touch."""
ACROSS_SIGMAS = 8.0
"""Multiple of the noise for the lateral force: two noisy components, each less its zero."""

_LOAD, _RETRACT = int(Phase.LOAD), int(Phase.RETRACT)
PRESSED = (_LOAD, int(Phase.HOLD))
"""Phases in which R9 stops an only channel whose force falls though the arm does not go back."""


class Supervisor:
    """Judges every tick by the rules, and keeps their state.

    `force_n` is the tared force of the newest sample, `smooth_n` and `slope_n_per_s` its filtered
    value and rate, `second_n` the tared second channel (NaN where there is none), `predicted_n` the
    peak force predicted by R2. `arm_across_n` is the lateral force by the arm's own wrench less its
    tolerance, where the arm is the second channel and reports it; else 0. R1, R2, R5, R6 and R9 are
    judged from the first `tare` on; `tared` says whether it was.

    Args:
        limits: the thresholds.
        force_axis: component of the force sensor's wrench, "+fx" … "-fz".
        second_axis: the same of a second force sensor; "" where the arm is the second channel.
        found: makes the `Trip` of a rule; see `stepload.engine.watch`.
    """

    def __init__(
        self, limits: RunLimits, force_axis: str, second_axis: str = "", found: Found = Trip
    ) -> None:
        self._limits = limits
        self._found = found
        counts, clock_s = limits.identical_counts, limits.clock_s
        self.force = ForceWatch(
            "force sensor",
            force_axis,
            full_scale_n=limits.full_scale_n,
            stale_s=limits.stale_force_s,
            identical_counts=counts,
            clock_s=clock_s,
            found=found,
        )
        self.second: ForceWatch | None = None
        if second_axis:
            self.second = ForceWatch(
                "second force sensor",
                second_axis,
                full_scale_n=math.inf,
                stale_s=limits.stale_second_s,
                identical_counts=limits.second_identical_counts,
                clock_s=clock_s,
                found=found,
            )
        self._second_is_arm = limits.cross_check == "arm"
        self.arm = ArmWatch(
            stale_s=limits.stale_arm_s,
            identical_counts=limits.second_identical_counts,
            clock_s=clock_s,
            needs_force=self._second_is_arm,
            found=found,
        )
        self.motion = MotionWatch(limits, found)
        self.wrench, self.arm_wrench = WrenchRules(limits, found), WrenchRules(limits, found)
        self.overload = OverloadWatch("force sensor", limits.overload, found)
        self.second_overload = OverloadWatch("second force sensor", limits.second_overload, found)
        sensors = (self.overload, self.force), (self.second_overload, self.second)
        self._rated = [(rule, sensor) for rule, sensor in sensors if sensor and rule.stated]
        period_s = limits.period_s
        times_s = filter_times(period_s, limits.reaction_s)
        self.smooth_tau_s, self.smooth_alpha, self._span_s = times_s
        self._second_filter = SecondFilter(period_s, limits.second_late_s, limits.second_noise_n)
        self.tared = self._sound = False
        self._wrong_way = self._second_wrong_way = 0
        noises_n = limits.noise_n, limits.second_noise_n
        self._cross = CrossCheck(period_s, limits.channel_skew_s, limits.cross_filter_s, noises_n)
        self.answers = ForceResponseWatch(limits, found)
        self._cross_s = self._last_n = 0.0
        self._now_s = self._zeroed_s = 0.0
        self.zero_n = self.second_zero_n = 0.0
        self.force_n = self.smooth_n = self._slow_n = self.slope_n_per_s = 0.0
        self.second_n = math.nan
        self.predicted_n = self.second_predicted_n = self.arm_across_n = 0.0
        self.cause: Cause | None = None
        self.adopt(limits)

    def adopt(self, limits: RunLimits) -> None:
        """Judge by these thresholds from now on: those of the same plan, for another noise."""
        noise_n = limits.noise_n
        self._limits = limits
        self.motion.adopt(limits)
        self.answers.adopt(limits)
        self.wrench.adopt(limits)
        self.arm_wrench.adopt(limits)
        slope_noise_n = 1.5 * noise_n * math.sqrt(self.smooth_alpha)
        self._slope_noise_n_per_s = slope_noise_n / self._span_s
        self.across_limit_n = max(limits.touch_force_n, ACROSS_SIGMAS * noise_n)
        across_n = ACROSS_SIGMAS * limits.second_noise_n
        self.second_across_limit_n = max(limits.touch_force_n, across_n)
        self._second_filter.expect(limits.second_noise_n)
        self.force.identical_counts = limits.identical_counts

    @property
    def second_raw_n(self) -> float:
        """Newest reading of the second channel, not tared; NaN where there is none."""
        if self.second is not None:
            return self.second.raw_n
        return self.arm.force_n if self._second_is_arm else math.nan

    @property
    def difference_n(self) -> float:
        """By how much the channels differ, as R5 sees it."""
        return self._cross.difference_n

    @property
    def travel_m(self) -> float:
        """Travel since the answer that R6 counts from."""
        return self.answers.travel_m

    @property
    def zero_drift_n(self) -> float:
        """How far the zero may have drifted as stated since it was taken, as F_allowed has room."""
        drifted_n = self._limits.drift_n_per_s * (self._now_s - self._zeroed_s)
        return min(drifted_n, self._limits.zero_shift_n)

    def still_closed(self, now_s: float) -> str:
        """Why the contact cannot be said to be open; "" where every channel shows that it is."""
        limits = self._limits
        age_s = now_s - self.force.receive_s
        if not (self.tared and self._sound and age_s <= limits.stale_force_s):
            return "no sound force reading proves that the contact is open"
        readings = [("force sensor", self.smooth_n, limits.touch_force_n)]
        if limits.cross_check:
            allowed_n = max(limits.touch_force_n, limits.cross_tolerance_n)
            readings.append(("second force channel", self.second_n, allowed_n))
        across = "force sensor across the pressing axis"
        readings.append((across, self.force.smooth_across_n, self.across_limit_n))
        for name, read_n, allowed_n in readings:
            if not -allowed_n <= read_n <= allowed_n:
                return f"the {name} still reads {read_n:+.3g} N: the contact may not be open"
        return ""

    def tare(self, zero_n: float, second_zero_n: float, wrench: Sequence[float] = ()) -> None:
        """Use these readings as zero force, and judge forces, from now on.

        `wrench` is the mean of the force sensor's six components; without it those across the axis
        are zeroed by their recent readings, as those of a second sensor are.
        """
        self.zero_n, self.second_zero_n = zero_n, second_zero_n
        self._zeroed_s = self._now_s
        self.force.tare(wrench)
        if self.second is not None:
            self.second.tare()
        self.arm.side.tare()
        self.smooth_n = self._slow_n = self._last_n = self.force.raw_n - zero_n
        self._second_filter.restart(self.second_raw_n - second_zero_n)
        self._cross.restart()
        self._cross_s = 0.0
        self.tared = True

    def check(
        self,
        now_s: float,
        force_samples: Sequence[ForceSample],
        arm_samples: Sequence[ArmSample],
        second_samples: Sequence[ForceSample],
        target_m: float,
        compliance_m_per_n: float,
        phase: int,
    ) -> Cause | None:
        """Judge one tick; the latched cause, or None.

        `target_m` is the target in force until now (NaN before the first), `compliance_m_per_n` the
        controller's c_use.
        """
        self._now_s = now_s
        # Every stream is followed, whatever fails.
        arm, second = self.arm, self.second
        in_force = self.force.take(force_samples, now_s)
        in_arm = arm.take(arm_samples, now_s)
        in_second = None if second is None else second.take(second_samples, now_s)
        motion = self.motion.judge(now_s, target_m, arm.position_m, phase)
        overload = None
        for rule, sensor in self._rated:
            if sensor.fresh:
                overload = rule.judge(sensor.wrench) or overload
        force = self._judge_force(target_m, compliance_m_per_n, phase) if self.tared else None
        self._sound = in_force is None and in_arm is None and in_second is None
        if self.cause is None:
            first = in_force or in_arm or in_second or overload or force or motion
            if first is not None:
                stream: ForceWatch | ArmWatch = self.force
                if first is in_arm or first is motion:
                    stream = arm
                elif first is in_second and second is not None:
                    stream = second
                code, value, limit, unit, message = first
                age_s = max(0.0, now_s - stream.receive_s)
                self.cause = Cause(code, value, limit, unit, age_s, now_s, message)
        return self.cause

    def _judge_force(self, target_m: float, compliance_m_per_n: float, phase: int) -> Trip | None:
        """R1, R2, R5, R6, R9, R11, R12, R14 and the speed cap; keeps the filtered force."""
        limits, motion, alpha = self._limits, self.motion, self.smooth_alpha
        limit_n, noise_n = limits.force_limit_n, limits.noise_n
        jump_n, force_n = 0.0, self.force_n
        if self.force.fresh:
            self.force_n = force_n = self.force.raw_n - self.zero_n
            jump_n = force_n - self._last_n
            self._last_n = force_n
        self.smooth_n = smooth_n = self.smooth_n + alpha * (force_n - self.smooth_n)
        self._slow_n = slow_n = self._slow_n + alpha * (smooth_n - self._slow_n)
        self.slope_n_per_s = slope = (smooth_n - slow_n) / self._span_s
        trip = None

        rise = slope - self._slope_noise_n_per_s
        speed = motion.speed_m_s
        peak_n = smooth_n + 4.0 * noise_n
        if phase == _LOAD and speed > 0.0:
            stiffness = limits.stiffness_n_per_m
            if compliance_m_per_n * stiffness > 1.0:
                stiffness = 1.0 / compliance_m_per_n
            rise = max(rise, stiffness * speed)
        if rise > 0.0:
            peak_n += rise * limits.reaction_s
        if smooth_n < 0.0:  # what pulls, or presses on a sensor with the wrong sign
            fall = max(0.0, -slope - self._slope_noise_n_per_s)
            peak_n = max(peak_n, 4.0 * noise_n - smooth_n + fall * limits.reaction_s)
        self.predicted_n = peak_n

        if not -limit_n <= force_n <= limit_n:
            trip = self._found(
                "R1", abs(force_n), limit_n, "N",
                f"force {force_n:.4g} N is beyond {limit_n:.4g} N",
            )  # fmt: skip
        if trip is None and peak_n > limit_n:
            trip = self._found(
                "R2", peak_n, limit_n, "N",
                f"force {force_n:.4g} N would grow to {peak_n:.4g} N, above {limit_n:.4g} N,"
                f" before the arm can give way{_below_zero(force_n)}",
            )  # fmt: skip

        if not -limits.jump_n <= jump_n <= limits.jump_n:
            trip = trip or self._judge_jump(jump_n, phase)
        if limits.cross_check:
            second = self._judge_second()
            trip = self._judge_cross_check(force_n, smooth_n) or trip or second
        side = self._judge_side(force_n, phase)
        trip = trip or side
        if phase == _LOAD:
            trip = trip or self._judge_load(target_m, smooth_n, speed)
        else:
            self.answers.rest(target_m, smooth_n, phase)
        return trip

    def _judge_jump(self, jump_n: float, phase: int) -> Trip | None:
        """R9 for a jump beyond the limit at rest; while the arm moves it is larger."""
        limits, recent, steps = self._limits, self.motion.recent_m_s, self.motion.steps
        rise_n = fall_n = (limits.jump_n + limits.contact_n_s_per_m * recent) * steps
        if not limits.cross_check and phase in PRESSED and self.motion.speed_m_s >= 0.0:
            fall_n = min(rise_n, (limits.jump_n + limits.ring_n_s_per_m * recent) * steps)
        if -fall_n <= jump_n <= rise_n:
            return None
        return self._found(
            "R9", jump_n, rise_n if jump_n > 0.0 else fall_n, "N",
            f"force jumped by {jump_n:+.4g} N without a motion that explains it",
        )  # fmt: skip

    def _judge_second(self) -> Trip | None:
        """R1 and R2 for the second channel: stops a main one that reads too little."""
        limits, follow = self._limits, self._second_filter
        limit_n = limits.second_limit_n
        raw_n = self.arm.force_n if self.second is None else self.second.raw_n
        self.second_n = second_n = raw_n - self.second_zero_n
        self.second_predicted_n = peak_n = follow.peak_n(second_n)
        if not peak_n > limit_n:
            return None
        if abs(follow.smooth_n) > limit_n:
            return self._found(
                "R1", abs(follow.smooth_n), limit_n, "N",
                f"the second channel reads {second_n:.4g} N, beyond {limit_n:.4g} N",
            )  # fmt: skip
        return self._found(
            "R2", peak_n, limit_n, "N",
            f"{second_n:.4g} N on the second channel would grow to {peak_n:.4g} N, above"
            f" {limit_n:.4g} N, before the arm can give way",
        )  # fmt: skip

    def _judge_side(self, force_n: float, phase: int) -> Trip | None:
        """R1 and R2 for the whole force; R11 in an approach, else R12 and R14."""
        limits, force, trip = self._limits, self.force, None
        if force.across_n > limits.touch_force_n:
            trip = self._judge_whole(force_n, force.across_n)
        if self.second is not None:
            trip = trip or self._judge_second_side(self.second, phase)
        if self.arm.side.told:
            trip = trip or self._judge_arm_side(force_n, phase)
        if phase in SEARCHING:
            return trip or self._judge_way(force_n)
        self._wrong_way = 0
        along_n = force.smooth_n - self.zero_n
        if limits.lateral_share:
            dragged = self.wrench.judge_across(
                force.smooth_across_n, force_n, along_n, self.predicted_n, phase == _RETRACT
            )
            trip = trip or dragged
        if limits.eccentricity_m:
            beside = self.wrench.judge_centre(force, along_n)
            trip = trip or beside
        return trip

    def _judge_arm_side(self, force_n: float, phase: int) -> Trip | None:
        """R1, R2 and R12 for the lateral force by the arm's own wrench, less its tolerance.

        It is coarse, but detects what a force sensor of one component cannot see at all.
        """
        limits, along_n = self._limits, self.force.smooth_n - self.zero_n
        error_n = arm_error_n(limits.cross_tolerance_n, limits.cross_relative, along_n)
        self.arm_across_n = across_n = max(0.0, self.arm.side.across_n - error_n)
        trip = self._judge_whole(force_n, across_n) if across_n > 0.0 else None
        if phase in SEARCHING:
            return trip
        dragged = self.arm_wrench.judge_across(
            across_n, force_n, along_n, self.predicted_n, phase == _RETRACT,
            "by the arm's own wrench, less its tolerance: ",
        )  # fmt: skip
        return trip or dragged

    def _judge_whole(self, force_n: float, across_n: float) -> Trip | None:
        """R1 and R2 for the force along and across the pressing axis together."""
        limit_n, trip = self._limits.force_limit_n, None
        for rule, along_n, word in (("R1", force_n, "is"), ("R2", self.predicted_n, "would be")):
            whole_n = math.hypot(along_n, across_n)
            if whole_n > limit_n:
                trip = trip or self._found(
                    rule, whole_n, limit_n, "N",
                    f"with {across_n:.4g} N across the pressing axis the whole force {word}"
                    f" {whole_n:.4g} N, beyond {limit_n:.4g} N",
                )  # fmt: skip
        return trip

    def _judge_second_side(self, second: ForceWatch, phase: int) -> Trip | None:
        """R1 and R11 for the lateral force on a second sensor: it may be the only one alive."""
        limits, across_n = self._limits, second.across_n
        whole_n = math.hypot(self.second_n, across_n) if across_n > limits.touch_force_n else 0.0
        if whole_n > limits.force_limit_n:
            return self._found(
                "R1", whole_n, limits.force_limit_n, "N",
                f"with {across_n:.4g} N across the pressing axis the whole force on the second"
                f" force sensor is {whole_n:.4g} N, beyond {limits.force_limit_n:.4g} N",
            )  # fmt: skip
        if phase not in SEARCHING:
            self._second_wrong_way = 0
            return None
        smooth_n = second.smooth_across_n
        limit_n = self.second_across_limit_n
        if second.fresh:
            across = smooth_n > limit_n and smooth_n > 2.0 * abs(self.second_n)
            self._second_wrong_way = self._second_wrong_way + 1 if across else 0
        if self._second_wrong_way < WRONG_WAY_SAMPLES:
            return None
        return self._found(
            "R11", smooth_n, limit_n, "N",
            f"in the approach the second force sensor's force grew by {smooth_n:.4g} N across its"
            f" pressing axis and by {self.second_n:+.4g} N along it: second_force.sensor.axis names"
            " the wrong axis, or something pushes the tool sideways",
        )  # fmt: skip

    def _judge_way(self, force_n: float) -> Trip | None:
        """R11: the force grows the wrong way along the pressing axis, or across it.

        With two channels F_allowed leaves room for a zero that drifts as stated on a long way.
        """
        limits = self._limits
        limit_n, across_n = limits.touch_force_n, self.force.smooth_across_n
        across_limit_n, pulls = self.across_limit_n, force_n < -limit_n
        if pulls and limits.cross_check:
            limit_n += self.zero_drift_n
            pulls = force_n < -limit_n
        across = across_n > across_limit_n and across_n > 2.0 * abs(force_n)
        if self.force.fresh:
            self._wrong_way = self._wrong_way + 1 if pulls or across else 0
        if self._wrong_way < WRONG_WAY_SAMPLES:
            return None
        if pulls:
            return self._found(
                "R11", -force_n, limit_n, "N",
                f"the force sensor reads {force_n:+.4g} N in the approach, where a surface can only"
                " push: the sign of force.axis is wrong, something pulls at the tool, or its zero"
                " has moved since the tare",
            )  # fmt: skip
        return self._found(
            "R11", across_n, across_limit_n, "N",
            f"in the approach the force grew by {across_n:.4g} N across the pressing axis and by"
            f" {force_n:+.4g} N along it: force.axis names the wrong axis, or something pushes"
            " the tool sideways",
        )  # fmt: skip

    def _judge_cross_check(self, force_n: float, smooth_n: float) -> Trip | None:
        """R5: the channels differ by more than the plan allows, for longer than it allows.

        A tick in which they agree takes back one in which they did not, no more: noise, or a
        loose contact, that lets them agree now and then does not hide what is wrong most of the
        time. While the target moves away, which is safe, the count rests: in a hold it does so in
        every other tick, and only like may be counted against like.
        """
        limits = self._limits
        second_n = self.second_n
        self._cross.add(force_n, second_n)
        difference_n = self._cross.difference_n
        tolerance_n = limits.cross_limit_n(smooth_n)
        if self.motion.speed_m_s < 0.0:
            return None
        if -tolerance_n <= difference_n <= tolerance_n:
            self._cross_s = max(0.0, self._cross_s - limits.period_s)
            return None
        self._cross_s += limits.period_s
        if self._cross_s <= limits.cross_time_s:
            return None
        apart, allowed = beside_limit(difference_n, tolerance_n, "N")
        return self._found(
            "R5", difference_n, tolerance_n, "N",
            f"the second channel reads {second_n:.4g} N, the force sensor {smooth_n:.4g} N; beyond"
            f" what motion explains they are {apart} apart (allowed {allowed})"
            f"{_opposite(smooth_n, smooth_n + difference_n)}",
        )  # fmt: skip

    def _judge_load(self, target_m: float, smooth_n: float, speed: float) -> Trip | None:
        """R6 and the in-contact speed cap."""
        limits = self._limits
        cap_n = limits.cap_n(smooth_n)
        if speed * limits.contact_n_s_per_m > cap_n and speed > 0.0:
            return self._found(
                "CAP", speed, max(cap_n, 0.0) / limits.contact_n_s_per_m, "m/s",
                "faster in contact than a hidden hard stop would allow",
            )  # fmt: skip
        return self.answers.load(target_m, smooth_n)


def _below_zero(force_n: float) -> str:
    """What a force below zero may be, where a plate can only push; else ""."""
    if force_n >= 0.0:
        return ""
    return "; below zero: something pulls, force.axis has the wrong sign, or the zero has moved"


def _opposite(force_n: float, second_n: float) -> str:
    """Hint at a wrong sign, where the channels read opposite forces of similar size; else ""."""
    if not force_n * second_n < 0.0 or not 0.3 < abs(second_n / force_n) < 3.0:
        return ""
    return (
        "; they have opposite signs, so one of the two has the wrong sign. Change neither until a"
        " push by hand on the tool has shown which (stepload setup): two that agree can both be"
        " wrong"
    )
