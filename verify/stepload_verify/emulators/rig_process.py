"""`stepload emulate rig` as a process of its own, for the demo, tests and benchmarks."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from stepload.errors import RefusedError
from stepload.rig.world import WorldSpec
from stepload_verify.emulators.live_rig import dump_spec


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


QUIT_S = 3.0


class RigProcess(Commanded):
    """Serving when constructed; ends with the `with` block, or when its owner dies.

    `options` are the driver options that reach each emulated device, by driver name.

    Args:
        spec: the world that all devices share.
        ur: loopback address of the arm, which no other emulator uses.
        sensors: driver names of the sensors.
        links: name of its own for a sensor's port, by driver name.
        faults: faults from the start, as in `stepload emulate rig --fault`.
        transport: of sensors on CAN, "slcan" or "socketcand".
        version: PolyScope version of the arm.

    Raises:
        RefusedError: it did not start, with its last words.
    """

    def __init__(
        self,
        spec: WorldSpec,
        *,
        ur: str,
        sensors: Sequence[str] = ("bota_serial",),
        links: Mapping[str, Path] | None = None,
        faults: Sequence[str] = (),
        transport: str = "slcan",
        version: str = "5.12.6.0",
    ) -> None:
        with tempfile.NamedTemporaryFile("w", suffix=".json") as world:
            world.write(dump_spec(spec))
            world.flush()
            words = ["rig", "--world", world.name, "--ur", ur, "--until-eof"]
            words += [f"--sensor={name}" for name in sensors]
            words += [f"--link={name}={path}" for name, path in (links or {}).items()]
            words += [f"--fault={fault}" for fault in faults]
            words += [f"--transport={transport}", f"--ur-version={version}"]
            process = subprocess.Popen(
                [sys.executable, "-m", "stepload_verify.emulators", *words],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
                start_new_session=True,
            )
            super().__init__(process)
            self.options: dict[str, dict[str, Any]] = {"ur": {"host": ur}}
            self._meet()

    def _meet(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.startswith("ready"):
                return
            told = json.loads(line)
            self.options[told["driver"]] = told["options"]
        _, words = self._process.communicate()
        raise RefusedError(
            f"the emulated rig did not start: {words.strip()}",
            hint="see `stepload emulate rig --help`",
        )

    @property
    def pid(self) -> int:
        return self._process.pid

    def close(self) -> None:
        """End it; idempotent."""
        if self._process.poll() is None:
            with contextlib.suppress(OSError, subprocess.TimeoutExpired):
                self._process.communicate("quit\n", timeout=QUIT_S)
        if self._process.poll() is None:
            super().close()
