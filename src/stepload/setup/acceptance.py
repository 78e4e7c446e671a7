"""The last steps: the plan of the first payload, the doctor's examination, the lightest touch."""

from __future__ import annotations

from pathlib import Path

from stepload.errors import RefusedError
from stepload.feasibility.preflight import preflight_of
from stepload.feasibility.reason import Severity
from stepload.plan.load import load_plan
from stepload.record.outcome import RunStatus
from stepload.setup import checkup
from stepload.setup.bench import Setup
from stepload.setup.check_line import Mark
from stepload.setup.first_plan import first_plan, touch_plan, write_plan
from stepload.setup.start_pose import stands_at_start
from stepload.setup.state import Found
from stepload.setup.yaml_keys import Value
from stepload.units import format_quantity

DOCTOR_S = 5.0


def plan(setup: Setup) -> Found:
    """The plan of the first payload; it has passed preflight."""
    path = setup.plan
    text, preflight = first_plan(setup.answers, setup.rig.name, path)
    write_plan(path, text, force=False)
    note = f"{path.name}: preflight says {preflight.verdict}"
    setup.tell(note)
    for reason in preflight.reasons:
        if reason.severity is not Severity.NOTE:
            setup.tell(f"{reason.severity.upper():7} {reason.message}")
            setup.tell(f"        -> {reason.remedy}")
    return Found({}, (note,))


def doctor(setup: Setup) -> Found:
    """Noise, rates, delays and loop lateness; the stop and the watchdog are proven."""
    preflight = preflight_of(load_plan(setup.plan))
    setup.answers.consent("may_move")
    found = checkup.examine(
        preflight, dry_run=False, seconds=DOCTOR_S, still=False,
        tell=lambda line: setup.tell(f"{line.mark.upper():7} {line.finding.text}"),
    )  # fmt: skip
    if found.failed:
        failed = [line.finding for line in found.lines if line.mark is Mark.FAIL]
        raise RefusedError(
            "the doctor finds the rig not sound: " + "; ".join(line.text for line in failed),
            hint="; ".join(line.remedy for line in failed if line.remedy),
        )
    values = {
        ".".join(key): Value(format_quantity(value, unit), f"{setup.measured}: {how}")
        for key, (value, unit, how) in found.figures.items()
    }
    unproven = [line.name for line in found.lines if line.mark is Mark.SKIPPED]
    note = "the doctor found nothing that fails"
    return Found(values, (note + (f"; not looked at: {', '.join(unproven)}" if unproven else ""),))


def touch(setup: Setup) -> Found:
    """The engine's own approach, touch and the smallest step that preflight lets through."""
    named = setup.rig.with_name(f"{setup.rig.stem}-touch.yaml")
    text, top_n = touch_plan(setup.answers, setup.rig.name, named)
    path = _free(named, text)
    shown = format_quantity(top_n, "N")
    setup.tell(f"the lightest touch that preflight lets through: one step of {shown}")
    path.write_text(text, encoding="utf-8")
    setup.tell(f"its plan: {path.name}")
    preflight = preflight_of(load_plan(path))
    setup.answers.consent("may_touch")
    stands_at_start(setup)
    runs = setup.rig.parent / "runs" / f"touch-{setup.today.isoformat()}"
    number = 1
    while (directory := runs.with_name(f"{runs.name}-{number}")).exists():
        number += 1
    outcome = setup.press(preflight, directory)
    if outcome.status is not RunStatus.COMPLETED:
        raise RefusedError(
            f"the touch was not completed: {outcome.why}",
            hint=f"its record and report: {directory}",
        )
    at = ", ".join(format_quantity(found.position_m, "m") for found in outcome.touches)
    peak = format_quantity(outcome.peak_force_n, "N")
    note = f"touched with up to {peak}, the surface at {at} from the start pose"
    setup.tell(note)
    return Found({}, (note,))


def _free(path: Path, text: str) -> Path:
    """`path`, or the same with a number where something else stands in that file already."""
    number, found = 1, path
    while found.exists() and found.read_text(encoding="utf-8", errors="replace") != text:
        number += 1
        found = path.with_stem(f"{path.stem}-{number}")
    return found
