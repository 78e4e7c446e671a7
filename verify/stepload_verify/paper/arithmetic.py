"""Arithmetic on what is printed: the equations of the theory, and (28) on printed estimates."""

from __future__ import annotations

import math
from itertools import product

from stepload.contact.power_law import secant_stiffness
from stepload_verify.paper import laws
from stepload_verify.paper.printed import PAYLOADS, SECANT_FORCE_N, Estimate
from stepload_verify.paper.rows import Row, half_digit, table
from stepload_verify.paper.section import Kind, Section

KINDS = (("RS-BTLS", "rs_btls"), ("RS-RTLS", "rs_rtls"))


def theory() -> Section:
    """K (7) and F_c (13), Table III."""
    rows = [Row(f"K of the {p.name}, N/m^1.5 (7)", p.k, laws.smooth(p).k) for p in PAYLOADS] + [
        Row(f"F_c of the {p.name}, N (13)", p.force_c, laws.limit(p).force_n) for p in PAYLOADS
    ]
    text = (
        "Spheres and tips on the aluminium plate: K from (4), (6), (7); F_c from (13) with the "
        "yield strength of the softer body."
    )
    return Section(
        "Contact stiffness and elastic limit (Table III)",
        (text, "", *table(rows)),
        Kind.THEORY,
        tuple(rows),
    )


def table_one_secants() -> Section:
    """Secants of Table I from its K̂ and n̂ by (28), with what their rounding leaves open."""
    rows = []
    for payload, test, label, estimate in _table_one():
        value = secant_stiffness(float(estimate.k), float(estimate.n), SECANT_FORCE_N)
        row = Row(
            f"{payload}, test {test}, {label}: secant, N/m",
            estimate.secant,
            value,
            secant_span(estimate),
        )
        if not row.agrees:
            ratio = float(estimate.secant) / SECANT_FORCE_N
            needed = math.log(float(estimate.k) / SECANT_FORCE_N) / math.log(ratio)
            why = (
                f"probably a misprint: with this K̂ the printed secant needs n̂ = {needed:.3f}, "
                f"printed is {estimate.n}"
            )
            row = Row(row.quantity, row.printed, row.computed, row.span, why)
        rows.append(row)
    text = (
        'The printed K̂ and n̂, put into (28) at 300 N, against the printed secant. "Can be" is '
        "what the rounding of both leaves open. Rows that agree are left out."
    )
    return Section(
        "Secant stiffness of Table I (28)",
        (text, "", *table([r for r in rows if not r.agrees])),
        Kind.PAIRS,
        tuple(rows),
    )


def secant_span(estimate: Estimate) -> tuple[float, float]:
    """Lowest and highest secant in N/m (28) of all K̂ and n̂ that are printed like these."""
    k, n = float(estimate.k), float(estimate.n)
    corners = [
        secant_stiffness(k + a * half_digit(estimate.k), n + b * half_digit(estimate.n),
                         SECANT_FORCE_N)
        for a, b in product((-1.0, 1.0), repeat=2)
    ]  # fmt: skip
    return min(corners), max(corners)


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
        "Printed numbers only. Secants repeat within 3 to 26 %. K̂ changes by a factor, because "
        "the errors of K̂ and n̂ are correlated: K̂ is a number only together with its n̂."
    )
    return Section("Test 1 against test 2 (Table I)", (text, "", *lines))


def _table_one() -> list[tuple[str, int, str, Estimate]]:
    return [
        (payload.name, test, label, getattr(payload, name)[test - 1])
        for payload in PAYLOADS
        for test in (1, 2)
        for label, name in KINDS
    ]
