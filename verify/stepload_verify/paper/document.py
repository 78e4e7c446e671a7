"""The document: all sections, what differs, and what cannot be had."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from stepload_verify.paper import equations, simulated
from stepload_verify.paper.rows import Row
from stepload_verify.paper.section import Section

_HEAD = """\
# Against the paper

D. Verscheure, I. Sharf, H. Bruyninckx, J. Swevers and J. De Schutter, "Identification of contact
dynamics parameters for stiff robotic payloads". Numbers in parentheses are its equations.

This page is generated: `python -m stepload_verify.paper --out docs/paper.md`. The first part
follows from equations alone; the second from seeded simulated runs, whose last digits may move with
the platform. "All digits" means: equal to the printed number in every digit printed. A limit in
percent is the largest deviation that is called agreement."""

_MISSING = """\
## What cannot be had

The printed figures exist here only by what they show, not as numbers: no printed curve is compared
point by point, and figures carry no number of the paper's. What they show is computed above:

| subject of a printed figure | here |
|---|---|
| elastic, rough and elastic–plastic contact | *Force–deformation curves by theory* |
| K_max over rig and payloads | *What the rig can identify* |
| system stiffness, force over displacement | *System stiffness (26)*, simulated |
| measured force and displacement over time | *A simulated run* |
| identified against measured force–deformation curves | *A simulated run, identified* |
| course of the recursive estimate | *The recursive estimate*, simulated |
| two tests of one payload | *Test 1 against test 2*, *Table I from simulated runs* |
| STVF against Instron | *Between machines* has the correction; the curves are measured ones |
| finite elements | *Rough plastic sphere*: (10) stands in for the mesh |

Not to be had at all:

- K̂ and n̂ of Table I digit by digit: they need the measured data. Simulated runs stand beside them.
- Finite elements, aluminium row of Table II: depends on choices near F = 0 that are not printed.
- Photographs and drawings of the rigs, payloads and meshes.
- The measured curves of both machines, and so their difference after the E_eq correction of V-A."""


def generate(out: Path) -> list[Row]:
    """Write the document to `out` and its figures beside it, in a directory named like it.

    Returns the rows whose printed and computed numbers do not agree.
    """
    first, second = equations.sections(), simulated.sections()
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(text(first, second), encoding="utf-8")
    figures = out.with_suffix("")
    figures.mkdir(exist_ok=True)
    for section in (*first, *second):
        for name, svg in section.figures.items():
            (figures / name).write_text(svg, encoding="utf-8")
    return disagreements((*first, *second))


def text(first: list[Section], second: list[Section]) -> str:
    """The Markdown of sections from equations and sections from simulated runs."""
    rows = [row for section in (*first, *second) for row in section.rows]
    off = disagreements((*first, *second))
    summary = [
        f"{len(rows)} numbers are compared, {len(rows) - len(off)} agree. What differs:",
        "",
        *(
            f"- {row.quantity}: printed {row.printed}, {100 * row.deviation:+.1f} %; {row.why}."
            for row in off
        ),
    ]
    parts = [
        _HEAD,
        "",
        *summary,
        "",
        "# From equations",
        "",
        *(section.text() for section in first),
        "# From simulated runs",
        "",
        *(section.text() for section in second),
        _MISSING,
        "",
    ]
    return "\n".join(parts)


def disagreements(sections: Iterable[Section]) -> list[Row]:
    """Rows beyond their limits."""
    return [row for section in sections for row in section.rows if not row.agrees]
