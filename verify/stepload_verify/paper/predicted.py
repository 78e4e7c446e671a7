"""Theory's predictions for the measured payloads. Deviations are shown but not counted: theory has
no scatter, and that of the measurements is the subject of the simulated runs."""

from __future__ import annotations

import numpy as np

from stepload.contact.elastic import equivalent_modulus
from stepload_verify.paper import laws, printed
from stepload_verify.paper.chart import Line, chart
from stepload_verify.paper.printed import PAYLOADS, SECANT_FORCE_N
from stepload_verify.paper.rows import number
from stepload_verify.paper.section import Section


def theory_against_tests() -> Section:
    """Secants that theory predicts, beside the measured ones of Table I."""
    sphere, cone, pyramid, metal = PAYLOADS
    lines = [
        "Secants at 300 N, beside RS-BTLS of the measured runs. Tips: elastic–plastic (15) with "
        "the printed yield strength. Spheres: rough (10) with the hardness chosen for Table II; "
        f"between 0.35 and 1.4 GPa it moves the plastic sphere by {_reach(sphere)}, the "
        f"aluminium sphere by {_reach(metal)}. 300 N is "
        f"{SECANT_FORCE_N / laws.limit(cone).force_n:.0f} F_c of the cone and "
        f"{SECANT_FORCE_N / laws.limit(pyramid).force_n:.0f} F_c of the pyramid: test 2 probably "
        "met tips flattened by test 1. The aluminium sphere is beyond K_max of the rig.",
        "",
        "| payload | law | chosen | predicted | test 1 | deviation | test 2 | deviation |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for payload, law, chosen, deformation in (
        (sphere, "rough (10)", "hardness", laws.rough(sphere).deformation(SECANT_FORCE_N)),
        (cone, "elastic–plastic (15)", "nothing", laws.plastic(cone).deformation(SECANT_FORCE_N)),
        (
            pyramid,
            "elastic–plastic (15)",
            "nothing",
            laws.plastic(pyramid).deformation(SECANT_FORCE_N),
        ),
        (metal, "rough (10)", "hardness", laws.rough(metal).deformation(SECANT_FORCE_N)),
    ):
        value = SECANT_FORCE_N / deformation.value
        tests = " | ".join(
            f"{test.secant} | {100 * (value / float(test.secant) - 1):+.1f} %"
            for test in payload.rs_btls
        )
        lines.append(f"| {payload.name} | {law} | {chosen} | {number(value)} | {tests} |")
    return Section("Theory beside measurement (Table I)", tuple(lines))


def _reach(payload: printed.Payload) -> str:
    """By how much the secant of (10) moves over a factor of two in hardness, either way."""
    secants = [
        SECANT_FORCE_N / laws.rough(payload, hardness_pa=h).deformation(SECANT_FORCE_N).value
        for h in (0.5 * printed.MICRO_HARDNESS_PA, printed.MICRO_HARDNESS_PA,
                  2.0 * printed.MICRO_HARDNESS_PA)
    ]  # fmt: skip
    soft, middle, hard = secants
    return f"{100 * (soft / middle - 1):+.1f} to {100 * (hard / middle - 1):+.1f} %"


def curves() -> Section:
    """Force–deformation curves of the four payloads by theory."""
    sphere, cone, pyramid, metal = PAYLOADS
    force = np.linspace(1.0, SECANT_FORCE_N, 120)

    def line(label: str, payload: printed.Payload, law: str, dashed: bool = False) -> Line:
        if law == "smooth":
            values = laws.smooth_array(payload)(force)
        elif law == "rough":
            values = np.array([laws.rough(payload).deformation(float(f)).value for f in force])
        else:
            contact = laws.plastic(payload)
            values = np.array([contact.continuous_deformation(float(f)).value for f in force])
        return Line(label, values * 1e6, force, dashed=dashed)

    spheres = chart(
        "Spheres on the aluminium plate: Hertz (7) and rough (10)",
        "deformation, µm",
        "force, N",
        [
            line("plastic, smooth", sphere, "smooth"),
            line("plastic, rough", sphere, "rough"),
            line("aluminium, smooth", metal, "smooth", dashed=True),
            line("aluminium, rough", metal, "rough", dashed=True),
        ],
    )
    tips = chart(
        "Cone and pyramid: Hertz (7) and elastic–plastic (14), continuous",
        "deformation, µm",
        "force, N",
        [
            line("cone, elastic", cone, "smooth", dashed=True),
            line("cone, elastic–plastic", cone, "plastic"),
            line("pyramid, elastic", pyramid, "smooth", dashed=True),
            line("pyramid, elastic–plastic", pyramid, "plastic"),
        ],
    )
    lines = [
        "Beyond F_c the exponent of a tip falls from 1.5 to 1.425 and 1.263 (14). Printed n̂ of "
        "the pyramid: 1.27 in test 1, 1.43 and 1.54 in test 2.",
        "",
        "![spheres](paper/theory-spheres.svg)",
        "",
        "![tips](paper/theory-tips.svg)",
    ]
    return Section(
        "Force–deformation curves by theory",
        tuple(lines),
        files={"theory-spheres.svg": spheres, "theory-tips.svg": tips},
    )


def counter_bodies() -> Section:
    """The E_eq correction between a steel platen and an aluminium plate (V-A)."""
    lines = [
        "For one geometry K = g·E_eq, with g and n of the geometry alone (3), (5), (7). A curve "
        "against another counter body is scaled at equal δ by F · E_eq,to / E_eq,from (4), as "
        "`stepload compare --curve-plate` does. Roughness weakens the effect.",
        "",
        "| payload | E_eq on steel, Pa | on aluminium, Pa | force, steel → aluminium | "
        "secant at 300 N |",
        "|---|---|---|---|---|",
    ]
    for payload in (PAYLOADS[0], PAYLOADS[3]):
        steel = equivalent_modulus(payload.material, printed.STEEL)
        plate = equivalent_modulus(payload.material, printed.ALUMINIUM)
        ratio = plate / steel
        lines.append(
            f"| {payload.name} | {number(steel)} | {number(plate)} | {100 * (ratio - 1):+.1f} % "
            f"| {100 * (ratio ** (1 / 1.5) - 1):+.1f} % |"
        )
    return Section("Between machines: counter bodies (V-A)", tuple(lines))
