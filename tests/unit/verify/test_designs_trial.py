"""The trial of designed plans: one dry run, and what is said of many."""

from __future__ import annotations

import pytest

from stepload.plan.shipped import plan_path
from stepload_verify.trials.designs import Pressed, line, pressed, why_not


@pytest.mark.long
def test_a_dry_run_is_held_against_the_true_chord() -> None:
    found = pressed(1, plan_path("plastic-sphere"))
    assert found.identified
    assert found.true
    assert 0.05 < found.half_width < 0.15


def test_only_what_is_identified_can_be_false() -> None:
    runs = [
        Pressed(0.1, True, True, True, 0.4, "completed", ()),
        Pressed(0.08, True, True, False, 0.5, "completed", ()),
        Pressed(0.3, False, False, False, 0.3, "stopped", ("it is 3 N off", "it is 7 N off")),
    ]
    assert line("it", 120.4, runs) == (
        "it: 120 s, half width ±10.0%, IDENTIFIED 2 of 3, of which 2 are right within 1/t and 1 "
        "hold the truth; 1 were stopped; largest true force 0.500 F_c"
    )
    assert why_not(runs) == ["    1 × it is … off"]
