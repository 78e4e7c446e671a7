"""Which payloads a rig can identify (29)–(36), with arms of today."""

from __future__ import annotations

from typing import NamedTuple

from stepload.contact.power_law import secant_stiffness
from stepload.feasibility.draft_plan import plan_of
from stepload.identification.identifiability import identifiability
from stepload.plan.shipped import payload_folder
from stepload_verify.paper.printed import FLAT_FACE, PAYLOADS, SECANT_FORCE_N
from stepload_verify.paper.rows import Section, number
from stepload_verify.paper.step_load import INSTRON, STVF

_ARMS = ("ur5e", "ur16e")
"""Profiles that come with stepload."""


class Rig(NamedTuple):
    """What (34) needs of a rig; the top force is at most that of Table I."""

    name: str
    top_force_n: float
    resolution_m: float
    stiffness_n_per_m: float

    def k_max(self) -> float:
        """K_max in N/m (34)."""
        return identifiability(
            self.top_force_n, self.resolution_m, self.stiffness_n_per_m
        ).k_max_n_per_m


def rigs() -> list[Rig]:
    """The paper's two rigs, and two arms from the profiles that come with stepload."""
    found = [
        Rig(name, SECANT_FORCE_N, rig.position_resolution_m, rig.stiffness_n_per_m)
        for name, rig in (("STVF", STVF), ("Instron", INSTRON))
    ]
    for name in _ARMS:
        rig = plan_of(name, payload_folder() / "stiff-flat.yaml", SECANT_FORCE_N).rig
        stiffness = rig.system_stiffness.stiffness_n_per_m
        top = min(rig.arm.max_push_n, SECANT_FORCE_N)
        found.append(Rig(rig.name, top, rig.arm.position_resolution_m, stiffness))
    return found


def secants(force_n: float) -> dict[str, float]:
    """Secant stiffness in N/m of the paper's payloads at a force: (28) on RS-BTLS of test 1.

    Cube and prism touch with a flat face: their stiffness does not depend on the force.
    """
    found = {
        p.name: secant_stiffness(float(p.rs_btls[0].k), float(p.rs_btls[0].n), force_n)
        for p in PAYLOADS
    }
    return found | {"plastic cube, prism": float(FLAT_FACE)}


def shares() -> Section:
    """K_max of the rigs (34) and the payloads as shares of it."""
    all_rigs = rigs()
    head = " | ".join(rig.name for rig in all_rigs)
    lines = [
        "p = 2, s = 20, t = 5. Secant at the rig's top force as a share of K_max; above 1 the rig "
        "cannot identify the payload. Secants by (28) from RS-BTLS of test 1; cube and prism "
        f"about {FLAT_FACE} N/m. The arms are stepload's profiles, not measured.",
        "",
        f"| | {head} |",
        "|---" * (1 + len(all_rigs)) + "|",
        _cells("top force, N", [f"{rig.top_force_n:.0f}" for rig in all_rigs]),
        _cells("position resolution, µm", [f"{1e6 * rig.resolution_m:.0f}" for rig in all_rigs]),
        _cells("K_s, N/m", [number(rig.stiffness_n_per_m) for rig in all_rigs]),
        _cells("K_max, N/m (34)", [number(rig.k_max()) for rig in all_rigs]),
    ]
    of_rigs = [
        {name: s / rig.k_max() for name, s in secants(rig.top_force_n).items()} for rig in all_rigs
    ]
    lines += [_cells(name, [f"{of[name]:.2g}" for of in of_rigs]) for name in of_rigs[0]]
    return Section("What rigs can identify (29)–(36)", tuple(lines))


def _cells(name: str, texts: list[str]) -> str:
    return f"| {name} | {' | '.join(texts)} |"
