"""kill -9 of the runner loses nothing; of the whole group, nothing that was said to be on disk."""

from __future__ import annotations

import json
import subprocess
import sys


def test_killed_runners_leave_their_data() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "stepload_verify.trials.kill_recorder", "--kills", "2"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for kill in found["runner"]:
        assert kill["kept"] >= kill["pushed"] > 0
    for kill in found["group"]:
        assert kill["kept"] >= kill["durable"] > 0
        assert kill["kept"] <= kill["pushed"] + 1
