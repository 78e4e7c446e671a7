"""The numbered equations that a page cites: their content, and the paper they come from."""

from __future__ import annotations

import re

from stepload.results.model import Document, Table

PAPER = (
    "D. Verscheure, I. Sharf, H. Bruyninckx, J. Swevers, J. De Schutter: Identification of contact "
    "dynamics parameters for stiff robotic payloads. IEEE Transactions on Robotics"
)

EQUATIONS = {
    1: "z = Σ b_i r^i: gap of an axisymmetric contact, leading term b_m r^m",
    2: "F = K δ^n: contact law",
    3: "K = (2m/(m+1)) E_eq (C_m b_m)^(-1/m): its stiffness from geometry and material",
    4: "1/E_eq = (1 − ν1²)/E1 + (1 − ν2²)/E2: equivalent modulus",
    5: "n = (m + 1)/m: its exponent",
    6: "1/R_eq = 1/R1 + 1/R2: equivalent radius of spheres",
    7: "K = 4/3 E_eq √R_eq, n = 3/2: sphere",
    8: "σ_eq = √(σ1² + σ2²): equivalent roughness",
    9: "κ = (E_eq/H_mic) √(R_eq/σ_eq): roughness number of a rough sphere",
    10: "δ of a rough sphere from the Hertzian δ_H, p0 and a_L",
    11: "p0 = 1/(1 + 1.22 α κ^-0.16): relative pressure of a rough sphere",
    12: "a_L: relative contact radius of a rough sphere",
    13: "F_c = (π P H)³ R_eq²/(6 E_eq²), H = 2.8 Y: elastic limit",
    14: "F(δ) beyond the elastic limit",
    15: "δ(F), the inverse of (14)",
    18: "least squares in force and deformation, weighted by their errors",
    19: "its constraint, the contact law",
    20: "ln F = ln K + n ln δ: contact law in logarithms",
    24: "element-wise weighted total least squares in logarithms",
    25: "row-scaled batch total least squares, RS-BTLS",
    26: "F = K_s δ_s + C_s dδ_s/dt: stiffness of the system",
    27: "δ_p = δ − F/K_s: deformation of the payload",
    28: "S = (F^(n−1) K)^(1/n): secant stiffness F/δ",
    29: "deformation against p times the position resolution",
    30: "deformation against 1/s of the deflection of the system",
    31: "deformation known to 1/t",
    32: "largest K that can be identified",
    34: "K_max: largest secant stiffness that can be identified",
    35: "(34) of a system that decides: s K_s/t",
    36: "(34) of a resolution that decides: K_r/(2 p t)",
}
"""Equations by their numbers in the paper, as docs and titles cite them."""

_CITED = re.compile(r"\((\d{1,2})\)")


def cited(document: Document) -> list[int]:
    """Numbers of the equations that the document's own words cite, rising.

    Content of a user's file (facts, cells, texts) is not searched, except for the first column of a
    table, which holds the names of its rows.
    """
    tables, figures = [*document.tables], [*document.figures]
    words = [document.verdict.text, *document.reasons]
    if (sheet := document.certificate) is not None:
        words += [*sheet.remarks, *(name for column in sheet.facts for name, _ in column)]
        tables += [*sheet.tables, *filter(None, [sheet.levels])]
        figures += filter(None, [sheet.figure])
    for table in tables:
        words += [table.title, *table.columns, *table.notes, *(row[0] for row in table.rows if row)]
    for figure in figures:
        words += [figure.title, figure.caption]
    return sorted({int(each) for each in _CITED.findall("\n".join(words))} & EQUATIONS.keys())


def equation_table(document: Document) -> Table:
    """Every equation that the document cites, with its reference; no rows where it cites none."""
    rows = [(f"({number})", EQUATIONS[number]) for number in cited(document)]
    return Table(
        "Equations", ("number", "what it says"), rows, (f"Numbers are those of {PAPER}.",),
        page_only=True,
    )  # fmt: skip
