"""Which payloads a rig can identify (29)–(36): the paper's Fig. 14, with arms of today."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from stepload.contact.power_law import secant_stiffness
from stepload.feasibility.draft_plan import plan_of
from stepload.identification.identifiability import identifiability
from stepload.plan.shipped import payload_folder
from stepload_verify.paper.chart import COLOURS, Line, chart
from stepload_verify.paper.printed import FLAT_FACE, LOG_K_MAX, PAYLOADS, SECANT_FORCE_N
from stepload_verify.paper.rows import Row, number, table
from stepload_verify.paper.section import Kind, Section
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
    spheres = {
        p.name: secant_stiffness(float(p.rs_btls[0].k), float(p.rs_btls[0].n), force_n)
        for p in PAYLOADS
    }
    flat = {name: float(FLAT_FACE) for name in ("aluminium cube", "aluminium prism")}
    return spheres | flat


def figure_14() -> Section:
    """K_max of the rigs (34) and where the payloads lie."""
    all_rigs = rigs()
    stvf = all_rigs[0]
    row = Row("log10 of K_max of the STVF rig, N/m (34)", LOG_K_MAX, math.log10(stvf.k_max()))
    head = " | ".join(rig.name for rig in all_rigs)
    lines = [
        "p = 2, s = 20, t = 5. A printed logarithm of two digits leaves 26 % open.",
        "",
        *table([row]),
        "",
        "Stiffness of each payload as a share of K_max; above 1 the rig cannot identify it. "
        "Secants at the rig's top force, by (28) from RS-BTLS of test 1; cube and prism with a "
        f"flat face, about {FLAT_FACE} N/m. The arms are stepload's profiles: indicative, not "
        "measured.",
        "",
        f"| | {head} |",
        "|---" * (1 + len(all_rigs)) + "|",
        _cells("top force, N", [f"{rig.top_force_n:.0f}" for rig in all_rigs]),
        _cells("position resolution, µm", [f"{1e6 * rig.resolution_m:.0f}" for rig in all_rigs]),
        _cells("K_s, N/m", [number(rig.stiffness_n_per_m) for rig in all_rigs]),
        _cells("K_max, N/m (34)", [number(rig.k_max()) for rig in all_rigs]),
    ]
    shares = [
        {name: s / rig.k_max() for name, s in secants(rig.top_force_n).items()} for rig in all_rigs
    ]
    lines += [_cells(name, [_share(share[name]) for share in shares]) for name in shares[0]]
    lines += ["", "![payload stiffness and K_max](paper/fig-14.svg)"]
    return Section(
        "What rigs can identify (29)–(36), Fig. 14",
        tuple(lines),
        Kind.THEORY,
        (row,),
        files={"fig-14.svg": _drawn(all_rigs)},
    )


def _share(value: float) -> str:
    return f"{value:.2g}" if value < 100.0 else f"{value:.0f}"


def _cells(name: str, texts: list[str]) -> str:
    return f"| {name} | {' | '.join(texts)} |"


def _drawn(all_rigs: list[Rig]) -> str:
    """K_max over K_s for each rig's resolution, its own K_s a dot; payloads are levels."""
    stiffness = np.geomspace(1e4, 1e9, 101)
    lines = []
    for rig, colour in zip(all_rigs, COLOURS, strict=False):
        curve = [rig._replace(stiffness_n_per_m=float(k)).k_max() for k in stiffness]
        lines.append(Line(f"K_max, {rig.name}", stiffness, np.array(curve), colour=colour))
        own = np.array([rig.stiffness_n_per_m])
        lines.append(Line("", own, np.array([rig.k_max()]), dots=True, colour=colour))
    levels: dict[float, list[str]] = {}
    for name, secant in secants(SECANT_FORCE_N).items():
        levels.setdefault(secant, []).append(name)
    ends = stiffness[[0, -1]]
    for secant, names in levels.items():
        lines.append(Line(", ".join(names), ends, np.full(2, secant), dashed=True))
    return chart(
        "Payload stiffness at 300 N and the largest identifiable one (34)",
        "K_s, N/m",
        "secant stiffness, N/m",
        lines,
        log_log=True,
    )
