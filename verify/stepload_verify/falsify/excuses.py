"""Whether a hazard that preflight names explains a peak: its effect, within its limits.

Each is tested by removing its cause from the run: if the rest exceeds F_c as well, or if more
happened than the hazard states, it is no explanation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from stepload.engine.rehearse import world_for
from stepload.envelope.hazards import HEAVIER
from stepload.rig.mount import Mount
from stepload.rig.world import WorldSpec
from stepload_verify.campaign.scenario import Scenario
from stepload_verify.falsify.scene import with_faults

PLATE, HELD_BACK, HEAVY, LATE, TILTED, SILENT, BOTH_SILENT = (
    "plate_moves", "held_back_commands", "heavier_arm", "unstated_delays", "plate_tilted",
    "silent_channel", "both_silent",
)  # fmt: skip
LINK_FAULTS = ("command_latency", "command_jitter")
"""Faults in which a link holds commands back and delivers them together."""

MAIN_SILENT = ("force_freeze", "force_stuck_mean")
SECOND_SILENT = ("second_freeze", "second_stuck_mean", "arm_force_freeze", "arm_force_deaf")
"""Faults of the main channel and of the second one after which it no longer shows the force."""
FREEZES = ("force_freeze", "second_freeze", "arm_force_freeze")
"""Faults in which a force channel repeats itself."""


def excuses(scenario: Scenario, peak_n: float) -> Iterator[tuple[str, Scenario]]:
    """The hazards that may explain this peak: code, and the run without their cause."""
    named = {reason.code: reason.value for reason in scenario.envelope.reasons}
    kinds = {fault.kind for fault in scenario.faults}
    rigid = any(anomaly.kind == "hidden hard stop" for anomaly in scenario.anomalies)
    if PLATE in kinds:
        yield PLATE, without(scenario, PLATE)
    held = rigid or any(one.kind == "stuck stiffer than stated" for one in scenario.anomalies)
    if held and kinds.intersection(LINK_FAULTS) and peak_n <= named.get(HELD_BACK, 0.0):
        yield HELD_BACK, without(scenario, *LINK_FAULTS)
    believed = world_for(scenario.envelope, seed=scenario.truth.seed)
    heavier = scenario.truth.effective_mass_kg / believed.effective_mass_kg
    if rigid and 1.0 < heavier <= HEAVIER and peak_n <= named.get(HEAVY, 0.0):
        truth = replace(scenario.truth, effective_mass_kg=believed.effective_mass_kg)
        yield HEAVY, replace(scenario, truth=truth)
    if LATE in named and unstated_s(scenario, believed) > named[LATE]:
        rest = without(scenario, "command_jitter")
        truth = replace(
            rest.truth,
            force_delay_s=believed.force_delay_s,
            second_force_delay_s=believed.second_force_delay_s,
        )
        yield LATE, replace(rest, truth=truth)
    if kinds.intersection(FREEZES) and peak_n <= named.get(SILENT, 0.0):
        yield SILENT, without(scenario, *FREEZES)
    silent = kinds.intersection(MAIN_SILENT) and kinds.intersection(SECOND_SILENT)
    if silent and peak_n <= named.get(BOTH_SILENT, 0.0):
        yield BOTH_SILENT, without(scenario, *SECOND_SILENT)
    if TILTED in named and (mount := scenario.truth.mount) is not None:
        level = levelled(mount, named[TILTED])
        if level != mount:
            yield TILTED, replace(scenario, truth=replace(scenario.truth, mount=level))


def levelled(mount: Mount, largest_rad: float) -> Mount:
    """The same rig with a plate that is tilted by no more than this."""
    x_rad, y_rad = mount.plate_tilt_rad
    less = largest_rad / max(largest_rad, math.hypot(x_rad, y_rad))
    return replace(mount, plate_tilt_rad=(less * x_rad, less * y_rad))


def unstated_s(scenario: Scenario, believed: WorldSpec) -> float:
    """Additional delay of readings and commands together over that of the plan, in s."""
    truth = scenario.truth
    readings_s = max(
        truth.force_delay_s - believed.force_delay_s,
        truth.second_force_delay_s - believed.second_force_delay_s,
    )
    jitter = (fault.magnitude for fault in scenario.faults if fault.kind == "command_jitter")
    return readings_s + sum(jitter)


def without(scenario: Scenario, *kinds: str) -> Scenario:
    """The same run without faults of these kinds."""
    return with_faults(scenario, [one for one in scenario.faults if one.kind not in kinds])
