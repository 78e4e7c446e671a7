"""Counts data packages: sequence numbers and gaps from the controller's own time stamps."""

from __future__ import annotations

import math

from stepload.rig.device import Health


class PacketCounter:
    """`period_s` is the controller's; a package is lost for every period without a stamp."""

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._first_s = math.nan
        self._last_s = math.nan
        self._received_s = -math.inf
        self._sequence = -1
        self._received = 0
        self._lost = 0
        self._gaps = 0
        self._longest_gap_s = 0.0

    def add(self, stamp_s: float, receive_time_s: float) -> int:
        """Sequence number of a package: periods since the first, never twice the same."""
        self._received += 1
        self._received_s = receive_time_s
        if self._sequence < 0:
            self._first_s = self._last_s = stamp_s
            self._sequence = 0
            return 0
        periods = round((stamp_s - self._first_s) / self._period_s)
        sequence = max(periods, self._sequence + 1)
        missing = sequence - self._sequence - 1
        self._lost += missing
        self._gaps += missing > 0
        self._longest_gap_s = max(self._longest_gap_s, stamp_s - self._last_s)
        self._sequence, self._last_s = sequence, stamp_s
        return sequence

    def health(self, now_s: float) -> Health:
        span_s = self._last_s - self._first_s
        return Health(
            received=self._received,
            lost=self._lost,
            rate_hz=(self._received - 1) / span_s if span_s > 0.0 else 0.0,
            age_s=now_s - self._received_s,
            longest_gap_s=self._longest_gap_s,
            errors={"gaps": self._gaps},
        )
