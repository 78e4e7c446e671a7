"""An emulator in a process of its own that takes commands on its standard input."""

from __future__ import annotations

import json
import subprocess
from types import TracebackType
from typing import Any, Self


class Commanded:
    """Ends with the `with` block.

    Args:
        process: with pipes for its input and output, of text.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def command(self, line: str) -> str:
        """One line as on the emulator's standard input; returns the reply.

        Raises:
            RuntimeError: not a command, or the emulator is gone.
        """
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
        reply = self._process.stdout.readline().strip()
        if reply.startswith("error") or not reply:
            raise RuntimeError(f"emulator command {line!r}: {reply or 'no reply'}")
        return reply

    def state(self) -> dict[str, Any]:
        """The true state of the arm, see `UrController.truth`."""
        truth: dict[str, Any] = json.loads(self.command("state"))
        return truth

    def close(self) -> None:
        """End it; idempotent."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.communicate()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()
