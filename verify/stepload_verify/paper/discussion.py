"""What agrees, what does not, and why; how the curves were made."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stepload_verify.paper import laws, mesh, printed
from stepload_verify.paper.laws import ROUGHNESS_LEFT, YIELD_LEFT, Test
from stepload_verify.paper.printed import PAYLOADS, SPHERE
from stepload_verify.paper.section import Section
from stepload_verify.paper.simulated import RUNS, Kept

CAPTIONS = {
    "fig-4": "System deformation and force, against a rigid body (26)",
    "fig-5": "Plastic sphere, test 1, RS-BTLS",
    "fig-6": "Aluminium sphere, test 1, RS-BTLS",
    "fig-7": "K̂, n̂ and secant of the plastic sphere over time",
    "fig-8": "Plastic sphere: STVF test 2, Instron, finite elements with roughness",
    "fig-9": "Plastic cone",
    "fig-10": "Plastic pyramid",
    "fig-11": "Aluminium sphere",
    "fig-12": "Aluminium sphere: both tests, finite elements without and with roughness",
    "fig-13": "Plastic cone: both tests, finite elements with roughness, and with yield",
    "fig-14": "K_max (34) over K_s and K_r",
}


def payloads(kept: Kept) -> Section:
    return Section("Payload by payload", ("TODO",))


def figures(drawn: Mapping[str, str]) -> Section:
    """Figures 4 to 14."""
    lines = [
        "One simulated run each, with the zero known, so that runs and elements begin together. "
        "Dashed: the printed K̂, n̂. Bounds: half of the position resolution and twice the MSDE of "
        "the system stiffness."
    ]
    for name, caption in CAPTIONS.items():
        lines += ["", f"**Fig. {name[4:]}** {caption}", "", f"![{caption}](paper/{name}.svg)"]
    return Section("Figures 4 to 14", tuple(lines), files=drawn)


def elements() -> Section:
    """The meshes."""
    files = {}
    for payload in PAYLOADS:
        force, _ = mesh.kept()[payload.name]
        curve = laws.with_factors(payload, force, roughness=1.0)
        rows = (f"{d:.6e},{f:g}\n" for d, f in zip(curve, force, strict=True))
        files[f"elements-{payload.name.replace(' ', '-')}.csv"] = (
            "displacement_m,force_n\n" + "".join(rows)
        )
    return Section("Finite elements and (10)", ("TODO",), files=files)


def sequence() -> Section:
    """The simulated tests."""
    return Section("The sequence of tests", ("TODO",))


__all__ = ["ROUGHNESS_LEFT", "RUNS", "SPHERE", "YIELD_LEFT", "Test", "np", "printed"]
