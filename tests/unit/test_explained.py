"""Every code that the product can print is explained, and nothing else is."""

from __future__ import annotations

import ast
from pathlib import Path

from stepload.errors import ExitCode
from stepload.explain.codes import explanations, page
from stepload.identification.fit import Flag
from stepload.report.identified import SIGNS
from stepload.rig.faults import FaultCode

ROOT = Path(__file__).parents[2]
PREFLIGHT, STOP = {"Reason", "_too_much", "DomainDoubt"}, {"fail", "Cause", "found", "_found"}


def constants(node: ast.expr) -> list[str]:
    """The texts that an argument may be."""
    if isinstance(node, ast.IfExp):
        return constants(node.body) + constants(node.orelse)
    return [node.value] if isinstance(node, ast.Constant) and isinstance(node.value, str) else []


def emitted(names: set[str], rooms: tuple[str, ...]) -> set[str]:
    """First arguments of calls of these names."""
    found: set[str] = set()
    for room in rooms:
        for file in (ROOT / "src" / "stepload" / room).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text())):
                if isinstance(node, ast.Call) and node.args:
                    name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                    found |= set(constants(node.args[0]) if name in names else ())
    return found


def codes_of(group: str) -> set[str]:
    return {each.code for each in explanations() if each.group == group}


def test_every_reason_of_a_preflight_is_explained() -> None:
    found = emitted(PREFLIGHT, ("feasibility", "contact"))
    assert len(found) > 30
    assert codes_of("preflight") == found


def test_every_cause_of_a_stop_is_explained() -> None:
    found = emitted(STOP, ("engine", "session"))
    assert {"R1", "R11", "CAP", "drift", "hang"} <= found
    assert codes_of("stop") == found


def test_every_fault_sign_doubt_and_exit_code_is_explained() -> None:
    assert codes_of("device") == {code.value for code in FaultCode}
    assert codes_of("sign") == set(SIGNS)
    assert codes_of("fit") == {flag.value for flag in Flag}
    assert codes_of("exit") == {str(int(code)) for code in ExitCode}


def test_the_page_is_generated() -> None:
    assert (ROOT / "docs" / "codes.md").read_text() == page(), "python -m stepload.explain.codes"
