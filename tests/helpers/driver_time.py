"""Virtual time for drivers: a clock that only the test and the fakes move on."""

from __future__ import annotations

from collections import deque
from types import SimpleNamespace


class Clock:
    """Stands in for the module `time`: sleeping moves it on, nothing else does.

    `at` schedules a call for a moment; it is made when the clock passes that moment.
    """

    def __init__(self, now_s: float = 1000.0) -> None:
        self.now_s = now_s
        self._due: list[tuple[float, object]] = []

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        end_s = self.now_s + max(1e-9, seconds)  # even the shortest wait takes time
        while due := sorted((d for d in self._due if d[0] <= end_s), key=lambda d: d[0]):
            self._due.remove(due[0])
            self.now_s = max(self.now_s, due[0][0])
            due[0][1]()
        self.now_s = end_s

    def at(self, time_s: float, action) -> None:
        self._due.append((time_s, action))

    def install(self, monkeypatch, *modules) -> None:
        """Give the clock to `modules` in place of `time`."""
        for module in modules:
            monkeypatch.setattr(module, "time", SimpleNamespace(
                monotonic=self.monotonic, sleep=self.sleep))  # fmt: skip


class FakePort:
    """A serial port whose bytes arrive at moments of a `Clock`."""

    slow = False
    path = "port"

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.arriving: deque[tuple[float, bytes]] = deque()
        self.written: list[tuple[float, bytes]] = []
        self.discarded = 0
        self.closed = False

    def arrives(self, after_s: float, data: bytes) -> None:
        """`data` is there `after_s` from now."""
        self.arriving.append((self._clock.now_s + after_s, data))

    def read(self, timeout_s: float = 0.05) -> bytes:
        end_s = self._clock.now_s + timeout_s
        if self.arriving and self.arriving[0][0] <= end_s:
            self._clock.sleep(self.arriving[0][0] - self._clock.now_s)
            data = b""
            while self.arriving and self.arriving[0][0] <= self._clock.now_s:
                data += self.arriving.popleft()[1]
            return data
        self._clock.sleep(timeout_s)
        return b""

    def write(self, data: bytes) -> None:
        self.written.append((self._clock.now_s, data))

    def discard_input(self) -> None:
        self.discarded += 1

    def close(self) -> None:
        self.closed = True
