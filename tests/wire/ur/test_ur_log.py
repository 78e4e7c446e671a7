"""The log of the UR driver: its states, its exchanges, and nothing at the pace of a tick."""

from __future__ import annotations

import logging

from stepload.rig.faults import FaultCode


def test_states_and_exchanges_are_logged_and_no_target(
    start_emulator, make_arm, follow, after, caplog
):
    emulator = start_emulator()
    arm = make_arm(emulator.host)
    with caplog.at_level(logging.DEBUG, "stepload_drivers"):
        arm.open(15.0)
        exchanges = [r for r in caplog.records if r.levelno == logging.DEBUG]
        assert any("get serial number -> 20235500001" in r.getMessage() for r in exchanges)
        states = [r for r in caplog.records if r.levelno == logging.INFO]
        assert [r.name for r in states] == ["stepload_drivers.ur.arm"]
        before = len(caplog.records)
        emulated = follow(arm, after(0.3))
        emulator.command("kill-program")
        follow(arm, lambda: arm.fault() is not None)
        assert len(emulated.targets) > 20
        assert len(caplog.records) == before
        arm.safe(2.0)
        arm.close()
        arm.close()
    warnings = [r.getMessage() for r in caplog.records if r.levelno >= logging.WARNING]
    assert len(warnings) == 1
    assert f"fault {FaultCode.PROGRAM_STOPPED.value}:" in warnings[0]
    assert [r.getMessage().split(":")[0] for r in caplog.records if "closed" in r.getMessage()] == [
        emulator.host
    ]
