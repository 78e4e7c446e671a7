"""Benefit of a stiffer pose for a payload: the guideline K_max (34) at its system stiffness."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from stepload.errors import BadInputError, RefusedError
from stepload.feasibility.map_grid import bench, most_push, specimen
from stepload.feasibility.theory import theory_of
from stepload.identification.conditions import Conditions
from stepload.identification.identifiability import Binding, Identifiability, identifiability, k_max
from stepload.plan.load import load_plan
from stepload.plan.source import read_source
from stepload.plan.tree import Mapping, parse_tree


@dataclass(frozen=True, slots=True)
class Press:
    """The press for which poses are chosen.

    Attributes:
        top_n: the top force.
        told: the conditions of an identification on this rig.
        payload: its name, "" where none is given.
        secant_n_per_m: its stiffness at the top force by theory, 0 without a payload.
        why: why the top force was lowered, "" where it was not.
    """

    top_n: float
    told: Conditions
    payload: str = ""
    secant_n_per_m: float = 0.0
    why: str = ""

    @property
    def gauge(self) -> bool:
        """Whether there is a gauge across the contact, so that K_s does not act."""
        return self.told.sources.system_stiffness_n_per_m is None

    def resolution_binds(self, stiffness_n_per_m: float) -> bool:
        """Whether (34) is limited by the resolution of the travel there, and not by the pose."""
        return not self.gauge and self._guideline(stiffness_n_per_m).binding is Binding.RESOLUTION

    def k_max(self, stiffness_n_per_m: float) -> float:
        """K_max (34) in N/m at a stiffness of the arm; constant with a gauge."""
        if self.gauge:
            return k_max(self.told, self.top_n)
        return self._guideline(stiffness_n_per_m).k_max_n_per_m

    def _guideline(self, stiffness_n_per_m: float) -> Identifiability:
        return identifiability(
            self.top_n, self.told.position_resolution_m, stiffness_n_per_m,
            p=self.told.p, s=self.told.s, t=self.told.t,
        )  # fmt: skip


def press_of(rig: str, payload: Path | None) -> Press:
    """The press of a payload file or of a plan's payload; else 300 N, at most 80 % of the rig.

    Raises:
        BadInputError: no such rig or payload, or a force that the rig cannot press with.
        PlanError: one of their files is invalid.
        RefusedError: the payload must not be pressed.
    """
    own = bench(rig, None)
    if payload is None:
        return Press(own.top_n, own.conditions)
    root, _ = parse_tree(read_source(payload))
    if isinstance(root, Mapping) and "procedure" in root.entries:
        plan = load_plan(payload)
        top_n = plan.procedure.top_force_n
        name, most_n = most_push(rig)
        if top_n > most_n:
            raise BadInputError(
                f"{payload}: its top force is {top_n:.4g} N, and rig {name} can press with "
                f"{most_n:.4g} N at most",
                hint="another rig, a plan with a lower top force, or the payload's own file",
            )
        secant = theory_of(plan.payload, top_n).stiffest.secant(top_n)
        requested = plan.identify
        told = replace(
            bench(rig, top_n).conditions, p=requested.resolution_multiple_p,
            s=requested.compensation_quality_s, t=requested.accuracy_t,
        )  # fmt: skip
        return Press(top_n, told, plan.payload.name, secant)
    body = specimen(rig, payload, own.top_n)
    if not body.top_n > 0.0:
        raise RefusedError(f"{body.name} must not be pressed on {own.name}: {body.why}")
    return Press(
        body.top_n, bench(rig, body.top_n).conditions, body.name, body.secant_n_per_m, body.why
    )
