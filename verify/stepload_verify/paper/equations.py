"""What follows from the paper's equations alone: exact, the same on every machine."""

from __future__ import annotations

import math

import numpy as np

from stepload.contact.elastic import equivalent_modulus
from stepload.contact.power_law import secant_stiffness
from stepload.identify.identifiability import identifiability
from stepload.identify.ls import rs_btls
from stepload_verify.paper import laws, printed
from stepload_verify.paper.chart import Line, chart
from stepload_verify.paper.printed import PAYLOADS, SECANT_FORCE_N, Estimate
from stepload_verify.paper.rows import Row, number, table
from stepload_verify.paper.section import Section
from stepload_verify.paper.step_load import STVF

KINDS = (("RS-BTLS", "rs_btls"), ("RS-RTLS", "rs_rtls"))


def sections() -> list[Section]:
    """All sections in the order of the document."""
    return [
        theory(),
        table_one_secants(),
        repeatability(),
        finite_elements(),
        theory_against_tests(),
        curves(),
        feasibility(),
        counter_bodies(),
    ]


def theory() -> Section:
    """K (7) and F_c (13), Table III."""
    rows = [Row(f"K of the {p.name}, N/m^1.5 (7)", p.k, laws.smooth(p).k) for p in PAYLOADS] + [
        Row(f"F_c of the {p.name}, N (13)", p.force_c, laws.limit(p).force_n) for p in PAYLOADS
    ]
    text = (
        "Spheres and tips on the aluminium plate: K from (4), (6), (7); F_c from (13) with the "
        "yield strength of the softer body. Cone and pyramid touch with their spherical tips."
    )
    return Section(
        "Contact stiffness and elastic limit (Table III)", (text, "", *table(rows)), tuple(rows)
    )


def table_one_secants() -> Section:
    """Secants of Table I from its K̂ and n̂ by (28)."""
    rows = []
    for payload, test, label, estimate in _table_one():
        value = secant_stiffness(float(estimate.k), float(estimate.n), SECANT_FORCE_N)
        suspect = (payload, test, label) == ("aluminium sphere", 2, "RS-RTLS")
        why = ""
        if suspect:
            span = math.log(float(estimate.k) / SECANT_FORCE_N)
            needed = span / math.log(float(estimate.secant) / SECANT_FORCE_N)
            why = (
                f"probably a misprint, the printed secant would need n̂ = {needed:.3f}, "
                f"printed is {estimate.n}"
            )
        rows.append(
            Row(f"{payload}, test {test}, {label}: secant, N/m", estimate.secant, value, 0.04, why)
        )
    text = (
        "The printed K̂ and n̂, put into (28) at 300 N, against the printed secant. n̂ is printed "
        "with two decimals; half a unit of the last moves the secant by about 3 %."
    )
    return Section("Secant stiffness of Table I", (text, "", *table(rows)), tuple(rows))


def repeatability() -> Section:
    """Test 1 against test 2: what repeats and what does not."""
    lines = [
        "| payload | estimator | secant, change | n̂, change | K̂, test 2 / test 1 |",
        "|---|---|---|---|---|",
    ]
    for payload in PAYLOADS:
        for label, name in KINDS:
            one, two = getattr(payload, name)
            s1, s2 = float(one.secant), float(two.secant)
            lines.append(
                f"| {payload.name} | {label} | {200 * (s2 - s1) / (s1 + s2):+.1f} % "
                f"| {float(two.n) - float(one.n):+.2f} | {float(two.k) / float(one.k):.3g} |"
            )
    text = (
        "No new numbers, only the printed ones set against each other: the secant repeats within a "
        "few percent where K̂ moves by a factor, because K̂ and n̂ err together along one line. "
        "Report the secant; K̂ is a number only together with its n̂."
    )
    return Section("Test 1 against test 2 (Table I)", (text, "", *lines))


def finite_elements() -> Section:
    """Table II, plastic sphere: rough contact on the force grid, RS-BTLS."""
    contact = laws.rough(PAYLOADS[0])
    force = np.array(printed.FORCE_GRID_N)
    deformation = np.array([contact.deformation(float(f)).value for f in force])
    fit = rs_btls(deformation, force, secant_force_n=SECANT_FORCE_N)
    row = printed.FINITE_ELEMENTS
    rows = [
        Row("K̂, N/m^n", row.k, fit.k, 0.05, "K̂ moves 10 % per 0.01 of n̂"),
        Row("n̂", row.n, fit.n),
        Row("secant, N/m", row.secant, fit.secant_n_per_m, 0.005),
    ]
    text = (
        "In place of finite elements: Hertz with roughness (10) at 30, 60 … 300 N, σ_eq = 7.5 µm, "
        "fitted by RS-BTLS. The micro-hardness is not printed; 0.7 GPa is assumed. "
        "The aluminium row of Table II depends on unprinted choices near F = 0 and cannot be had."
    )
    return Section("Rough plastic sphere (Table II)", (text, "", *table(rows)), tuple(rows))


def theory_against_tests() -> Section:
    """Secants that theory predicts, against the measured ones of Table I."""
    sphere, cone, pyramid, metal = PAYLOADS
    top = SECANT_FORCE_N
    predictions = (
        (sphere, "rough (10)", laws.rough(sphere).deformation(top).value, 0.05, ""),
        (cone, "elastic–plastic (15)", laws.plastic(cone).deformation(top).value, 0.10, ""),
        (
            pyramid,
            "elastic–plastic (15)",
            laws.plastic(pyramid).deformation(top).value,
            0.10,
            "test 2 probably met a tip flattened by test 1",
        ),
        (
            metal,
            "rough (10)",
            laws.rough(metal).deformation(top).value,
            0.10,
            "beyond K_max of the rig, and above F_c = 261 N",
        ),
    )
    rows, lines = [], []
    for payload, law, deformation, allowed, why in predictions:
        for test in (1, 2):
            value = top / deformation
            measured = payload.rs_btls[test - 1].secant
            off = abs(value / float(measured) - 1) > allowed
            rows.append(
                Row(
                    f"{payload.name}, {law}, test {test}: secant, N/m",
                    measured,
                    value,
                    allowed,
                    why if off else "",
                )
            )
    lines = [
        "Theory knows nothing of the rig, so this is the paper's claim put to the test: secants at "
        "300 N of the law that applies, against RS-BTLS of the measured runs. F = 300 N is 31 F_c "
        "for the cone and 250 F_c for the pyramid: both tips yield in their first run.",
        "",
        *table(rows),
    ]
    return Section("Theory against measurement (Table I)", tuple(lines), tuple(rows))


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
        "Beyond F_c a tip gives way: its exponent falls from 1.5 to 1.425 and 1.263 (14). The "
        "n̂ = 1.27 of the pyramid in test 1 is the last of these within its rounding and errors.",
        "",
        "![spheres](paper/theory-spheres.svg)",
        "",
        "![tips](paper/theory-tips.svg)",
        "",
        "| payload | law | δ at 100 N, µm | at 200 N | at 300 N |",
        "|---|---|---|---|---|",
    ]
    for name, payload, law in (
        ("plastic sphere", sphere, "smooth"),
        ("plastic sphere", sphere, "rough"),
        ("plastic cone", cone, "plastic"),
        ("plastic pyramid", pyramid, "plastic"),
        ("aluminium sphere", metal, "smooth"),
        ("aluminium sphere", metal, "rough"),
    ):
        curve = line(name, payload, law)
        at = np.interp([100.0, 200.0, 300.0], curve.y, curve.x)
        cells = " | ".join(number(float(a)) for a in at)
        lines.append(f"| {name} | {law} | {cells} |")
    return Section(
        "Force–deformation curves by theory",
        tuple(lines),
        figures={"theory-spheres.svg": spheres, "theory-tips.svg": tips},
    )


def feasibility() -> Section:
    """K_max of the rig (34) and where the payloads lie."""
    rig = identifiability(STVF.top_force_n, STVF.position_resolution_m, STVF.stiffness_n_per_m)
    rows = [
        Row(
            "log10 of K_max of the STVF rig, N/m (34)",
            printed.LOG_K_MAX,
            math.log10(rig.k_max_n_per_m),
        )
    ]
    lines = [
        "p = 2, s = 20, t = 5; F_max = 300 N, δ_Δ = 2 µm, K_s = 3.49e6 N/m.",
        "",
        *table(rows),
        "",
        f"K_max = {number(rig.k_max_n_per_m)} N/m, ruled by {rig.binding.value}; limits: "
        f"(35) {number(rig.limit_stiff_resolution_n_per_m)}, "
        f"(36) {number(rig.limit_stiff_system_n_per_m)} N/m.",
        "",
        "| payload | printed secant (test 1, RS-BTLS) | share of K_max | identifiable |",
        "|---|---|---|---|",
    ]
    for payload in PAYLOADS:
        share = float(payload.rs_btls[0].secant) / rig.k_max_n_per_m
        verdict = "yes" if share <= 1 else "no"
        lines.append(f"| {payload.name} | {payload.rs_btls[0].secant} | {share:.2f} | {verdict} |")
    stiffness = np.geomspace(1e4, 1e9, 101)
    k_r = STVF.top_force_n / STVF.position_resolution_m
    largest = np.array(
        [
            identifiability(STVF.top_force_n, STVF.position_resolution_m, float(k)).k_max_n_per_m
            for k in stiffness
        ]
    )
    figure = chart(
        "Largest identifiable stiffness (34) over system stiffness",
        "K_s, N/m",
        "K_max, N/m",
        [
            Line("K_max (34)", stiffness, largest),
            Line("(35) K_r ≫ K_s", stiffness, 20 * stiffness / 5, dashed=True),
            Line("(36) K_s ≫ K_r", stiffness, np.full(101, k_r / 20), dashed=True),
            *(
                Line(p.name, np.array([3.49e6]), np.array([float(p.rs_btls[0].secant)]), dots=True)
                for p in PAYLOADS[::3]
            ),
        ],
        log_log=True,
    )
    lines += ["", "![K_max](paper/k-max.svg)"]
    return Section(
        "What the rig can identify (29)–(36)",
        tuple(lines),
        tuple(rows),
        {"k-max.svg": figure},
    )


def counter_bodies() -> Section:
    """The E_eq correction between a steel platen and an aluminium plate (V-A)."""
    lines = [
        "For one geometry K = g·E_eq, with g and n of the geometry alone (3), (5), (7). A curve "
        "measured against another counter body is carried over at equal δ by "
        "F · E_eq,to / E_eq,from (4). Printed values are not available for comparison.",
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


def _table_one() -> list[tuple[str, int, str, Estimate]]:
    return [
        (payload.name, test, label, getattr(payload, name)[test - 1])
        for payload in PAYLOADS
        for test in (1, 2)
        for label, name in KINDS
    ]
