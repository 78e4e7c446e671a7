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


@pytest.mark.long
def test_memory_does_not_grow_with_the_run() -> None:
    (one,) = _measured(str(ROOT / "bench" / "dry_run.py"), "--hours", "0.04")
    assert one["virtual_s"] > 120.0
    assert one["loop_mb"] < 30.0
    assert one["runner_mb"] < 300.0
    assert one["writer_mb"] < 150.0
