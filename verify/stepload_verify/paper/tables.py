"""Every printed number beside ours: theory and Table III, Tables I and II, and those in prose."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from stepload.contact.elastic import equivalent_modulus
from stepload.contact.power_law import secant_stiffness
from stepload.identification.identifiability import identifiability
from stepload.identification.ls import rs_btls
from stepload_verify.paper import laws, mesh, printed
from stepload_verify.paper.laws import Test
from stepload_verify.paper.printed import (
    CONE,
    METAL,
    PAYLOADS,
    PYRAMID,
    SECANT_FORCE_N,
    SPHERE,
    Estimate,
    Payload,
)
from stepload_verify.paper.rows import (
    NEAR,
    Kind,
    Row,
    Section,
    grid,
    half_digit,
    meets,
    number,
    table,
)
from stepload_verify.paper.simulated import KNOWN, QUANTITIES, TOUCH, Kept
from stepload_verify.paper.step_load import STVF

UNITS = dict(zip(QUANTITIES, ("K̂, N/m^n", "n̂", "secant, N/m"), strict=True))
WIDEST_N, WIDEST_SECANT = 0.25, 0.2
"""Half widths of a band that shows nothing: half of the distance between the exponents of a sphere
and a cone; and 1/t, the accuracy that the paper asks for."""
_ESTIMATORS = (("RS-BTLS", "rs_btls"), ("RS-RTLS", "rs_rtls"))
_HARDNESS_PA = (0.35e9, 0.7e9, 1.4e9)


def theory() -> Section:
    """K (7) and F_c (13), Table III."""
    rows = [
        Row(f"{p.name}: {name}", text, ours, Kind.ARITHMETIC)
        for p in PAYLOADS
        for name, text, ours in (
            ("K, N/m^1.5 (7)", p.k, laws.smooth(p).k),
            ("F_c, N (13)", p.force_c, laws.limit(p).force_n),
        )
    ]
    text = "Arithmetic, on the aluminium plate; F_c with the yield strength of the softer body."
    return Section("Contact stiffness and elastic limit (Table III)", (text, "", *grid(rows, 2)),
                   tuple(rows))  # fmt: skip


def table_one(kept: Kept) -> Section:
    """Both tests and estimators on the STVF."""
    pairs = [
        pair
        for payload, (label, field), test in product(PAYLOADS, _ESTIMATORS, (Test.ONE, Test.TWO))
        for pair in _simulated(
            kept, payload, test, label, getattr(payload, field)[test is Test.TWO]
        )
    ]
    rows, beside = zip(*pairs, strict=True)
    return Section(
        "Table I",
        (
            "STVF. Ours: median and 5 to 95 % of the simulated runs, with the zero at a touch of "
            "3 N; in italics with the zero known.",
            "",
            *grid(rows, 3, beside),
            "",
            *_pairs_that_fit(),
        ),
        rows,
        beside,
    )


def table_two(kept: Kept) -> Section:
    """STVF and Instron simulated; finite elements without and with roughness."""
    tests = [
        pair
        for payload, (test, field) in product(
            PAYLOADS, ((Test.TWO, "rs_btls"), (Test.INSTRON, "instron"))
        )
        for pair in _simulated(
            kept, payload, test, "RS-BTLS",
            payload.rs_btls[1] if test is Test.TWO else payload.instron,
            repeats=test is Test.TWO,
        )
    ]  # fmt: skip
    meshes = [
        row
        for payload in PAYLOADS
        for kind, texts in ((Kind.ELEMENTS, payload.smooth), (Kind.FITTED, payload.rough))
        for row in _by_elements(payload, texts, kind)
    ]
    rows, beside = zip(*tests, strict=True)
    counted, known = ([row for row in side if not row.repeats] for side in (rows, beside))
    lines = [
        "The column *STVF, test 2* repeats RS-BTLS of Table I. The Instron meets a steel platen; "
        "its force is scaled by E_eq,aluminium / E_eq,steel, "
        f"{laws.counter_body(SPHERE):.3f} (acetal) and {laws.counter_body(METAL):.3f} (aluminium), "
        "as `stepload compare --curve-plate` does. Each run was simulated alone; the printed row "
        "is of averaged tests.",
        "",
        *grid(counted, 3, known),
        "",
        "Finite elements, without and with (10), at 30, 60 … 300 N:",
        "",
        *grid(meshes, 3),
        "",
        "K̂, n̂ and secant by (10) with another hardness:",
        "",
        "| hardness, GPa | " + " | ".join(p.name for p in PAYLOADS) + " |",
        "|---" * (1 + len(PAYLOADS)) + "|",
        *(
            f"| {h / 1e9:.2f} | "
            + " | ".join(", ".join(map(number, elements(p, 1.0, h))) for p in PAYLOADS)
            + " |"
            for h in _HARDNESS_PA
        ),
    ]
    return Section("Table II", tuple(lines), (*rows, *meshes), beside)


def prose(kept: Kept) -> Section:
    """The numbers in the text."""
    rows = [*_system(kept), *_figures(), *_repeats(), *_within()]
    return Section("In the text", tuple(table(rows)), tuple(rows))


def _system(kept: Kept) -> list[Row]:
    rows = []
    for rig, texts in (
        ("STVF", {"K_s, N/m": printed.K_S, "C_s, N·s/m": printed.C_S, "MSDE, m": printed.MSDE_M}),
        ("Instron", {"K_s, N/m": printed.INSTRON_K_S, "MSDE, m": printed.INSTRON_MSDE_M}),
    ):
        for quantity, text in texts.items():
            found = kept[rig, "calibration", "(26)", KNOWN, quantity.partition(",")[0]]
            wide = found.high - found.low > abs(found.median)
            why = "the line absorbs part of the error put in" if quantity == "MSDE, m" else ""
            rows.append(Row(f"{quantity} of the {rig} (26)", text, found.median, Kind.RETURNED,
                            (found.low, found.high), wide=wide, why=why))  # fmt: skip
    return rows


def _figures() -> list[Row]:
    k_max = identifiability(
        SECANT_FORCE_N, STVF.position_resolution_m, STVF.stiffness_n_per_m
    ).k_max_n_per_m
    range_m = SECANT_FORCE_N / STVF.stiffness_n_per_m
    face = 2.0 * equivalent_modulus(SPHERE.material, printed.ALUMINIUM)
    face *= printed.FACE_M / math.sqrt(math.pi)
    a = Kind.ARITHMETIC
    off_hertz = {name: off_hertz_percent(name) for name in mesh.kept()}
    spheres = max(off_hertz[p.name] for p in (SPHERE, METAL))
    return [
        Row("log10 of K_max of the STVF, N/m (34)", printed.LOG_K_MAX, math.log10(k_max), a),
        Row("SNR of the deformation, about: 300 N / K_s by 2 µm", printed.DEFORMATION_SNR,
            range_m / STVF.position_resolution_m, a),
        Row("SNR of the force, about: 300 N by 1.5 N", printed.FORCE_SNR,
            SECANT_FORCE_N / STVF.force_resolution_n, a),
        *(Row(f"secant of the plastic {name}, about, N/m: a punch of 60 mm × 60 mm",
              printed.FLAT_FACE, face, a, why="size not printed, chosen")
          for name in ("cube", "prism")),
        Row("300 N by F_c of the cone", printed.OVERLOAD,
            SECANT_FORCE_N / laws.limit(CONE).force_n, a),
        Row("finite elements against Hertz, force, both spheres, %", printed.OFF_HERTZ["spheres"],
            spheres, Kind.ELEMENTS, limit=True,
            why="where they are held is chosen for it"),
        *(Row(f"finite elements against Hertz, force, {p.name}, %", printed.OFF_HERTZ[p.name],
              off_hertz[p.name], Kind.ELEMENTS, why=why)
          for p, why in ((CONE, ""), (PYRAMID, "our edges are rounded, too"))),
    ]  # fmt: skip


def off_hertz_percent(name: str) -> float:
    """Largest deviation of force from Hertz at the same δ, in % of the force by Hertz."""
    (payload,) = (p for p in PAYLOADS if p.name == name)
    force, deformation = mesh.kept()[name]
    hertz = np.array([laws.smooth(payload).force(float(d)) for d in deformation])
    return float(100.0 * np.abs(force / hertz - 1.0)[force >= 30.0].max())


def _repeats() -> list[Row]:
    """Changes relative to test 1, from the printed secants."""
    return [
        Row(f"change of the RS-BTLS secant, {p.name}, % of test 1", printed.CHANGES[p.name],
            _change(p.rs_btls[0].secant, p.rs_btls[1].secant), Kind.ARITHMETIC)
        for p in (CONE, PYRAMID, METAL)
    ]  # fmt: skip


def _within() -> list[Row]:
    """What the text says of the tables, tried on their printed secants."""
    between = {
        p.name: max(abs(_change(b.secant, r.secant))
                    for b, r in zip(p.rs_btls, p.rs_rtls, strict=True))
        for p in PAYLOADS
    }  # fmt: skip
    spread = {}
    for p in PAYLOADS:
        three = [float(e.secant) for e in (p.rs_btls[1], p.instron, p.rough)]
        spread[p.name] = 100.0 * (max(three) / min(three) - 1.0)
    plastic = max(spread[p.name] for p in (SPHERE, CONE, PYRAMID))
    a = Kind.ARITHMETIC
    return [
        Row("both estimators in one test, largest difference of secants, %: a few",
            printed.ESTIMATORS_WITHIN, max(between.values()), a, limit=True,
            why=f"the aluminium sphere; of the plastic payloads "
            f"{max(between[p.name] for p in (SPHERE, CONE, PYRAMID)):.1f}"),
        Row("STVF, Instron, elements × (10), plastic, %: within or close to",
            printed.PLASTIC_WITHIN, plastic, a, limit=True,
            why="of the smallest: " + ", ".join(
                f"{p.name} {spread[p.name]:.1f}" for p in (SPHERE, CONE, PYRAMID))),
        Row("the same, aluminium sphere, %", printed.METAL_WITHIN, spread[METAL.name], a,
            limit=True),
    ]  # fmt: skip


def _change(one: str, two: str) -> float:
    return 100.0 * (float(two) / float(one) - 1.0)


def _simulated(
    kept: Kept, payload: Payload, test: Test, estimator: str, texts: Estimate,
    *, repeats: bool = False,
) -> list[tuple[Row, Row]]:  # fmt: skip
    """Rows with the zero at the touch, and known."""
    found = {
        (zero, q): kept[payload.name, test, estimator, zero, q]
        for zero, q in product((TOUCH, KNOWN), QUANTITIES)
    }
    rig = "Instron" if test is Test.INSTRON else f"{test}, {estimator}"
    pairs = []
    for quantity, text in zip(QUANTITIES, texts, strict=True):
        both = []
        for zero in (TOUCH, KNOWN):
            n, secant = found[zero, "n̂"], found[zero, "secant"]
            wide = (
                0.5 * (secant.high - secant.low) > WIDEST_SECANT * secant.median
                if quantity == "secant"
                else 0.5 * (n.high - n.low) > WIDEST_N
            )
            value = found[zero, quantity]
            both.append(
                Row(f"{payload.name}, {rig}: {UNITS[quantity]}", text, value.median,
                    Kind.SIMULATED, (value.low, value.high), _near(quantity, texts), wide,
                    repeats=repeats)
            )  # fmt: skip
        pairs.append((both[0], both[1]))
    return pairs


def _by_elements(payload: Payload, texts: Estimate, kind: Kind) -> list[Row]:
    return [
        Row(f"{payload.name}{', rough' if kind is Kind.FITTED else ''}: {UNITS[quantity]}", text,
            value, kind, near=_near(quantity, texts))
        for quantity, text, value in zip(
            QUANTITIES, texts, elements(payload, float(kind is Kind.FITTED)), strict=True
        )
    ]  # fmt: skip


def elements(
    payload: Payload, roughness: float, hardness_pa: float = printed.MICRO_HARDNESS_PA
) -> tuple[float, float, float]:
    """K̂, n̂, secant of the finite elements."""
    force = np.array(printed.FORCE_GRID_N)
    deformation = laws.with_factors(payload, force, roughness=roughness, hardness_pa=hardness_pa)
    fit = rs_btls(deformation, force, secant_force_n=SECANT_FORCE_N)
    return fit.k, fit.n, fit.secant_n_per_m


def _near(quantity: str, texts: Estimate) -> float:
    """5 %; of K̂ what 5 % of n̂ does to it at the printed secant."""
    if quantity != "K̂":
        return NEAR
    return math.expm1(NEAR * float(texts.n) * math.log(float(texts.secant) / SECANT_FORCE_N))


def secant_span(estimate: Estimate) -> tuple[float, float]:
    """Lowest and highest secant in N/m (28) of all K̂ and n̂ that are printed like these."""
    k, n = float(estimate.k), float(estimate.n)
    corners = [
        secant_stiffness(k + a * half_digit(estimate.k), n + b * half_digit(estimate.n),
                         SECANT_FORCE_N)
        for a, b in product((-1.0, 1.0), repeat=2)
    ]  # fmt: skip
    return min(corners), max(corners)


def misfits() -> list[tuple[str, Estimate]]:
    """Printed rows whose secant (28) is not that of their K̂ and n̂ within rounding."""
    return [
        (f"{p.name}, {place}", each)
        for p in PAYLOADS
        for place, each in (
            ("test 1, RS-BTLS", p.rs_btls[0]), ("test 2, RS-BTLS", p.rs_btls[1]),
            ("test 1, RS-RTLS", p.rs_rtls[0]), ("test 2, RS-RTLS", p.rs_rtls[1]),
            ("Instron", p.instron), ("finite elements", p.smooth),
            ("finite elements × (10)", p.rough),
        )
        if not meets(each.secant, *secant_span(each))
    ]  # fmt: skip


def _pairs_that_fit() -> list[str]:
    """Of the printed rows of both tables, those that do not fit together."""
    bad = misfits()
    lines = [
        f"The printed K̂ and n̂ give the printed secant by (28), within rounding, in "
        f"{28 - len(bad)} of 28 rows of both tables. Not in:",
        "",
    ]
    for name, each in bad:
        low, high = secant_span(each)
        needed = math.log(float(each.k) / SECANT_FORCE_N) / math.log(
            float(each.secant) / SECANT_FORCE_N
        )
        lines.append(
            f"- {name}: {each.secant} printed, {number(low)} to {number(high)} by (28); it needs "
            f"n̂ = {needed:.3f}, printed is {each.n}."
        )
    return lines
