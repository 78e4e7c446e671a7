"""Whole dry runs of the shipped UR5e plan on a rig with six axes, read with its three numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path

import stepload
from stepload.envelope.theory import theory_of
from stepload.plan.model import Plan, Provenance
from stepload.plan.mounting import Mounting
from stepload.record.outcome import RunStatus

COUPLING, SIGMA = 0.33, 0.03
K_SIGMA = 0.02


@dataclass(frozen=True, slots=True)
class Row:
    """One dry run: its settings, its result, and how the result compares with the truth."""

    friction: float
    tilt_deg: float
    askew_deg: float
    told: str
    error: float
    half_width: float
    covered: bool
    contact: str
    fires: tuple[str, ...]


def rows(plan: Path, out: Path, seed: int) -> Iterator[Row]:
    """Dry runs with a tip that sticks or slides, on a square plate and on a tilted one."""
    for friction in (0.6, 0.1):
        for tilt_deg, askew_deg in ((0.0, 0.0), (3.0, 2.0)):
            made = _plan(stepload.load_plan(plan), friction, tilt_deg, askew_deg)
            run = stepload.run(made, dry_run=True, out=out / f"{friction}-{tilt_deg:g}", seed=seed)
            yield _row(run, made, friction, tilt_deg, askew_deg)


def _plan(plan: Plan, friction: float, tilt_deg: float, askew_deg: float) -> Plan:
    """The plan with this mounting, calibrated: K_s to 2 %, the coupling to a tenth."""
    rig, sign = plan.rig, -1.0 if plan.rig.force.axis[0] == "-" else 1.0
    per_n = 1.0 / rig.system_stiffness.stiffness_n_per_m
    stiffness = replace(
        rig.system_stiffness,
        sigma_n_per_m=K_SIGMA * rig.system_stiffness.stiffness_n_per_m,
        provenance=Provenance.DECLARED,
        across_m_per_n=(sign * COUPLING * per_n, 0.0),
        across_sigma_m_per_n=(SIGMA * per_n, SIGMA * per_n),
        at_share=(0.0, 0.0),
    )
    mount = Mounting(
        coupling_x=COUPLING, friction=friction, tilt_x_rad=radians(tilt_deg),
        sensor_turn_y_rad=radians(askew_deg),
    )  # fmt: skip
    simulation = replace(rig.simulation, mount=mount, law="smooth")
    rig = replace(rig, system_stiffness=stiffness, simulation=simulation)
    procedure = replace(plan.procedure, cycles=2, unload=True)
    return replace(plan, rig=rig, procedure=procedure)


def _row(run: stepload.Run, plan: Plan, friction: float, tilt_deg: float, askew_deg: float) -> Row:
    assert run.results is not None
    if run.results["status"] == RunStatus.INTERRUPTED:
        raise KeyboardInterrupt
    chord, law = run.results["headline"], theory_of(plan.payload).law
    span_n = chord["to_n"] - chord["from_n"]
    truth = span_n / (law.deformation(chord["to_n"]) - law.deformation(chord["from_n"]))
    low, high = chord["interval_n_per_m"]
    contact = run.results["contact"]
    return Row(
        friction, tilt_deg, askew_deg, chord["verdict"], chord["value_n_per_m"] / truth - 1.0,
        (high - low) / (2.0 * chord["value_n_per_m"]), low <= truth <= high,
        f"{contact['share']:.1%} {contact['loop']['kind']}, slips {len(contact['slips'])}",
        tuple(gate["name"] for gate in run.results["gates"] if gate["fires"]),
    )  # fmt: skip
