"""The UR emulator as a process of its own, for tests and benchmarks."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

from stepload_verify.emulators.commanded import Commanded

_PROGRAM = """
import json, sys
from stepload_verify.emulators.ur_emulator import run_ur_emulator
options = json.loads(sys.argv[2])
options["version"] = tuple(options["version"])
if truth := options.pop("world", None):
    from stepload_verify.emulators.ur_world import axis_in_world
    options["axis"] = axis_in_world(**truth)
run_ur_emulator(sys.argv[1], until_eof=True, **options)
"""


class UrEmulatorProcess(Commanded):
    """Serving when constructed; ends with the `with` block, or when the owner dies.

    Args:
        host: an address of 127.0.0.0/8 that no other emulator uses.
        version: PolyScope version.
        options: further JSON-able arguments of `run_ur_emulator`; `world` instead of `axis`, the
            fields of the default `WorldSpec` to replace.

    Raises:
        RuntimeError: it did not start, with its last words.
    """

    def __init__(
        self, host: str, version: tuple[int, int, int, int] = (5, 12, 6, 0), **options: Any
    ) -> None:
        self.host = host
        process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, host, json.dumps({"version": version, **options})],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        super().__init__(process)
        assert self._process.stdout is not None
        if not self._process.stdout.readline().startswith("ready"):
            _, errors = self._process.communicate()
            raise RuntimeError(f"the UR emulator did not start on {host}: {errors.strip()}")
