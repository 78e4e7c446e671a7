"""A preflight on one screen: verdict, what costs most with its remedies, a few figures."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator

from stepload.errors import DomainError
from stepload.feasibility.advice import NONE_HELPS
from stepload.feasibility.conditions import expected_result
from stepload.feasibility.predicted import MESHED, can_be_meshed
from stepload.feasibility.preflight import Preflight
from stepload.feasibility.reason import PlanVerdict, Reason, findings
from stepload.feasibility.theory import DECLARED, chance_of_yield
from stepload.identification.expected import Expected
from stepload.plan.hazards import read_words, rig_argument
from stepload.plan.references import names_a_file, place_of
from stepload.report.terminal import NARROW, wrapped
from stepload.units import format_quantity as f
from stepload.units import rounded_down

MOST_FINDINGS = 3
MOST_WORDS = 120
"""Words above the figures; a finding that would exceed them is left to `--verbose`."""
LEAST_CHANCE = 1e-4
LABEL, VALUE = 15, 11
NOTE = 2 + LABEL + VALUE + 1


def headline(preflight: Preflight) -> str:
    """The verdict, and what it is about."""
    plan = preflight.plan
    procedure = plan.procedure
    top = f(procedure.top_force_n, "N")
    words = f"{preflight.verdict.upper():9}{plan.payload.name} on {plan.rig.name}, "
    if preflight.verdict is PlanVerdict.REFUSED:
        return wrapped(f"{words}{top}", 9)
    levels, cycles = len(procedure.levels_n), procedure.cycles
    number, _, unit = f(procedure.levels_n[0], "N").partition(" ")
    first = f"{number if unit == top.split()[1] else f'{number} {unit}'} to " if levels > 1 else ""
    steps = "1 step" if levels == 1 else f"{levels} steps"
    often = "1 cycle" if cycles == 1 else f"{cycles} cycles"
    about = f"about {duration(preflight.duration_s)}"
    return wrapped(f"{words}{first}{top} in {steps}, {often}, {about}", 9)


def duration(seconds: float) -> str:
    """A time as people say it: 48 s, 3.5 min, 12 min."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    minutes = seconds / 60.0
    return f"{minutes:.0f} min" if minutes > 9.5 else f"{round(2.0 * minutes) / 2.0:g} min"


def finding_lines(preflight: Preflight) -> list[str]:
    """What changes the verdict, the costliest first, each with its remedy and the key's place."""
    lines: list[str] = []
    shown: list[Reason] = []
    words = len(headline(preflight).split())
    for reason in findings(preflight.reasons)[:MOST_FINDINGS]:
        words += len(f"{reason.message} {reason.remedy}".split()) + 2
        if words > MOST_WORDS and shown:
            break
        shown.append(reason)
    last = {reason.remedy: number for number, reason in enumerate(shown, 1)}
    for number, reason in enumerate(shown, 1):
        lines.append(wrapped(f"  {number} {reason.message}", 4))
        if reason.remedy and last[reason.remedy] == number:
            lines.append(_remedy(preflight, reason))
    return lines


def _remedy(preflight: Preflight, reason: Reason) -> str:
    line = wrapped(f"    -> {reason.remedy}", 7)
    place = None if reason.remedy == NONE_HELPS else place_of(preflight.plan, reason.key)
    if place is None:
        return line
    last = line.rpartition("\n")[2]
    where = f"{short_path(place.source.name)}:{place.line}:{place.column}"
    if len(last) + 2 + len(where) <= NARROW:
        return f"{line}{where:>{NARROW - len(last)}}"
    return f"{line}\n{where:>{NARROW}}"


def short_path(name: str) -> str:
    """A path as it is named, or from the working directory where that is shorter."""
    return min(name, os.path.relpath(name), key=len)


def figure_lines(preflight: Preflight) -> list[str]:
    """The figures of a plan, at most a dozen rows."""
    return [_row(*row) for row in figures(preflight)]


def last_lines(preflight: Preflight) -> list[str]:
    """Where the hazards of the rig and the rest of the preflight are found."""
    plan, more = preflight.plan, "more: --verbose"
    argument = rig_argument(plan)
    shown = short_path(argument) if names_a_file(argument) else argument
    line = f"hazards of this rig: stepload hazards {shown} ({read_words(plan)})"
    room = NARROW - len(line)
    if room > len(more) + 1:
        return [f"{line}{more:>{room}}"]
    if room < 0:
        line = wrapped(f"stepload hazards {shown} ({read_words(plan)})", 2)
    return [line, more]


def figures(preflight: Preflight) -> Iterator[tuple[str, str, str]]:
    """Label, value and note of each figure."""
    plan, theory = preflight.plan, preflight.theory
    top_n, refused = plan.procedure.top_force_n, preflight.verdict is PlanVerdict.REFUSED
    yield "top force", f(top_n, "N"), _of_limit(preflight)
    if refused:
        safe_n = preflight.largest_safe_force_n
        yield (
            "largest safe",
            f(rounded_down(safe_n), "N"),
            "F_c used, less sensor errors and headroom",
        )
    else:
        yield "stops at", f(preflight.force_limit_n, "N"), chance_words(preflight)
    laws = [theory.stiffest, theory.softest] if theory.is_range else [theory.law]
    deformations = [f(law.deformation(top_n), "m") for law in laws]
    secants = " to ".join(f(law.secant(top_n), "N/m") for law in reversed(laws))
    note = f"secant at {f(top_n, 'N')} {secants}, theory {theory.law.equation}"
    if len(deformations) > 1:
        note = f"to {deformations[1]}, {secants}"
    yield "deformation", deformations[0], note
    if theory.law.equation != MESHED and can_be_meshed(preflight.plan.payload):
        yield "body", "left out", "until `stepload predict` has meshed it"
    expected = None if refused else expected_of(preflight)
    if expected is not None:
        chord = expected.chord
        ends = f"chord {f(chord.from_n, 'N')} to {f(chord.to_n, 'N')}"
        needed = f"needed: ±{100.0 / plan.identify.accuracy_t:.3g} %"
        yield "result will be", half_width(chord.half_width), f"{ends}; {needed}"
    if (found := preflight.identifiability) is not None:
        yield "K_max", f(found.k_max_n_per_m, "N/m"), f"(34), {found.binding} binds"
    ways = expected.narrowing if expected is not None else []
    if ways:
        told = [f"{way.todo}: {half_width(way.half_width)}" for way in ways]
        yield "narrower with", "", "; ".join(told)


def half_width(share: float) -> str:
    """Half of an interval as a share of the value."""
    return f"±{100.0 * share:.2g} %" if share < 1.0 else "> ±100 %"


def expected_of(preflight: Preflight) -> Expected | None:
    """The result that is to be expected; None where there is none to predict."""
    if preflight.plan.identify.kind == "system":
        return None
    try:
        found = expected_result(preflight.plan, preflight.theory, preflight.loading_times)
    except DomainError:
        return None
    return found if math.isfinite(found.chord.half_width) else None


def chance_words(preflight: Preflight) -> str:
    """The probability that the true F_c is below the largest force at which the run goes on."""
    chance = chance_of_yield(preflight.plan.payload, preflight.theory, preflight.force_limit_n)
    if chance is None:
        return "F_c stated, taken as is"
    shown = f"{100.0 * chance:.2g} %" if chance >= LEAST_CHANCE else "< 0.01 %"
    return f"chance that this run yields it: {shown}, from F_c"


def _of_limit(preflight: Preflight) -> str:
    """The top force beside F_c, and the part of F_c that is used."""
    theory, top_n = preflight.theory, preflight.plan.procedure.top_force_n
    limit_n, counted = theory.elastic_limit_n, theory.counted
    share = top_n / limit_n
    times = f"{share:.3g} times" if share > 1.0 else f"{100.0 * share:.0f} % of"
    sources = {DECLARED: "(stated)", MESHED: "(mesh)"}
    source = sources.get(theory.limit_equation, theory.limit_equation.split()[0])
    words = f"{times} F_c = {f(limit_n, 'N')} {source}"
    if counted.lower_n >= limit_n:
        return words
    words += f"; F_c used: {f(counted.lower_n, 'N')}"
    coverage = f" (k = {counted.coverage:g})"
    return words + coverage if len(words + coverage) <= NARROW - NOTE else words


def _row(label: str, value: str, note: str) -> str:
    line = f"  {label:<{LABEL}}{value:<{VALUE}} {note}" if value else f"  {label:<{LABEL}}{note}"
    return wrapped(line, 2 + LABEL)
