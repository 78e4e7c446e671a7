"""Runs real `stepload` processes, also with stage directions (see staged.py)."""

from __future__ import annotations

import contextlib
import io
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, NamedTuple

import pytest

from stepload.cli.main import main
from stepload.report import page
from stepload.report.model import Document
from stepload.session import files

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PATIENCE_S = 120.0

QUICK = f"""
stepload: 1
payload: {ROOT}/procedures/payloads/plastic-sphere.yaml
rig:
  profile: stvf
  arm:
    options: {{rate: 1 kHz, command_delay: 1 ms, lag: 2 ms, force_noise: 0.5 N}}
  force:
    options: {{noise: 0.5 N, quantum: 1.5 N, delay: 1 ms, bias: 3 N}}
procedure:
  step: 100 N
  top_force: 300 N
  hold: 0.3 s
  touches: 1
  unload: false
  cycles: 1
  surface_distance: 2 mm
  surface_uncertainty: 0.3 mm
  tare: 0.3 s
  warm_up: 0 s
  settle_timeout: 0.3 s
"""
CYCLES = QUICK.replace("unload: false\n  cycles: 1", "unload: true\n  cycles: 2")
ENVIRONMENT = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}


def stepload(*arguments: object, **options: Any) -> subprocess.CompletedProcess[str]:
    """One `stepload` command, to its end."""
    return subprocess.run(
        [sys.executable, "-m", "stepload", *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
        env=ENVIRONMENT,
        timeout=PATIENCE_S,
        **options,
    )


def leave_out_figures(patch: pytest.MonkeyPatch, but: tuple[str, ...] = ()) -> None:
    """Reports of words and the named figures: drawing all takes longer than a quick run."""
    render = page.render

    def few(document: Document) -> str:
        sheet = document.certificate and replace(document.certificate, figure=None)
        kept = [each for each in document.figures if each.name in but]
        return render(replace(document, figures=kept, certificate=sheet))

    for where in (files, page):
        patch.setattr(where, "render", few)


class Said(NamedTuple):
    """One command: exit code and what it printed, as of a process."""

    returncode: int
    stdout: str
    stderr: str


def in_process(
    *arguments: object, cwd: Path | None = None, drawn: bool | tuple[str, ...] = ()
) -> Said:
    """One `stepload` command in this process, which is quicker where the process is not the point.

    The report of a run has only those figures that are `drawn`, by their names; True: all.
    """
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(cwd or Path.cwd()),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setattr(sys, "argv", ["stepload", *map(str, arguments)])
        if drawn is not True:
            leave_out_figures(patch, drawn or ())
        with pytest.raises(SystemExit) as ended:
            main()
    code = ended.value.code
    return Said(
        code if isinstance(code, int) else int(code is not None), out.getvalue(), err.getvalue()
    )


def results(directory: Path) -> dict[str, Any]:
    """What a run has left in results.json."""
    found: dict[str, Any] = json.loads((directory / "results.json").read_text())
    return found


class Forked:
    """A process that the server of staged processes has forked, handled like a Popen."""

    def __init__(self, told: int, out: IO[str], err: IO[str]) -> None:
        self._told, self._out, self._err = told, out, err
        self.returncode: int | None = None
        self.pid = self._read()

    def _read(self) -> int:
        return int.from_bytes(os.read(self._told, 8), "big")

    def wait(self, timeout: float = PATIENCE_S) -> int:
        """Its exit code, negative after a signal."""
        if self.returncode is None:
            if not select.select([self._told], [], [], timeout)[0]:
                raise TimeoutError(f"process {self.pid} does not end")
            self.returncode = os.waitstatus_to_exitcode(self._read())
        return self.returncode

    def communicate(self, timeout: float = PATIENCE_S) -> tuple[str, str]:
        """All that it has printed, once it has ended."""
        self.wait(timeout)
        for file in (self._out, self._err):
            file.seek(0)
        return self._out.read(), self._err.read()

    def send_signal(self, number: int) -> None:
        """Nothing where it has ended."""
        if not select.select([self._told], [], [], 0.0)[0] and self.returncode is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """At once."""
        self.send_signal(signal.SIGKILL)

    def close(self) -> None:
        """End what is left of it and of its children."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        self.wait()
        os.close(self._told)
        self._out.close()
        self._err.close()


class StageServer:
    """Forks staged processes that have made their imports: these take longer than a quick run."""

    def __init__(self) -> None:
        self._ask, answer = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with answer:
            self._process = subprocess.Popen(
                [sys.executable, str(HERE / "staged.py"), "serve", str(answer.fileno())],
                pass_fds=(answer.fileno(),),
                env=ENVIRONMENT,
            )

    def fork(self, directions: dict[str, Any], arguments: tuple[object, ...], say: int) -> Forked:
        """One staged process; it says where it is on `say`."""
        out, err = tempfile.TemporaryFile("w+"), tempfile.TemporaryFile("w+")  # noqa: SIM115
        told, tell = os.pipe()
        message = {
            "directions": directions,
            "arguments": [str(each) for each in arguments],
            "directory": str(Path.cwd()),
        }
        descriptors = [out.fileno(), err.fileno(), say, tell]
        socket.send_fds(self._ask, [json.dumps(message).encode()], descriptors)
        os.close(tell)
        return Forked(told, out, err)

    def close(self) -> None:
        """When no process that it forked is left."""
        self._ask.close()
        self._process.wait(PATIENCE_S)


class Staged:
    """A `stepload` process with stage directions."""

    def __init__(
        self, server: StageServer, directions: dict[str, Any], arguments: tuple[object, ...]
    ) -> None:
        self._received, say = os.pipe()
        self.process = server.fork(directions, arguments, say)
        os.close(say)

    def wait_until_there(self) -> None:
        """Until it stands where it should, or has taken notice of one more signal."""
        ready, _, _ = select.select([self._received], [], [], PATIENCE_S)
        assert ready, "the run does not get there"
        if not os.read(self._received, 4096):
            raise AssertionError(f"the run ended before: {self.process.communicate()}")

    def signal(self, number: int, times: int = 1) -> None:
        """Send a signal and wait until the run knows, `times` times."""
        for _ in range(times):
            self.process.send_signal(number)
            self.wait_until_there()

    def finish(self) -> tuple[int, str]:
        """(exit code, all that was printed)."""
        out, err = self.process.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in out + err, err
        return self.process.returncode, out + err

    def close(self) -> None:
        """End what is left of it."""
        self.process.close()
        os.close(self._received)
