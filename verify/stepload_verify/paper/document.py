"""The document: every printed number beside ours, the figures, what they show, and commands."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from stepload_verify.paper import commands, discussion, intervals, rigs, simulated, tables
from stepload_verify.paper.figures import all_figures
from stepload_verify.paper.rows import SHOWS, Kind, Row, Section, Verdict
from stepload_verify.paper.simulated import SEED, Kept

KEPT = "simulated.csv"

_HEAD = """\
# Against the paper

D. Verscheure, I. Sharf, H. Bruyninckx, J. Swevers and J. De Schutter, "Identification of contact
dynamics parameters for stiff robotic payloads". Numbers in parentheses are its equations.

`stepload paper --out docs/paper.md` writes this page. Every printed number is counted once."""

_VERDICTS = """\
- **=** agrees: within half a unit of the last printed digit, or the printed number lies within the
  simulated 5 to 95 % band;
- **≈** near: ours, or the median, is within 5 %; K̂ within what 5 % of n̂ make of it;
- **?** shows nothing: inside a band wider than ±0.25 in n̂ or ±20 % in the secant;
- **≠** differs: the rest."""

_COUNTED = (
    "| evidence | numbers | = | ≈ | ? | ≠ | what it rests on |",
    "|---|---|---|---|---|---|---|",
)
_MISSING = """\
# What cannot be had

The text of the paper is not part of this project. These are missing:

- half-angles and bases of cone and pyramid, and what held the meshed bodies: chosen;
- the micro-hardness behind (10), and the shares that run in between the tests: chosen;
- where the paper took the zero of δ: simulated twice;
- the measured data of Table I: simulated;
- the printed figures as numbers; the sizes of cube and prism."""


Parts = Mapping[str, Sequence[Section]]
"""Sections by the heading over them."""


def parts(kept: Kept, *, figures: bool = True) -> Parts:
    """The whole page from what is kept; every number in it follows from that and equations."""
    counted = {key[-1]: found for key, found in kept.items() if key[1] == "intervals"}
    return {
        "The printed numbers":
            (tables.theory(), tables.table_one(kept), tables.table_two(kept), tables.prose(kept)),
        "What they show": (discussion.payloads(kept),),
        "Figures": (discussion.figures(all_figures() if figures else {}),),
        "How it was computed":
            (discussion.finite_elements(), discussion.sequence(), intervals.section(counted, SEED),
             rigs.shares()),
        "As commands": commands.sections(),
    }  # fmt: skip


def generate(out: Path) -> list[Row]:
    """Simulate, and write the page to `out`, its figures and curves into `paper` beside it.

    Returns the rows that differ.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    files = out.parent / "paper"
    files.mkdir(exist_ok=True)
    (files / KEPT).write_text(simulated.csv_of(simulated.simulate()), encoding="utf-8")
    made = parts(simulated.read(files / KEPT))
    out.write_text(text(made), encoding="utf-8")
    for section in sections_of(made):
        for name, content in section.files.items():
            (files / name).write_text(content, encoding="utf-8")
    return [row for row in counted_rows(made) if row.verdict is Verdict.DIFFERS]


def sections_of(made: Parts) -> list[Section]:
    """All of their sections."""
    return [section for part in made.values() for section in part]


def text(made: Parts) -> str:
    """The Markdown of the whole document."""
    body = [
        line
        for title, part in made.items()
        for line in (f"# {title}", "", *(section.text() for section in part))
    ]
    return "\n".join([_HEAD, "", *summary(made), "", _VERDICTS, "", *body, _MISSING, ""])


def counted_rows(made: Parts) -> list[Row]:
    """Every printed number that is not a repeat."""
    return [row for section in sections_of(made) for row in section.rows if not row.repeats]


def summary(made: Parts) -> list[str]:
    """How many printed numbers, by kind of evidence and verdict."""
    rows = [row for section in sections_of(made) for row in section.rows]
    once = counted_rows(made)
    known = [row for section in sections_of(made) for row in section.beside if not row.repeats]
    return [
        *_COUNTED,
        *(_counts(kind, [row for row in once if row.kind is kind], SHOWS[kind]) for kind in Kind),
        _counts("**all**", once, ""),
        _counts("not counted: simulated, zero known", known, "δ from the mean plane, as in (10)"),
        "",
        f"{len(rows)} numbers are printed; {len(rows) - len(once)} of them repeat Table I in "
        "Table II. Simulated runs that count begin at a touch of 3 N.",
    ]


def _counts(name: str, rows: list[Row], shows: str) -> str:
    found = Counter(row.verdict for row in rows)
    cells = " | ".join(str(found[verdict]) for verdict in Verdict)
    return f"| {name} | {len(rows)} | {cells} | {shows} |"
