"""A plan from answers: the first payload of a rig, and the lightest touch of it."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from stepload.errors import BadInputError, RefusedError
from stepload.feasibility.preflight import Preflight, derive, preflight_of
from stepload.feasibility.reason import PlanVerdict, Severity
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.problems import PlanError
from stepload.plan.references import names_a_file
from stepload.plan.shipped import payload_folder
from stepload.plan.source import read_source
from stepload.plan.whole_file import replace_file
from stepload.setup.answers import Answers
from stepload.setup.questions import QUESTIONS, UNKNOWN
from stepload.setup.yaml_keys import Value, below, flat, quoted, written
from stepload.units import format_quantity, parse_named

SHARES = (0.9, 0.7, 0.5, 0.35, 0.25)
"""Shares of the largest force that are tried as the top force, until one needs no warning."""
STEPS = 6
TOUCHES_N = (0.5, 1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 70.0, 100.0)
YOU = "stated"
FORCES = ("procedure.top_force", "procedure.step", "procedure.levels")
"""Keys by which a person may state the forces; only what they leave open is chosen here."""
_BODY = {
    "youngs_modulus": "E: data sheet; where it is not known a range, 1 GPa to 5 GPa",
    "poisson_ratio": "ν: data sheet; metals 0.27 to 0.35, plastics 0.3 to 0.45, rubber 0.49",
    "yield_strength": "Y: data sheet. F_c goes with its third power: write ± what it is known to",
}
NOTES: dict[str, str] = {
    "stepload": "Version of the plan format. All keys: docs/plan.md, or `stepload schema`",
    "payload": "What is pressed, and against what",
    "payload.name": "What it is called in reports; one piece of many: record.specimen",
    "payload.geometry": "Shape where it touches the plate",
    "payload.geometry.radius": "At the contact: drawing, radius gauge, or half the diameter",
    "payload.material": "Of the payload: the numbers of its data sheet, with ± where it tells it",
    **{f"payload.material.{key}": note for key, note in _BODY.items()},
    "payload.plate": "What it is pressed onto: stiff, flat, and strong enough not to be marked",
    "payload.force_limit": "F_c: the maker's figure, or what a twin bore before it yielded",
    "rig": "A rig file (`stepload setup`) or a profile (`stepload profiles`)",
    "procedure": "How it is pressed",
    "procedure.surface_distance": "From the start pose to the payload's touch: lead the arm there,"
    " or a ruler",
    "procedure.surface_uncertainty": "How wrong that may be: what the ruler and the mounting leave",
    "procedure.step": "Each level is this much above the one before",
    "procedure.top_force": "The highest level; preflight refuses what F_c does not allow",
}
"""Comments by dotted key."""


def materials() -> dict[str, dict[str, Value]]:
    """The materials of the payloads that come with stepload, by name."""
    found: dict[str, dict[str, Value]] = {}
    for path in sorted(payload_folder().glob("*.yaml")):
        values = flat(read_source(path), f"as in stepload's payload {path.stem}")
        for key in ("material", "plate"):
            if part := below(values, key):
                found.setdefault(part["name"].text.strip('"'), part)
    return found


def _material(answer: str, home: Path) -> dict[str, Value]:
    if names_a_file(answer):
        return flat(read_source(home / answer), f"your file {answer}")
    if answer not in (known := materials()):
        raise BadInputError(
            f"{answer!r} is no material that comes with stepload",
            hint=f"one of {', '.join(map(repr, sorted(known)))}; {UNKNOWN}; or a file with name,"
            " youngs_modulus, poisson_ratio and yield_strength",
        )
    return known[answer]


def _no_theory(answers: Answers) -> str:
    """The part of the payload without an elastic limit by theory; "" where it may have one."""
    if UNKNOWN in (answers.text("material"), answers.text("plate")):
        return "a material that is not known"
    return "a flat punch" if answers.text("shape") == "flat_punch" else ""


def _unknown(answers: Answers) -> dict[str, Value]:
    """A material of which nothing is known but a range of its modulus."""
    return {
        "name": Value("unknown", YOU),
        "youngs_modulus": Value(answers.text("modulus"), YOU),
        "poisson_ratio": Value("0 to 0.5", "all that it may be, nothing is known of it"),
    }


def plan_values(answers: Answers, home: Path) -> dict[str, Value]:
    """The payload, the place of its plan, and the keys of the procedure that a person states.

    Args:
        home: directory that files among the answers are sought from.

    Raises:
        BadInputError: an answer cannot be used, or one thing is stated in two answers.
    """
    values = {"stepload": Value("1", "")}
    described = answers.preset and "payload" not in answers.given
    if not described and (file := answers.text("payload")):
        values["payload"] = Value(quoted(file), YOU)
    else:
        name = answers.text("payload_name")
        values["payload.name"] = Value(quoted(name), answers.origin("payload_name"))
        for key in ("shape", "radius"):
            answer = answers.text(key)
            values[f"payload.geometry.{key}"] = Value(answer, answers.origin(key))
        for part in ("material", "plate"):
            answer = answers.text(part)
            found = _unknown(answers) if answer == UNKNOWN else _material(answer, home)
            values |= {f"payload.{part}.{key}": value for key, value in found.items()}
        if (limit := answers.text("force_limit")) != "none":
            values["payload.force_limit"] = Value(limit, YOU)
        elif why := _no_theory(answers):
            raise BadInputError(
                f"theory has no elastic limit for {why}: a person must declare it",
                hint='--force-limit "400 N": a force that it surely bears, from its maker or from'
                " one of its kind that was pressed until it yielded",
            )
    for key in ("surface_distance", "surface_uncertainty"):
        answer = answers.text(key)
        values[f"procedure.{key}"] = Value(answer, answers.origin(key))
    more = answers.words("procedure")
    for key in ("top_force", "surface_distance", "surface_uncertainty"):
        if key in more and (key in answers.given or answers.origin(key) == YOU):
            raise BadInputError(
                f"{key} is given twice: by {QUESTIONS[key].flag} and as a key of the procedure",
                hint="keep one of the two",
            )
    return values | {f"procedure.{key}": Value(text, YOU) for key, text in more.items()}


def with_forces(
    values: Mapping[str, Value], rig: str, top_n: float, steps: int, origin: str
) -> dict[str, Value]:
    """The values with the rig they are for, and with load steps up to `top_n`.

    Forces among the values stand as they are.
    """
    forces = {
        "procedure.step": Value(format_quantity(top_n / steps, "N"), f"top_force / {steps}"),
        "procedure.top_force": Value(format_quantity(top_n, "N"), origin),
    }
    if "procedure.levels" in values:
        del forces["procedure.step"]
    what = {key: value for key, value in values.items() if not key.startswith("procedure.")}
    chosen = {key: value for key, value in forces.items() if key not in values}
    return {**what, "rig": Value(quoted(rig), ""), **values, **chosen}


def preflight_here(
    values: Mapping[str, Value], path: Path, derived: Callable[[Plan], Preflight] = preflight_of
) -> Preflight:
    """The preflight of a plan that would stand at `path`; nothing is left on the disk.

    Raises:
        PlanError: the plan cannot be used.
        RefusedError: nothing is known of its elastic limit.
    """
    tried = path.with_name(f".{path.stem}.{os.getpid()}.yaml")
    try:
        tried.write_text(written(values), encoding="utf-8")
        return derived(load_plan(tried))
    except OSError as error:
        raise BadInputError(f"cannot write {path}: {error.strerror}") from error
    except PlanError as error:
        raise _called(error, str(tried), f"{path}, as the answers make it") from None
    finally:
        tried.unlink(missing_ok=True)


def _called(error: PlanError, name: str, called: str) -> PlanError:
    """The same problems, with the file `name` by the name that its user knows."""
    return PlanError(
        tuple(replace(p, file=called) if p.file == name else p for p in error.problems)
    )


def first_plan(answers: Answers, rig: str, path: Path) -> tuple[str, Preflight]:
    """The text of a plan that preflight does not refuse, and its preflight.

    Raises:
        RefusedError: preflight refuses it, with its reasons.
    """
    values = plan_values(answers, path.parent)
    stated, levels = values.get("procedure.top_force"), values.get("procedure.levels")
    requested = answers.text("top_force") if stated is None else stated.text
    if requested == "most" and stated is None and levels is not None:
        last = levels.text.strip("[] ").rpartition(",")[2]
        top_n, origin = parse_named("levels", last, "N"), "the last of the levels"
    elif requested == "most" and stated is None:
        top_n, origin = _most(values, rig, path)
    else:
        top_n, origin = parse_named(f"top_force {requested!r}", requested, "N"), YOU
    plan = with_forces(values, rig, top_n, STEPS, origin)
    preflight = preflight_here(plan, path)
    if preflight.verdict is PlanVerdict.REFUSED:
        raise refusal(preflight)
    head = ("Written by `stepload init`; behind each value: where it is from.",)
    return written(plan, head, NOTES), preflight


def _most(values: Mapping[str, Value], rig: str, path: Path) -> tuple[float, str]:
    """The highest top force that preflight has no warning of, else of no refusal, and its origin.

    It stays within what arm, sensor and table of the system's deflection are good for.

    Raises:
        RefusedError: no force is safe.
    """
    tried, lightest, _ = _lightest(values, rig, path, let_through=False)
    of, safe_n = tried.plan.rig, tried.largest_safe_force_n
    limits = {
        "the largest safe force": safe_n,
        "the push of the arm": of.arm.max_push_n,
        "the range of the sensor": of.force.range_n,
        "the end of the deflection table": max(
            of.system_stiffness.deflection_force_n, default=math.inf
        ),
    }
    name, most_n = min(limits.items(), key=lambda each: each[1])
    shares = SHARES if most_n == safe_n or SHARES[0] * safe_n < most_n else (1.0, *SHARES)
    choices = []
    for share in shares:
        top_n = float(f"{min(share * most_n, SHARES[0] * safe_n):.2g}")
        if not 0.0 < top_n <= safe_n:
            break
        shown = "" if share == 1.0 else f"{share:g} of "
        origin = f"{shown}{name}, {format_quantity(most_n, 'N')}"
        verdict = preflight_here(with_forces(values, rig, top_n, STEPS, origin), path).verdict
        if verdict is PlanVerdict.GO:
            return top_n, origin
        choices.append((verdict is PlanVerdict.REFUSED, top_n, origin))
    if not choices:
        raise refusal(preflight_here(lightest, path))
    _, top_n, origin = min(choices, key=lambda each: each[0])
    return top_n, origin


def touch_plan(answers: Answers, rig: str, path: Path) -> tuple[str, float]:
    """The plan of the lightest touch that preflight lets through, and its force in N.

    Raises:
        RefusedError: it lets none through, with the reasons against the strongest.
    """
    values = plan_values(answers, path.parent)
    values |= {
        "procedure.cycles": Value("1", "a touch only"),
        "procedure.settle_timeout": Value("2 s", "a level that is not reached is left, not held"),
        "identify.accept_unidentifiable": Value("a touch, not a measurement", ""),
    }
    preflight, plan, top_n = _lightest(values, rig, path, let_through=True)
    if preflight.verdict is PlanVerdict.REFUSED:
        raise refusal(preflight)
    return written(plan), top_n


def _lightest(
    values: Mapping[str, Value], rig: str, path: Path, *, let_through: bool
) -> tuple[Preflight, dict[str, Value], float]:
    """The valid plan of least force; with `let_through` the least not refused, else the strongest.

    Forces that the values state do not count here. Remedies take most of the time: they are tried
    for what `let_through` finds alone.

    Raises:
        PlanError: none makes a plan.
    """
    values = {key: value for key, value in values.items() if key not in FORCES}
    problem: PlanError | None = None
    last: tuple[Preflight, dict[str, Value], float] | None = None
    for top_n in TOUCHES_N:
        plan = with_forces(values, rig, top_n, 1, "the least that preflight lets through")
        try:
            last = preflight_here(plan, path, derive), plan, top_n
        except PlanError as error:  # a level must be above the force that counts as touch
            problem = error
            continue
        if not let_through:
            return last
        if last[0].verdict is not PlanVerdict.REFUSED:
            whole = preflight_here(plan, path)
            if whole.verdict is not PlanVerdict.REFUSED:
                return whole, plan, top_n
    if last is None:
        assert problem is not None
        raise problem
    _, plan, top_n = last
    return preflight_here(plan, path), plan, top_n


def refusal(preflight: Preflight) -> RefusedError:
    """The reasons of a preflight as one error."""
    reasons = [r for r in preflight.reasons if r.severity is Severity.REFUSE]
    return RefusedError(
        "preflight refuses the plan: " + "; ".join(reason.message for reason in reasons),
        hint="; ".join(reason.remedy for reason in reasons if reason.remedy),
    )


def write_plan(path: Path, text: str, force: bool) -> None:
    """Write a plan; a file that is there is kept.

    Raises:
        BadInputError: there is one and `force` is not given, or it cannot be written.
    """
    if path.exists() and not force and path.read_text(encoding="utf-8") != text:
        raise BadInputError(
            f"{path} is there already", hint="name another with --plan, or move it away"
        )
    try:
        replace_file(path, text.encode())
    except OSError as error:
        raise BadInputError(f"cannot write {path}: {error.strerror}") from error
