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


WIDER_FAULTS = (
    "force_gain_ramp", "force_bias_ramp", "force_clipped", "second_gain_ramp", "second_bias_ramp",
    "second_clipped", "gauge_gain_ramp", "gauge_bias_ramp", "gauge_clipped", "arm_force_clipped",
    "command_jitter", "plate_moves",
)  # fmt: skip
"""Faults beyond the claim of the campaign: drawn only if they are named."""

SIX_FAULTS = (
    "force_lateral_dead", "force_lateral_swapped", "force_torque_dead", "force_torque_saturated",
    "plate_slips",
)  # fmt: skip
"""Faults that only a rig with six axes has."""
FROM_THE_START = dict.fromkeys(SIX_FAULTS[:3], 0.5) | {"arm_turned": 1.0}
"""Share of the faults of a kind that have been so from the beginning; of others none."""

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
    "host_stall": lambda c, _: log_uniform(c, 0.005, 0.5),
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
    """The world faults that affect this rig."""
    source = plan.rig.second_force.source
    missing = [
        prefix
        for prefix, there in (
            ("gauge_", plan.rig.displacement is not None),
            ("second_", source is SecondForceSource.SENSOR),
            ("arm_force_", source is SecondForceSource.ARM),
        )
        if not there
    ]
    return sorted(kind for kind in kinds if not kind.startswith(tuple(missing)))


def draw_fault(
    chance: Random, kinds: list[str], times: Times, elastic_limit_n: float
) -> WorldFault:
    """One fault of the simulated rig."""
    return fault_of(chance.choice(kinds), chance, times, elastic_limit_n)


def fault_of(kind: str, chance: Random, times: Times, elastic_limit_n: float) -> WorldFault:
    """A fault of this kind."""
    if kind in FROM_THE_START and chance.random() < FROM_THE_START[kind]:
        return WorldFault(kind, 0.0, FOR_GOOD_S, 0.0)
    lasts_s = FOR_GOOD_S if chance.random() < FOR_GOOD_SHARE else log_uniform(chance, 0.01, 10.0)
    return WorldFault(
        kind, draw_time(chance, times), lasts_s, magnitude_of(kind, chance, elastic_limit_n)
    )


def draw_incidents(chance: Random, kinds: list[str], times: Times) -> tuple[Incident, ...]:
    """One incident; one to three when it is Ctrl+C."""
    return incidents_of(chance.choice(kinds), chance, times)


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


SILENT = ("stuck_mean", "gain", "bias", "deaf", "gain_ramp", "bias_ramp", "clipped", "aged", "old")
"""Faults of a force channel that are detected only by comparison with the other one."""


def both_channels_blind(faults: Iterable[WorldFault], plan: Plan) -> bool:
    """Whether both force channels fail undetected: the named hazard `both_channels_alike`.

    Neither reports a fault, and there is no third channel to compare them with.
    """
    source = plan.rig.second_force.source
    second = "second_" if source is SecondForceSource.SENSOR else "arm_force_"
    kinds = {fault.kind for fault in faults if not _harmless(fault)}
    first_lies = any(f"force_{kind}" in kinds for kind in SILENT)
    second_lies = any(f"{second}{kind}" in kinds for kind in SILENT)
    return first_lies and second_lies


def _harmless(fault: WorldFault) -> bool:
    """Whether a fault only makes a reading too large, which stops a run early."""
    too_much = fault.kind.endswith("gain") and fault.magnitude >= 1.0
    return too_much or (fault.kind.endswith("_bias") and fault.magnitude >= 0.0)
