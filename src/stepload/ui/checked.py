"""Preflight of a plan that is edited on the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from stepload.errors import SteploadError
from stepload.feasibility.preflight import Preflight, preflight_of
from stepload.feasibility.reason import Severity, findings
from stepload.plan.load import load_text
from stepload.plan.problems import MAX_PROBLEMS, PlanError
from stepload.plan.references import place_of
from stepload.plan.source import Folder
from stepload.report.preflight import figures, headline
from stepload.ui.folder import inside


def check(root: Path, name: str, text: str) -> dict[str, Any]:
    """Verdict, findings and figures of a plan, or its problems, each with its place.

    Args:
        root: the folder of the page, resolved; no file outside it is read.
        name: of the plan in it; the files that it names are found from there.

    Raises:
        BadInputError: the name is outside the folder.
    """
    path = inside(root, name)
    try:
        found = preflight_of(load_text(text, path, root))
        return {"problems": [], **_told(found, Folder(root, path, text))}
    except PlanError as error:
        problems = [
            {"file": each.file, "here": each.file == path.name, "line": each.line,
             "column": each.column, "message": each.message, "hint": each.hint}
            for each in error.problems[:MAX_PROBLEMS]
        ]  # fmt: skip
        return {"problems": problems, "count": len(error.problems)}
    except SteploadError as error:
        told = {"file": "", "here": False, "line": 0, "column": 0}
        return {"problems": [told | {"message": error.message, "hint": error.hint}], "count": 1}


def _told(preflight: Preflight, shelf: Folder) -> dict[str, Any]:
    weighty = findings(preflight.reasons)
    others = [each for each in preflight.reasons if each not in weighty]
    told = []
    for each in (*weighty, *others):
        place = place_of(preflight.plan, each.key, shelf) if each.key else None
        here = place is not None and place.source.path == preflight.plan.path
        told.append(
            {"code": each.code, "severity": each.severity, "message": each.message,
             "remedy": each.remedy, "line": place.line if place and here else 0,
             "column": place.column if place and here else 0}
        )  # fmt: skip
    return {
        "verdict": preflight.verdict,
        "headline": " ".join(headline(preflight).split()).partition(" ")[2],
        "findings": told,
        "notes": sum(each.severity is Severity.NOTE for each in others),
        "figures": [list(row) for row in figures(preflight)],
    }
