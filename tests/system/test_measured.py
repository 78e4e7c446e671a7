"""Small versions of a trial and of a bench: kills, memory."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest
from real_runs import ENVIRONMENT, ROOT


def _measured(*command: str) -> list[dict[str, Any]]:
    done = subprocess.run(
        [sys.executable, *command, "--json"],
        capture_output=True,
        text=True,
        check=False,
        env=ENVIRONMENT,
    )
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


def _check_kills(kills: list[dict[str, Any]]) -> None:
    assert {kill["target"] for kill in kills} == {"runner", "group"}
    # One that is killed 60 ms after its first sample may have nothing on the disk yet.
    assert any(kill["durable"] > 0 for kill in kills)
    for kill in kills:
        assert kill["state"] in ("repaired", "whole"), kill
        assert kill["kept"] >= kill["durable"], kill
        if kill["target"] == "runner":  # the writer lives on: not one sample is lost
            assert kill["kept"] >= kill["pushed"], kill
            assert kill["lost_ms"] == 0.0, kill
        assert kill["kept"] <= kill["pushed"] + 1, kill


@pytest.mark.long
def test_killed_runs_lose_nothing_that_was_on_the_disk() -> None:
    kills = _measured("-m", "stepload_verify.trials.kill_runs", "--kills", "2", "--wire", "0")
    assert [kill["kind"] for kill in kills] == ["dry"] * 2
    _check_kills(kills)


@pytest.mark.long
def test_killed_runs_on_the_wire_lose_nothing_that_was_on_the_disk() -> None:
    kills = _measured("-m", "stepload_verify.trials.kill_runs", "--kills", "2", "--wire", "2")
    assert [kill["kind"] for kill in kills] == ["wire"] * 2
    _check_kills(kills)


@pytest.mark.long
def test_memory_does_not_grow_with_the_run() -> None:
    (one,) = _measured(str(ROOT / "bench" / "dry_run.py"), "--hours", "0.04")
    assert one["virtual_s"] > 120.0
    assert one["loop_mb"] < 30.0
    assert one["runner_mb"] < 300.0
    assert one["writer_mb"] < 150.0
