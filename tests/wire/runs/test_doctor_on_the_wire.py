"""The doctor on real drivers: what emulated faults of the wire do to its verdict."""

from __future__ import annotations

import pytest

from stepload.envelope.envelope import envelope_of
from stepload.setup import motion
from stepload.setup.check_line import Mark
from stepload.setup.checkup import examine


@pytest.mark.long
def test_losses_are_found_and_the_stop_is_proven(emulated_run, monkeypatch):
    monkeypatch.setattr(motion, "SWINGS", 5)
    run = emulated_run(faults=("bota_serial=drop:0.1",))
    told = []
    found = examine(
        envelope_of(run.plan), dry_run=False, seconds=1.0, still=False, against_spring=False,
        tell=told.append,
    )  # fmt: skip
    assert tuple(told) == found.lines
    lines = {line.name: line for line in found.lines}
    assert lines["force: lost"].mark is Mark.FAIL
    assert 0.05 < lines["force: lost"].value < 0.15
    assert found.failed
    assert lines["arm: stop"].mark is Mark.OK
    assert lines["arm: watchdog"].mark is Mark.OK
    assert 0.03 < lines["arm: response"].value < 0.12
    assert "loop_delay" in found.snippet
    truth = run.rig.state()
    assert truth["watchdog_trips"] == 1
    assert not truth["moving"]
