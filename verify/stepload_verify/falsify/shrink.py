"""Simplification of a counterexample: everything that it does not need is removed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import MISSING, fields, replace
from functools import partial
from typing import Any, TypeVar

from stepload.engine.rehearse import world_for
from stepload.errors import SteploadError
from stepload.rig.mount import Mount, SensorMount
from stepload.rig.world import WorldFault
from stepload_verify.campaign.mishaps import FOR_GOOD_S, Incident
from stepload_verify.campaign.scenario import Scenario
from stepload_verify.campaign.truth import SIX_ANOMALIES, Anomaly
from stepload_verify.falsify.scene import with_faults

DIGITS = (1, 2, 3)
"""Significant digits to which figures are rounded, fewest first."""

Still = Callable[[Scenario], bool]
"""Whether a simpler run still shows what the counterexample shows."""
_SHOWN_BY = {
    "K x 10": "payload",
    "K / 10": "payload",
    "hidden hard stop": "payload",
    "surface too near": "surface_m",
    "K_s wrong by 30 %": "system_stiffness_n_per_m",
    "mass wrong": "effective_mass_kg",
    "filters not declared": "force_delay_s",
    **dict.fromkeys(SIX_ANOMALIES, "mount"),
}
"""Part of the truth that an anomaly changes."""
_Part = TypeVar("_Part", Mount, SensorMount)
Edit = Callable[[Scenario], Scenario]


def shrink(scenario: Scenario, still: Still) -> Scenario:
    """The simplest run found in which `still` holds, as it does for `scenario`.

    Each simplification is tried by itself, and kept if it keeps the finding, until none is left.
    """
    before = None
    while scenario != before:
        before = scenario
        for edit in _edits(scenario):
            candidate = edit(scenario)
            if candidate != scenario and _holds(still, candidate):
                scenario = candidate
    return replace(scenario, anomalies=_left(scenario))


def _left(scenario: Scenario) -> tuple[Anomaly, ...]:
    """The anomalies of the plant that are still in its truth."""
    believed = world_for(scenario.envelope, seed=scenario.truth.seed)
    return tuple(
        one
        for one in scenario.anomalies
        if getattr(scenario.truth, _SHOWN_BY[one.kind]) != getattr(believed, _SHOWN_BY[one.kind])
    )


def _holds(still: Still, scenario: Scenario) -> bool:
    """Run a candidate; one that cannot be run at all shows nothing."""
    try:
        return still(scenario)
    except SteploadError:
        return False


def _edits(scenario: Scenario) -> Iterator[Edit]:
    """Possible simplifications of a run: of faults, then of the truth, then of digits."""
    faults = scenario.truth.faults
    yield from (partial(_without_fault, fault=fault) for fault in faults)
    yield from (partial(_without_incident, incident=one) for one in scenario.incidents)
    believed = world_for(scenario.envelope, seed=scenario.truth.seed)
    for name in believed.__slots__:
        if name not in ("faults", "seed"):
            yield partial(_with_truth, name=name, value=getattr(believed, name))
    yield partial(_with_truth, name="seed", value=1)
    yield from (partial(_with_plain_sensors, name=name) for name in SensorMount.__slots__)
    yield from (partial(_with_plain_mount, name=name) for name in Mount.__slots__)
    for index in range(len(faults)):
        yield partial(_with_fault, index=index, name="duration_s", value=FOR_GOOD_S)
        for name in ("start_s", "magnitude"):
            for digits in DIGITS:
                yield partial(_rounded, index=index, name=name, digits=digits)


def _with_plain_mount(scenario: Scenario, name: str) -> Scenario:
    """The same rig with six axes, one figure of which is as it is where nobody gives it."""
    mount = scenario.truth.mount
    if mount is None:
        return scenario
    return _with_truth(scenario, "mount", _as_by_default(mount, name))


def _with_plain_sensors(scenario: Scenario, name: str) -> Scenario:
    """Likewise of the sensors of such a rig."""
    mount = scenario.truth.mount
    if mount is None:
        return scenario
    first, second = (_as_by_default(one, name) for one in (mount.sensor, mount.second_sensor))
    return _with_truth(scenario, "mount", replace(mount, sensor=first, second_sensor=second))


def _as_by_default(whole: _Part, name: str) -> _Part:
    default = next(part.default for part in fields(whole) if part.name == name)
    return whole if default is MISSING else replace(whole, **{name: default})


def _without_fault(scenario: Scenario, fault: WorldFault) -> Scenario:
    return with_faults(scenario, [one for one in scenario.truth.faults if one != fault])


def _without_incident(scenario: Scenario, incident: Incident) -> Scenario:
    return replace(scenario, incidents=tuple(i for i in scenario.incidents if i != incident))


def _with_truth(scenario: Scenario, name: str, value: Any) -> Scenario:
    return replace(scenario, truth=replace(scenario.truth, **{name: value}))


def _with_fault(scenario: Scenario, index: int, name: str, value: Any) -> Scenario:
    """This fault with another figure; nothing changes where there are fewer faults by now."""
    faults = list(scenario.truth.faults)
    if index < len(faults):
        faults[index] = replace(faults[index], **{name: value})
    return with_faults(scenario, faults)


def _rounded(scenario: Scenario, index: int, name: str, digits: int) -> Scenario:
    """This fault with fewer digits, where it has more."""
    if index >= len(scenario.truth.faults):
        return scenario
    before = getattr(scenario.truth.faults[index], name)
    value = float(f"{before:.{digits}g}")
    if len(str(value)) >= len(str(before)):
        return scenario
    return _with_fault(scenario, index, name, value)
