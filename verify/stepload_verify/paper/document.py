"""The document: parts by what kind of evidence they are, counted apart, and what cannot be had."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from stepload_verify.paper import (
    arithmetic,
    chain,
    commands,
    fitted,
    predicted,
    rigs,
    simulated,
    table_one,
)
from stepload_verify.paper.bands import tally
from stepload_verify.paper.rows import Row
from stepload_verify.paper.section import Kind, Section

_HEAD = """\
# Against the paper

D. Verscheure, I. Sharf, H. Bruyninckx, J. Swevers and J. De Schutter, "Identification of contact
dynamics parameters for stiff robotic payloads". Numbers in parentheses are its equations.

This page is generated: `stepload paper --out docs/paper.md`. A printed number agrees where it meets
the computed one within half a unit of its last digit. The simulated part is seeded; its last digits
may differ between platforms. Kinds of evidence are counted apart:"""

_MISSING = """\
# What cannot be had

The text of the paper is not part of this project. These are missing:

- Table II but for the plastic sphere by finite elements, and its micro-hardness, if one was used;
- the text of V-A and V-B, but for the correction by E_eq: the commands above are our reading;
- the printed figures as numbers;
- the measured data: K̂ and n̂ of Table I cannot be computed again;
- the sizes of cube and prism."""


_SHOWS = {
    Kind.THEORY: "that these equations are the paper's",
    Kind.PAIRS: "that a printed row fits together",
    Kind.FITTED: "little: one number of three agrees by itself",
    Kind.TIPS: "that law, rig and errors as simulated can give what was measured",
    Kind.SPHERES: "the same, given the hardness chosen above",
}


@dataclass(frozen=True, slots=True)
class Part:
    """Sections of one kind of evidence, under one heading."""

    title: str
    about: str
    sections: tuple[Section, ...]

    def text(self) -> str:
        """The part as Markdown."""
        head = [f"# {self.title}", "", *((self.about, "") if self.about else ())]
        return "\n".join([*head, *(section.text() for section in self.sections)])


def computed_parts() -> list[Part]:
    """What follows from equations alone: exact, the same on every machine."""
    return [
        Part(
            "Arithmetic on printed numbers",
            "",
            (
                arithmetic.theory(),
                rigs.figure_14(),
                arithmetic.table_one_secants(),
                arithmetic.repeatability(),
            ),
        ),
        Part("Fitted", "", (fitted.finite_elements(),)),
        Part(
            "Predicted",
            "Theory beside measurement; deviations only, nothing is counted.",
            (predicted.theory_against_tests(), predicted.curves(), predicted.counter_bodies()),
        ),
    ]


def simulated_parts() -> list[Part]:
    """What seeded simulated runs give."""
    run = simulated.one_run_of()
    return [
        Part(
            "Simulated and identified",
            table_one.preface(),
            (
                table_one.tips(),
                table_one.spheres(),
                table_one.instron(),
                simulated.one_run(run),
                simulated.one_fit(run),
                simulated.recursion(run),
            ),
        ),
        Part("Checks of the chain", "", (chain.system_stiffness(),)),
    ]


def command_part() -> Part:
    """The experiments as commands."""
    return Part("As commands", "", (commands.other_means(), commands.robot_rig()))


def generate(out: Path) -> list[Row]:
    """Write the document to `out`, its figures and curves into the directory `paper` beside it.

    Returns the rows of arithmetic and fit whose printed and computed numbers do not agree.
    """
    computed, drawn = computed_parts(), simulated_parts()
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_text(text(computed, drawn), encoding="utf-8")
    files = out.parent / "paper"
    files.mkdir(exist_ok=True)
    for section in sections_of((*computed, *drawn)):
        for name, content in section.files.items():
            (files / name).write_text(content, encoding="utf-8")
    return disagreements(sections_of(computed))


def sections_of(parts: Iterable[Part]) -> list[Section]:
    """All of their sections."""
    return [section for part in parts for section in part.sections]


def text(computed: list[Part], drawn: list[Part]) -> str:
    """The Markdown of the whole document."""
    parts = (*computed, *drawn, command_part())
    return "\n".join([_HEAD, "", *summary(parts), "", *(p.text() for p in parts),
                      _MISSING, ""])  # fmt: skip


def summary(parts: Iterable[Part]) -> list[str]:
    """What is compared, by kind, with what agreement shows in each; and what differs."""
    sections = sections_of(parts)
    lines = ["| kind | numbers | agree | what agreement shows |", "|---|---|---|---|"]
    for kind in Kind:
        of_kind = [section for section in sections if section.kind is kind]
        rows = [row for section in of_kind for row in section.rows]
        found = tally([band for section in of_kind for band in section.bands])
        agree = f"{found.inside + sum(row.agrees for row in rows)}"
        if found.shows_nothing:
            agree += f", and {found.shows_nothing} in bands too wide to show anything"
        lines.append(f"| {kind} | {found.numbers + len(rows)} | {agree} | {_SHOWS[kind]} |")
    lines += [
        "| predicted; checks of the chain | not counted | | |",
        "",
        "What differs in the first three:",
        "",
    ]
    lines += [
        f"- {row.quantity}: printed {row.printed}, {100 * row.deviation:+.1f} %; {row.why}."
        for row in disagreements(sections)
    ]
    return lines


def disagreements(sections: Iterable[Section]) -> list[Row]:
    """Rows whose printed number is not met."""
    return [row for section in sections for row in section.rows if not row.agrees]
