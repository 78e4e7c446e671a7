"""The UR emulator as a process of its own, for tests and benchmarks."""

from __future__ import annotations

import json
import subprocess
import sys
from types import TracebackType
from typing import Any

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


class UrEmulatorProcess:
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
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PROGRAM, host, json.dumps({"version": version, **options})],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert self._process.stdout is not None
        if not self._process.stdout.readline().startswith("ready"):
            _, errors = self._process.communicate()
            raise RuntimeError(f"the UR emulator did not start on {host}: {errors.strip()}")

    def command(self, line: str) -> str:
        """Give one command line (see `ur_faults.HELP`); returns the reply."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        reply = self._process.stdout.readline().strip()
        if reply.startswith("error") or not reply:
            raise RuntimeError(f"emulator command {line!r}: {reply or 'no reply'}")
        return reply

    def state(self) -> dict[str, Any]:
        """What is really the case, see `UrController.truth`."""
        truth: dict[str, Any] = json.loads(self.command("state"))
        return truth

    def close(self) -> None:
        """End it; idempotent."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()

    def __enter__(self) -> UrEmulatorProcess:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
