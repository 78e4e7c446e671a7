"""Sockets and clock of the emulated UR controller: one thread, one selector, one control period."""

from __future__ import annotations

import json
import math
import os
import random
import selectors
import socket
import struct
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping

from stepload_drivers.ur.frames import FrameError
from stepload_verify.emulators import ur_dashboard
from stepload_verify.emulators.ur_controller import UrController
from stepload_verify.emulators.ur_faults import HELP
from stepload_verify.emulators.ur_session import Session

CATCH_UP_PERIODS = 10
"""Largest number of periods that are made up for after a stall of the host; the rest is skipped."""
APART = 0.5
"""Time between two periods that are made up for, as a share of the period. Packages sent at one
moment look like one to a client that keeps the newest only: a late host would look like a lossy
cable."""


class Pace:
    """Periods of `period_s` from `start_s` on, on the clock of the host (s).

    `late` counts the periods that began more than one period after their time, `skipped` those
    that never did.
    """

    def __init__(self, period_s: float, start_s: float) -> None:
        self.period_s = period_s
        self.late = 0
        self.skipped = 0
        self._next_s = start_s + period_s
        self._last_s = -math.inf

    @property
    def due_s(self) -> float:
        """When the next period begins."""
        return max(self._next_s, self._last_s + APART * self.period_s)

    def begin(self, now_s: float) -> int:
        """Begin the next period, which is due; returns how many are skipped before it."""
        behind = int((now_s - self._next_s) / self.period_s)
        skipped = max(0, behind - CATCH_UP_PERIODS)
        self.skipped += skipped
        self.late += behind > 0
        self._next_s += (skipped + 1) * self.period_s
        self._last_s = now_s
        return skipped


DASHBOARD, RTDE = 29999, 30004
SCRIPT_PORTS = (30001, 30002, 30003)
POLYSCOPE_X_PORTS = (30001, 30002, RTDE)

OUTBOX_LIMIT = 1 << 20


class _Link:
    """One accepted connection."""

    def __init__(self, sock: socket.socket, port: int) -> None:
        self.sock = sock
        self.port = port
        self.outbox = bytearray()
        self.delayed: deque[tuple[float, bytes]] = deque()
        self.text = ""
        self.session: Session | None = None


class UrServer:
    """Serves `controller` on `host` until `quit` or, where asked, the end of standard input.

    `others` take the rest of a command line that begins with their name.
    """

    def __init__(
        self,
        controller: UrController,
        host: str,
        *,
        until_eof: bool = False,
        others: Mapping[str, Callable[[str], str]] | None = None,
    ) -> None:
        self._controller = controller
        self._others = others or {}
        self._host = host
        self._until_eof = until_eof
        self._selector = selectors.DefaultSelector()
        self._listeners: list[socket.socket] = []
        self._links: list[_Link] = []
        self._random = random.Random(2)
        self._stop = False
        self._commands = ""
        self._cycle = 0
        self._pace = Pace(controller.robot.period_s, time.monotonic())

    def run(self, ready: Callable[[], None]) -> None:
        """Serve; calls `ready` once the ports are open.

        Raises:
            OSError: a port is taken.
        """
        try:
            self._listen()
            self._watch_stdin()
            ready()
            self._loop()
        finally:
            self._drop(rst=False)
            self._close_listeners()
            self._selector.close()

    def _loop(self) -> None:
        robot = self._controller.robot
        pace = self._pace = Pace(robot.period_s, time.monotonic())
        while not self._stop:
            soon = (link.delayed[0][0] for link in self._links if link.delayed)
            wake_s = min([pace.due_s, *soon])
            for key, _ in self._selector.select(max(0.0, wake_s - time.monotonic())):
                key.data(key.fileobj)
            now_s = time.monotonic()
            if now_s >= pace.due_s:
                robot.time_s += pace.begin(now_s) * robot.period_s
                self._controller.tick()
                self._publish(now_s)
            self._flush(now_s)

    def _publish(self, now_s: float) -> None:
        self._cycle += 1
        faults = self._controller.faults
        if faults.freeze:
            return
        every = round(self._controller.rate_hz / faults.rate_hz) if faults.rate_hz else 1
        if self._cycle % max(1, every):
            return
        apart = faults.gap_s > 0.0 or faults.gap_jitter_s > 0.0
        turn_s = now_s
        for link in self._random.sample(self._links, len(self._links)) if apart else self._links:
            if link.session is not None and (package := link.session.package()):
                due_s = turn_s + self._random.uniform(0.0, faults.jitter_s)
                turn_s += faults.gap_s + self._random.uniform(0.0, faults.gap_jitter_s)
                if link.session.controls:
                    due_s += faults.control_late_s
                link.delayed.append((due_s, package))

    def _flush(self, now_s: float) -> None:
        for link in self._links:
            while link.delayed and link.delayed[0][0] <= now_s:
                link.outbox += link.delayed.popleft()[1]
        if self._controller.faults.blackhole:
            return
        for link in list(self._links):
            if link.outbox:
                self._send(link)

    def _send(self, link: _Link) -> None:
        try:
            del link.outbox[: link.sock.send(link.outbox)]
        except BlockingIOError:
            if len(link.outbox) > OUTBOX_LIMIT:
                self._close(link)
        except OSError:
            self._close(link)

    def _listen(self) -> None:
        ports: tuple[int, ...] = (DASHBOARD, *SCRIPT_PORTS, RTDE)
        if self._controller.version[0] >= 10:
            ports = POLYSCOPE_X_PORTS
        for port in ports:
            listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
            self._listeners.append(listener)
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.setblocking(False)
            listener.bind((self._host, port))
            listener.listen(8)
            self._selector.register(listener, selectors.EVENT_READ, self._accept)

    def _close_listeners(self) -> None:
        for listener in self._listeners:
            if listener in self._selector.get_map():
                self._selector.unregister(listener)
            listener.close()
        self._listeners.clear()

    def _accept(self, listener: socket.socket) -> None:
        sock, _ = listener.accept()
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        link = _Link(sock, listener.getsockname()[1])
        if link.port == DASHBOARD:
            link.outbox += ur_dashboard.GREETING.encode()
        elif link.port == RTDE:
            link.session = Session(self._controller)
            self._controller.sessions.append(link.session)
        self._links.append(link)
        self._selector.register(sock, selectors.EVENT_READ, lambda _: self._read(link))

    def _read(self, link: _Link) -> None:
        try:
            data = link.sock.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._close(link)
            return
        if link.session is not None:
            try:
                link.outbox += link.session.feed(data)
            except FrameError:
                self._close(link)
            return
        link.text += data.decode("utf-8", "replace")
        if link.port == DASHBOARD:
            self._dashboard(link)
        else:
            self._script(link)

    def _dashboard(self, link: _Link) -> None:
        *lines, link.text = link.text.split("\n")
        for line in lines:
            if line.strip() == "quit":
                self._close(link)
                return
            link.outbox += (ur_dashboard.answer(self._controller, line) + "\n").encode()

    def _script(self, link: _Link) -> None:
        """A program ends with a line `end` that is not indented."""
        while "\nend\n" in link.text:
            script, link.text = link.text.split("\nend\n", 1)
            self._controller.upload(script.lstrip() + "\nend\n")

    def _close(self, link: _Link, *, rst: bool = False) -> None:
        if link not in self._links:
            return
        self._links.remove(link)
        if link.session is not None:
            self._controller.sessions.remove(link.session)
        if link.sock in self._selector.get_map():
            self._selector.unregister(link.sock)
        if rst:
            link.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        link.sock.close()

    def _drop(self, *, rst: bool) -> None:
        for link in list(self._links):
            self._close(link, rst=rst)

    def _watch_stdin(self) -> None:
        try:
            self._selector.register(0, selectors.EVENT_READ, lambda _: self._read_commands())
        except (PermissionError, OSError):  # a file or /dev/null: no commands from there
            return

    def _read_commands(self) -> None:
        data = os.read(0, 4096)
        if not data:
            self._selector.unregister(0)
            self._stop = self._until_eof
            return
        *lines, self._commands = (self._commands + data.decode("utf-8", "replace")).split("\n")
        for line in lines:
            if line.strip():
                try:
                    reply = self.command(line.strip())
                except ValueError as error:
                    reply = f"error: {error}"
                sys.stdout.write(reply + "\n")
        sys.stdout.flush()

    def command(self, line: str) -> str:
        """Carry out one command line; returns the reply.

        Raises:
            ValueError: not a command.
        """
        match line.split():
            case ["help"]:
                return HELP
            case [name, *rest] if name in self._others:
                return self._others[name](" ".join(rest))
            case ["quit"]:
                self._stop = True
            case ["state"]:
                host = {"periods_late": self._pace.late, "periods_skipped": self._pace.skipped}
                return json.dumps(self._controller.truth() | host)
            case ["drop"]:
                self._drop(rst=False)
            case ["drop", "rst"]:
                self._drop(rst=True)
            case ["refuse", "on"]:
                self._drop(rst=False)
                self._close_listeners()
            case ["refuse", "off"]:
                if not self._listeners:
                    self._listen()
            case ["blackhole", value]:
                self._controller.command(line)
                self._blackhole(value == "on")
            case _:
                self._controller.command(line)
        return "ok"

    def _blackhole(self, on: bool) -> None:
        """Stop reading and accepting, or go on; TCP itself notices nothing."""
        for sock, callback in [
            *((listener, self._accept) for listener in self._listeners),
            *((link.sock, lambda _, link=link: self._read(link)) for link in self._links),
        ]:
            watched = sock in self._selector.get_map()
            if on and watched:
                self._selector.unregister(sock)
            elif not on and not watched:
                self._selector.register(sock, selectors.EVENT_READ, callback)
