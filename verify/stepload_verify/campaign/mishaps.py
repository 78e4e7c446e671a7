"""Faults in a run and their times: of devices, of the host, of people and of programs.

A mishap is a `WorldFault` that the simulated rig carries out, or an `Incident` on the program's
side of the rig (`stepload_verify.campaign.incidents`). Times are world times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from random import Random

from stepload.plan.model import Plan, SecondForceSource
from stepload.rig.world import WorldFault
from stepload_verify.campaign.plants import log_uniform

FOR_GOOD_S = 600.0
FOR_GOOD_SHARE = 0.4
"""Share of faults that last to the end of the run; the others last 10 ms to 10 s."""

COMPONENTS = (
    "clock.sleep_until", "engine.tick", "supervisor.check", "procedure.step", "recorder.tick",
    "recorder.event", "recorder.problem", "arm.fault", "arm.retract", "arm.safe", "force.fault",
    "force.safe",
)  # fmt: skip
"""Calls that may raise; drains and commands are faults of the simulated rig."""
ERRORS: dict[str, type[BaseException]] = {
    "RuntimeError": RuntimeError, "MemoryError": MemoryError, "OSError": OSError,
    "KeyboardInterrupt": KeyboardInterrupt, "SystemExit": SystemExit,
}  # fmt: skip

INCIDENTS: dict[str, str] = {
    "signal_int": "program: Ctrl+C, 1 to 3 times within a second",
    "signal_term": "program: SIGTERM",
    "killed": "program: it is gone from one tick to the next, and safes nothing (kill -9)",
    "recorder_full": "record: the disk is full",
    "exception": "program: an exception in one of its components, from then on",
}
"""Every kind of incident with one line of help."""


@dataclass(frozen=True, slots=True)
class Incident:
    """An incident on the program's side, from `start_s` on; `detail` is a count or a component."""

    kind: str
    start_s: float
    detail: str


@dataclass(frozen=True, slots=True)
class Times:
    """Expected times of the touch and of the end of the run, in world time."""

    touch_s: float
    end_s: float


def draw_time(chance: Random, times: Times) -> float:
    """A third anywhere in the run, a third about the touch, a third while in contact."""
    which = chance.randrange(3)
    if which == 0:
        return chance.uniform(0.0, times.end_s)
    if which == 1:
        return max(0.0, times.touch_s + chance.uniform(-0.2, 0.6))
    return chance.uniform(times.touch_s, times.end_s)


SIX_FAULTS = (
    "force_lateral_dead", "force_lateral_swapped", "force_torque_dead", "force_torque_saturated",
    "plate_slips",
)  # fmt: skip
"""Faults that only a rig with six axes has."""
FROM_THE_START = dict.fromkeys(SIX_FAULTS[:3], 0.5) | {"arm_turned": 1.0}
"""Share of the faults of a kind that have been so from the beginning; of others none."""

COMMON: dict[str, str] = {
    "link_lost": "one link: both force channels end for good",
    "link_dropout": "one link: samples of both force channels are lost, then come again",
    "link_delay": "one link: samples of both force channels come later",
    "link_freeze": "one link: both force channels repeat their last sample",
    "link_aged": "one buffer that fills: two sensors go on, and show an older force",
    "common_gain": "one weight or lever: both gains wrong, within the common error of the plan",
    "common_drift": "one temperature: both zeros drift, within the drift of the plan",
    "common_supply": "one supply: both means stand still, the noise stays alive",
}
"""One cause that reaches both force channels, each with one line of help."""
FIRST_DAY: dict[str, str] = {
    "wrong_gain": "a force channel has 0.5 to 2 times the gain of its data sheet",
    "wrong_unit": "a force channel reads in another unit: N, lbf, kgf",
    "wrong_sign": "a force channel has the opposite sign",
    "wrong_axis": "a force channel shows the force along another axis",
    "wrong_filter": "a force channel has a filter that the plan does not state",
}
"""What a plan states wrongly of a force channel; it is so from the beginning."""
POUND_N, KILOGRAM_N = 4.4482, 9.80665
UNITS = (1.0 / KILOGRAM_N, 1.0 / POUND_N, POUND_N / KILOGRAM_N, KILOGRAM_N / POUND_N, POUND_N,
         KILOGRAM_N)  # fmt: skip
"""Readings over the true force, where two of N, lbf and kgf are mistaken for each other."""

_Draw = Callable[[Random, float], float]


def _sign(chance: Random) -> float:
    return chance.choice((-1.0, 1.0))


_MAGNITUDES: dict[str, _Draw] = {
    "delay": lambda c, _: log_uniform(c, 0.02, 0.3),
    "aged": lambda c, _: log_uniform(c, 0.05, 2.0),
    "old": lambda c, _: log_uniform(c, 0.05, 1.0),
    "filter": lambda c, _: log_uniform(c, 0.02, 1.0),
    "gain": lambda c, _: c.uniform(0.3, 0.95) if c.random() < 0.8 else c.uniform(1.05, 2.0),
    "bias": lambda c, f_c: -f_c * c.uniform(0.01, 0.5) * (1.0 if c.random() < 0.8 else -1.0),
    "clock_step": lambda c, _: _sign(c) * log_uniform(c, 0.005, 10.0),
    "position_drift": lambda c, _: _sign(c) * log_uniform(c, 1e-5, 0.02),
    "position_jump": lambda c, _: _sign(c) * log_uniform(c, 1e-5, 0.02),
    "command_latency": lambda c, _: log_uniform(c, 0.02, 0.2),
    "host_stall": lambda c, _: log_uniform(c, 0.005, 2.0),
    "gain_ramp": lambda c, _: -log_uniform(c, 0.005, 0.5),
    "bias_ramp": lambda c, f_c: -f_c * log_uniform(c, 0.002, 0.2),
    "clipped": lambda c, f_c: f_c * c.uniform(0.1, 1.0),
    "command_jitter": lambda c, _: log_uniform(c, 0.005, 0.06),
    "plate_moves": lambda c, _: log_uniform(c, 20e-6, 0.2e-3),
    "plate_slips": lambda c, _: 0.05,
}
"""Magnitude by the ending of a fault's name; others have none."""
_PREFIXES = ("force_", "second_", "gauge_", "arm_force_", "arm_")


def magnitude_of(kind: str, chance: Random, elastic_limit_n: float) -> float:
    """A magnitude for a world fault of this kind; 0 where it has none."""
    bare = kind
    for prefix in _PREFIXES:
        bare = bare.removeprefix(prefix)
    draw = _MAGNITUDES.get(kind) or _MAGNITUDES.get(bare)
    if draw is None:
        return 0.0
    if kind.startswith("gauge_") and bare in ("bias", "bias_ramp", "clipped"):
        return _sign(chance) * log_uniform(chance, 1e-6, 1e-3)
    return draw(chance, elastic_limit_n)


def applicable(kinds: Iterable[str], plan: Plan) -> list[str]:
    """The kinds that this rig can have."""
    source = plan.rig.second_force.source
    none = source is SecondForceSource.NONE
    missing = [
        prefix
        for prefix, there in (
            ("gauge_", plan.rig.displacement is not None),
            ("second_", source is SecondForceSource.SENSOR),
            ("arm_force_", source is SecondForceSource.ARM),
            ("link_", not none),
            ("link_aged", source is SecondForceSource.SENSOR),
            ("common_supply", not none),
        )
        if not there
    ]
    return sorted(kind for kind in kinds if not kind.startswith(tuple(missing)))


def faults_of(
    kind: str, chance: Random, times: Times, plan: Plan, elastic_limit_n: float
) -> list[WorldFault]:
    """The faults of the simulated rig that one cause of this kind is."""
    if kind in FIRST_DAY:
        return [_from_the_first_day(kind, chance, plan)]
    if kind in COMMON:
        return _in_common(kind, chance, times, plan)
    if chance.random() < FROM_THE_START.get(kind, 0.0):
        return [WorldFault(kind, 0.0, FOR_GOOD_S, 0.0)]
    start_s, lasts_s = draw_time(chance, times), _lasts_s(chance)
    return [WorldFault(kind, start_s, lasts_s, magnitude_of(kind, chance, elastic_limit_n))]


def _lasts_s(chance: Random) -> float:
    return FOR_GOOD_S if chance.random() < FOR_GOOD_SHARE else log_uniform(chance, 0.01, 10.0)


def _channels(plan: Plan) -> list[str]:
    """Prefix of each force channel's faults, the main one first."""
    second = {SecondForceSource.SENSOR: ["second_"], SecondForceSource.ARM: ["arm_force_"]}
    return ["force_", *second.get(plan.rig.second_force.source, [])]


def _from_the_first_day(kind: str, chance: Random, plan: Plan) -> WorldFault:
    channel = chance.choice(_channels(plan))
    size = 0.0
    if kind == "wrong_gain":
        what, size = "gain", log_uniform(chance, 0.5, 2.0)
    elif kind == "wrong_unit":
        what, size = "gain", chance.choice(UNITS)
    elif kind == "wrong_filter":
        what, size = "filter", log_uniform(chance, 0.02, 0.5)
    else:  # an arm's own force has no axis to mistake: with its direction it is given as a sign
        what = "swapped" if kind == "wrong_axis" and channel != "arm_force_" else "reversed"
    return WorldFault(f"{channel}{what}", 0.0, FOR_GOOD_S, size)


def _in_common(kind: str, chance: Random, times: Times, plan: Plan) -> list[WorldFault]:
    rig, channels = plan.rig, _channels(plan)
    start_s, lasts_s = draw_time(chance, times), _lasts_s(chance)
    what, size = kind.removeprefix("link_"), 0.0
    if kind == "common_gain":
        size = 1.0 + rig.common_force_error * chance.uniform(-1.0, 1.0)
        what, start_s, lasts_s = "gain", 0.0, FOR_GOOD_S
    elif kind == "common_drift":
        what, size = "bias_ramp", rig.force.drift_n_per_s * chance.uniform(-1.0, 1.0)
    elif kind == "common_supply":
        what = "stuck_mean"
    else:
        size = magnitude_of(what, chance, 0.0)
    kinds = [f"{channel}{what}" for channel in channels]
    arm_too = chance.random() < 0.5
    if kind.startswith("link_") and what != "aged":
        own = channels[-1] == "arm_force_"
        kinds = kinds[:1] if own else kinds
        kinds += [f"arm_{what}"] if own or arm_too else []
    arms_own = {"arm_force_stuck_mean": "arm_force_deaf", "arm_force_bias_ramp": "arm_force_bias"}
    sizes = {"arm_force_bias": size * min(lasts_s, times.end_s)}
    return [
        WorldFault(name, start_s, lasts_s, sizes.get(name, size))
        for name in (arms_own.get(name, name) for name in kinds)
    ]


def incidents_of(kind: str, chance: Random, times: Times) -> tuple[Incident, ...]:
    """One incident of this kind; one to three when it is Ctrl+C."""
    start_s = draw_time(chance, times)
    if kind == "signal_int":
        later = sorted(chance.uniform(0.0, 1.0) for _ in range(chance.randrange(3)))
        return tuple(Incident(kind, start_s + after_s, "") for after_s in (0.0, *later))
    if kind == "exception":
        component = chance.choice(COMPONENTS)
        return (Incident(kind, start_s, f"{component} {chance.choice(sorted(ERRORS))}"),)
    return (Incident(kind, start_s, ""),)


SILENT = ("stuck_mean", "gain", "bias", "deaf", "gain_ramp", "bias_ramp", "clipped")
"""Faults of a force channel that are detected only by comparison with the other one."""
LATE = ("aged", "old")
"""Faults by which a channel without a clock of its own is late and goes on arriving."""
BLIND, ONLY_CHANNEL = "both_channels_alike", "only_channel_lies"
"""Named hazards: no rule can stop such a run."""


def lies_of(faults: Iterable[WorldFault], plan: Plan) -> str:
    """The named hazard that every force channel is wrong alike and reports no fault, or "".

    An only channel may be late: its travel limit holds. An arm's own force comes with its position
    and the controller's clock (R10), so that no one buffer makes it and a sensor late.
    """
    channels = _channels(plan)
    kinds = {fault.kind for fault in faults if not _harmless(fault)}
    if all(any(f"{channel}{kind}" in kinds for kind in SILENT) for channel in channels):
        return BLIND if len(channels) > 1 else ONLY_CHANNEL
    late = all(any(f"{channel}{kind}" in kinds for kind in LATE) for channel in channels)
    return BLIND if late and len(channels) > 1 else ""


def _harmless(fault: WorldFault) -> bool:
    """Whether a fault only makes a reading too large, which stops a run early."""
    too_much = fault.kind.endswith("gain") and fault.magnitude >= 1.0
    bias = fault.kind.endswith(("_bias", "_bias_ramp", "_gain_ramp"))
    return too_much or (bias and fault.magnitude >= 0.0)
