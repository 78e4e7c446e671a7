"""Every code that the product can print is explained, and nothing else is."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from stepload.errors import BadInputError, ExitCode
from stepload.explain.codes import explained, explanations, glossary, page, thresholds_called
from stepload.identification.fit import Flag
from stepload.results.identified import SIGNS
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
    found = emitted(PREFLIGHT, ("envelope", "contact"))
    assert len(found) > 30
    assert codes_of("preflight") == found


def test_every_cause_of_a_stop_is_explained() -> None:
    found = emitted(STOP, ("engine",))
    assert {"R1", "R11", "CAP", "drift", "hang"} <= found
    assert codes_of("stop") == found


def test_every_fault_sign_doubt_and_exit_code_is_explained() -> None:
    assert codes_of("device") == {code.value for code in FaultCode}
    assert codes_of("sign") == set(SIGNS)
    assert codes_of("fit") == {flag.value for flag in Flag}
    assert codes_of("exit") == {str(int(code)) for code in ExitCode}


def test_a_code_is_found_however_it_is_written() -> None:
    assert explained("r6")[0].code == "R6"
    assert explained("[No-Room]")[0].code == "no_room"
    assert {each.group for each in explained("drift")} == {"stop"}
    assert {each.group for each in explained("creep")} >= {"sign"}
    with pytest.raises(BadInputError, match="no code") as caught:
        explained("unidentifyable")
    assert "unidentifiable" in caught.value.hint


def test_a_key_of_a_plan_is_explained_with_the_places_where_it_may_stand() -> None:
    told, word = explained("stuck_ratio")
    assert word.group == "word"
    assert told.means.startswith("rig.system_stiffness.stuck_ratio: ")
    assert told.do == "Write a plain number from 1 to 100."
    [axis] = explained("axis")
    assert axis.means.startswith("rig.force.axis, rig.second_force.sensor.axis: ")
    assert {each.code for each in explained("name")} == {"name"}


def test_a_word_or_symbol_is_explained_as_the_glossary_does() -> None:
    [told] = explained("Elastic limit")
    assert (told.code, told.group, told.do) == ("F_c, elastic limit", "word", "")
    assert explained("f_c") == (told,)
    assert {each.group for each in explained("sigma")} == {"key", "word"}
    assert (ROOT / "docs" / "glossary.md").read_text() == glossary(), (
        "python -m stepload.explain.codes glossary"
    )


def test_the_page_is_generated() -> None:
    assert (ROOT / "docs" / "codes.md").read_text() == page(), "python -m stepload.explain.codes"


def test_a_threshold_is_explained_by_what_it_is_made_of() -> None:
    [found] = explained("answer_n_per_m")
    assert found.group == "threshold"
    assert "softest payload" in found.means
    assert "[N/m]; rule R6" in found.means
    assert not thresholds_called("answer")
