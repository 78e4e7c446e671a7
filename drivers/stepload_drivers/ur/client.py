"""Talks to a controller with sockets and time-outs of its own, without ur_rtde.

Used for checks before ur_rtde is constructed, and for actions after it has failed.
"""

from __future__ import annotations

import contextlib
import logging
import socket
import struct
import time
from collections.abc import Sequence

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ur import frames, state
from stepload_drivers.ur.frames import Frame, FrameError, FrameReader, encode

DASHBOARD, RTDE = 29999, 30004
SCRIPT_PORTS = (30003, 30002, 30001)
CONNECT_LIMIT_S = 1.0
SCRIPT_LINGER_S = 0.1
_log = logging.getLogger(__name__)

Version = tuple[int, int, int, int]
REMOTE = {"true": True, "false": False}
"""Answers of the dashboard about remote control; before 5.6 it gives others."""


class Connection:
    """A TCP connection to one port of the controller; its errors are `DeviceError`.

    Raises:
        DeviceError: NOT_CONNECTED, no connection by the deadline (monotonic).
    """

    def __init__(self, host: str, port: int, deadline_s: float) -> None:
        self._host, self._port = host, port
        left_s = min(CONNECT_LIMIT_S, deadline_s - time.monotonic())
        if left_s <= 0.0:
            raise self._no_answer("no time left to connect")
        try:
            self._sock = socket.create_connection((host, port), timeout=left_s)
        except OSError as error:
            raise self._no_answer(f"cannot connect ({error})") from error
        self._sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        _log.debug("%s:%d connected", host, port)

    def _no_answer(self, what: str) -> DeviceError:
        return DeviceError(
            f"{self._host}:{self._port}: {what}",
            code=FaultCode.NOT_CONNECTED,
            hint="is the controller on, its address right, and the cable in? Then `ping` it",
        )

    def _lost(self, error: OSError) -> DeviceError:
        return self._no_answer(f"connection lost ({error})")

    def _send(self, data: bytes) -> None:
        try:
            self._sock.sendall(data)
        except OSError as error:
            raise self._lost(error) from error

    def _receive(self, timeout_s: float) -> bytes:
        """What has arrived; empty if nothing does within `timeout_s`."""
        self._sock.settimeout(timeout_s)
        try:
            data = self._sock.recv(65536)
        except TimeoutError:
            return b""
        except OSError as error:
            raise self._lost(error) from error
        if not data:
            raise self._no_answer("the controller closed the connection")
        return data

    def _receive_by(self, deadline_s: float) -> bytes:
        left_s = deadline_s - time.monotonic()
        if left_s > 0.0 and (data := self._receive(left_s)):
            return data
        raise self._no_answer("no answer in time")

    def close(self) -> None:
        self._sock.close()


class RtdeClient(Connection):
    """One RTDE connection; every call ends by `deadline_s` (monotonic), whatever the peer does."""

    def __init__(self, host: str, deadline_s: float) -> None:
        super().__init__(host, RTDE, deadline_s)
        self._deadline_s = deadline_s
        self._reader = FrameReader()
        self._frames: list[Frame] = []
        self._layout = frames.package_struct([])

    def _next(self) -> Frame:
        while not self._frames:
            self._feed(self._receive_by(self._deadline_s))
        return self._frames.pop(0)

    def _feed(self, data: bytes) -> None:
        try:
            self._frames += self._reader.feed(data)
        except FrameError as error:
            raise DeviceError(
                f"{self._host}:{RTDE}: {error}",
                code=FaultCode.CORRUPT,
                hint="something else than a UR controller answers here",
            ) from error

    def _ask(self, kind: int, payload: bytes = b"") -> bytes:
        self._send(encode(kind, payload))
        while True:
            frame = self._next()
            if frame.kind == kind:
                _log.debug("%s:%d <- %c %r -> %r", self._host, RTDE, kind, payload, frame.payload)
                return frame.payload

    def version(self) -> Version:
        """Protocol 2 agreed on, then the controller's version.

        Raises:
            DeviceError: no protocol 2, no answer, or not RTDE.
        """
        if self._ask(frames.REQUEST_PROTOCOL_VERSION, b"\x00\x02") != b"\x01":
            raise DeviceError(
                f"{self._host}: the controller does not speak RTDE protocol 2",
                code=FaultCode.UNSUPPORTED,
                hint="PolyScope 3.4 to 3.15 and 5.4 to 5.x are supported",
            )
        answer = self._ask(frames.GET_VERSION)
        if len(answer) != 16:
            raise self._no_answer(f"version answer of {len(answer)} bytes, not 16")
        major, minor, bugfix, build = struct.unpack(">4I", answer)
        return (major, minor, bugfix, build)

    def taken_inputs(self, names: Sequence[str]) -> list[str]:
        """Those of `names` that another client or a fieldbus holds (claimed until closed)."""
        types = self._ask(frames.SETUP_INPUTS, ",".join(names).encode())[1:].decode("ascii")
        answers = types.split(",")
        return [n for n, kind in zip(names, answers, strict=False) if kind == "IN_USE"]

    def start(self, rate_hz: float) -> None:
        """Ask for the variables of `state.VARIABLES` and start sending.

        Raises:
            DeviceError: refused or no answer.
        """
        self._begin(self._outputs(rate_hz, state.VARIABLES))

    def _outputs(self, rate_hz: float, names: Sequence[str]) -> list[str]:
        """The types of the output variables `names`, as the controller answers."""
        request = struct.pack(">d", rate_hz) + ",".join(names).encode()
        return frames.split_names(self._ask(frames.SETUP_OUTPUTS, request)[1:])

    def _begin(self, types: list[str]) -> None:
        try:
            self._layout = frames.package_struct(types)
        except FrameError as error:
            raise DeviceError(
                f"{self._host}: the controller lacks an output variable ({error})",
                code=FaultCode.UNSUPPORTED,
                hint="PolyScope 3.4 to 3.15 and 5.4 to 5.x are supported",
            ) from error
        if self._ask(frames.START) != b"\x01":
            raise self._no_answer("refused to start sending")

    def read(self) -> state.UrState:
        """The next sound data package.

        Raises:
            DeviceError: none by the deadline, or its values are impossible.
        """
        while not self._is_data(frame := self._next()):
            pass
        return self._state(frame)

    def arrived(self, timeout_s: float) -> list[state.UrState]:
        """All data packages that have arrived, oldest first; waits `timeout_s` for one.

        Raises:
            DeviceError: the connection is lost, or the values of a package are impossible.
        """
        self._feed(self._receive(timeout_s))
        taken, self._frames = self._frames, []
        return [self._state(frame) for frame in taken if self._is_data(frame)]

    def _is_data(self, frame: Frame) -> bool:
        return frame.kind == frames.DATA and len(frame.payload) == self._layout.size

    def _state(self, frame: Frame) -> state.UrState:
        v = self._layout.unpack(frame.payload)[1:]
        package = state.UrState(v[0], v[1:7], v[7:13], v[13], v[14], v[15], v[16])
        if problem := state.data_problem(package):
            raise problem.error()
        return package


class Dashboard(Connection):
    """One connection to the dashboard server.

    Raises:
        DeviceError: not reachable or no greeting by the deadline (monotonic).
    """

    def __init__(self, host: str, deadline_s: float) -> None:
        super().__init__(host, DASHBOARD, deadline_s)
        self._text = b""
        try:
            self._line(deadline_s)
        except DeviceError:
            self.close()
            raise

    def ask(self, command: str, deadline_s: float) -> str:
        """The reply to one command.

        Raises:
            DeviceError: the connection is lost or there is no answer by the deadline.
        """
        self._send(command.encode("ascii") + b"\n")
        reply = self._line(deadline_s)
        _log.debug("%s:%d <- %s -> %s", self._host, DASHBOARD, command, reply)
        return reply

    def _line(self, deadline_s: float) -> str:
        while b"\n" not in self._text:
            self._text += self._receive_by(deadline_s)
        line, _, self._text = self._text.partition(b"\n")
        return line.decode("utf-8", "replace").strip()


def dashboard(host: str, commands: Sequence[str], deadline_s: float) -> list[str]:
    """Replies of the dashboard server, one per command.

    Raises:
        DeviceError: not reachable or no answer by the deadline.
    """
    with contextlib.closing(Dashboard(host, deadline_s)) as server:
        return [server.ask(command, deadline_s) for command in commands]


def send_script(host: str, script: str, deadline_s: float) -> None:
    """Hand a URScript program to the first script port that takes it.

    Raises:
        DeviceError: none did. (If one did, the program need not have been carried out.)
    """
    errors = []
    for port in SCRIPT_PORTS:
        try:
            with contextlib.closing(ScriptPort(host, port, deadline_s)) as taker:
                taker.send(script)
                return
        except (DeviceError, OSError) as error:
            errors.append(str(error).splitlines()[0])
    raise DeviceError(
        f"no script port took the program: {'; '.join(errors)}",
        code=FaultCode.NOT_CONNECTED,
        hint="use the emergency stop if the arm moves",
    )


class ScriptPort(Connection):
    """A port that takes URScript programs, and streams the controller's state."""

    def send(self, script: str) -> None:
        """Send the program, then read for a moment what the port streams: closing with unread data
        would reset the connection, and the controller might drop the program with it.
        """
        self._sock.sendall(script.encode("ascii"))
        until_s = time.monotonic() + SCRIPT_LINGER_S
        while (left_s := until_s - time.monotonic()) > 0.0:
            self._sock.settimeout(left_s)
            with contextlib.suppress(TimeoutError):
                if not self._sock.recv(65536):
                    break
        _log.info("%s:%d takes a program: %s", self._host, self._port, " ".join(script.split()))
