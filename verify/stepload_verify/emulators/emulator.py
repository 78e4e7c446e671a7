"""Runs an emulated device: paces its samples, forwards the host's bytes, injects wire faults."""

from __future__ import annotations

import random
import select
import threading
import time
from collections import deque
from typing import Protocol

from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import Wrench, WrenchSource
from stepload_verify.emulators.rdtwire import RdtWire
from stepload_verify.emulators.wire import PtyWire, TcpWire, Wire

IDLE_S = 0.05
CATCH_UP_S = 1.0


class Emulated(Protocol):
    """A device without its wire. Called from the emulator's thread only.

    `period_s` is None while the device does not stream. `sample` gives what one sample puts on
    the wire, as units that may be lost one by one (frames); `receive` its answers, each of them
    units likewise; `restart` what it says after power-up.
    """

    @property
    def period_s(self) -> float | None: ...

    def receive(self, data: bytes, now_s: float) -> list[list[bytes]]: ...

    def sample(self, time_s: float) -> list[bytes]: ...

    def restart(self, now_s: float) -> list[list[bytes]]: ...


class Measured:
    """The wrench measured by an emulated sensor, with faults of its values."""

    def __init__(self, source: WrenchSource, board: FaultBoard, rated_n: float) -> None:
        self._source = source
        self._board = board
        self._rated_n = rated_n
        self._frozen: Wrench | None = None

    def wrench(self, time_s: float) -> Wrench:
        board = self._board
        if board.on("zero"):
            return (0.0,) * 6
        if board.on("freeze"):
            if self._frozen is None:
                self._frozen = self._source.wrench(time_s)
            return self._frozen
        self._frozen = None
        extra_n = (board.magnitude("offset") or 0.0) + (board.magnitude("overrange") or 0.0) * (
            self._rated_n
        )
        if drift := board.magnitude("drift"):
            extra_n += drift / 60.0 * board.since_s("drift")
        wrench = self._source.wrench(time_s, extra_n)
        if board.on("swap"):
            fx, fy, fz, tx, ty, tz = wrench
            wrench = (fz, fx, fy, tz, tx, ty)
        if (gain := board.magnitude("gain")) is None:
            return wrench
        fx, fy, fz, tx, ty, tz = (gain * value for value in wrench)
        return (fx, fy, fz, tx, ty, tz)


class Emulator:
    """One device on one wire, served by one thread from `start` to `stop`.

    `produced` counts the samples due so far, `sent` those handed to the wire,
    `spoiled` those that a fault touched, `overrun` those that the wire did not take;
    `unplugged` is set when its wire is gone.
    """

    def __init__(self, device: Emulated, wire: Wire, board: FaultBoard, seed: int = 0) -> None:
        self.address = wire.address
        self.board = board
        self.device = device
        self._wire = wire
        self._random = random.Random(seed)
        self._halt = threading.Event()
        self.unplugged = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"emulate {wire.address}")
        self._held: deque[tuple[float, bytes]] = deque()
        self._flush_s = 0.0
        self._restarted = False
        self.produced = self.sent = self.spoiled = self.overrun = 0

    def start(self) -> None:
        """Serve from now on."""
        self._thread.start()

    def stop(self) -> None:
        """End the service and give the wire back; it cannot be started again."""
        self._halt.set()
        if self._thread.is_alive():
            self._thread.join()
        self._wire.close()

    def __enter__(self) -> Emulator:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _run(self) -> None:
        next_s: float | None = None
        while not self._halt.is_set():
            if self.board.on("unplug"):
                self._wire.close()
                self.unplugged.set()
                self._halt.wait()
                return
            if self.board.on("second_client") and isinstance(self._wire, RdtWire):
                self._wire.usurp()
            self._serve(next_s)
            now_s = time.monotonic()
            restart = self.board.on("restart")
            if restart and not self._restarted:
                for units in self.device.restart(now_s):
                    self._send(units, now_s)
            self._restarted = restart
            period_s = self.device.period_s
            if period_s is None:
                next_s = None
                continue
            if next_s is None or now_s - next_s > CATCH_UP_S:
                next_s = now_s
            while next_s <= now_s:
                self._emit(next_s)
                next_s += period_s
            self._flush(now_s)

    def _serve(self, next_s: float | None) -> None:
        """Wait until the next sample is due or the host sends something; answer it."""
        now_s = time.monotonic()
        wait_s = IDLE_S if next_s is None else min(IDLE_S, max(0.0, next_s - now_s))
        if self._held:
            wait_s = min(wait_s, max(0.0, self._held[0][0] - now_s))
        watched = [self._wire.fileno()]
        if isinstance(self._wire, TcpWire) and self._wire.client_fileno() >= 0:
            watched.append(self._wire.client_fileno())
        if select.select(watched, [], [], wait_s)[0]:
            data = self._wire.read()
            if data:
                for units in self.device.receive(data, time.monotonic()):
                    self._send(units, time.monotonic())
            elif isinstance(self._wire, PtyWire):
                self._halt.wait(0.001)
        self._flush(time.monotonic())

    def _emit(self, due_s: float) -> None:
        units = self.device.sample(due_s)
        if not units:
            return
        self.produced += 1
        if self.board.on("silent") or self._chance("drop"):
            self.spoiled += 1
            return
        self._send(units, due_s)

    def _chance(self, fault: str) -> bool:
        probability = self.board.magnitude(fault)
        return probability is not None and self._random.random() < probability

    def _send(self, units: list[bytes], due_s: float) -> None:
        if self.board.on("silent"):
            return
        if len(units) > 1 and self._chance("torn"):
            units = units[:-1]
            self.spoiled += 1
        data = b"".join(units)
        if not data:
            return
        spoiled = self._spoil(data)
        self.spoiled += spoiled != data
        delay_s = self.board.magnitude("late") or 0.0
        delay_s += (self.board.magnitude("lag") or 0.0) * self.board.since_s("lag")
        hold_s = self.board.magnitude("batch")
        if delay_s or hold_s or self._held:
            at_s = due_s + delay_s
            if hold_s:
                self._flush_s = max(self._flush_s, (at_s // hold_s + 1) * hold_s)
                at_s = self._flush_s
            self._held.append((at_s, spoiled))
        else:
            self._put(spoiled)

    def _flush(self, now_s: float) -> None:
        due = []
        while self._held and self._held[0][0] <= now_s:
            due.append(self._held.popleft()[1])
        if isinstance(self._wire, RdtWire):  # each datagram stays one
            for data in due:
                self._put(data)
        elif due:
            self._put(b"".join(due))

    def _put(self, data: bytes) -> None:
        if self._wire.write(data):
            self.sent += 1
        else:
            self.overrun += 1
        if isinstance(self._wire, PtyWire) and self._chance("second_reader"):
            self._wire.steal(self._random.randint(1, len(data)))

    def _spoil(self, data: bytes) -> bytes:
        if self._chance("bit_flip"):
            place = self._random.randrange(8 * len(data))
            flipped = bytearray(data)
            flipped[place // 8] ^= 1 << place % 8
            data = bytes(flipped)
        if self._chance("cut"):
            data = data[: self._random.randrange(len(data))]
        if self._chance("noise"):
            data = self._random.randbytes(self._random.randint(1, 20)) + data
        return data
