"""What is said of a record that was repaired: its headline, with the forces that it holds for."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from stepload.record.recovery import Recovered
from stepload.session.repair import Repaired


def said(headline: Any) -> str:
    verdict = SimpleNamespace(value="identified")
    found: Any = SimpleNamespace(headline=headline, verdict=verdict)
    return Repaired(Path("r.part"), Recovered(Path("r"), {"a": 2}, 0, ""), found, "").line


def test_the_stiffness_is_told_with_the_forces_of_the_data_and_not_with_those_of_the_plan() -> None:
    line = said(SimpleNamespace(value_n_per_m=5.11e6, from_n=20.8, to_n=208.0))
    assert line.endswith("chord stiffness 5.11 MN/m from 20.8 N to 208 N, identified")
    assert said(None).endswith("no stiffness, identified")
