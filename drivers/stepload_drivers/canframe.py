"""A CAN frame with the time at which it was on the bus, and the pairing of frames."""

from __future__ import annotations

from typing import NamedTuple


class CanFrame(NamedTuple):
    """One received data frame.

    `time_s` is for differences only: the interface's stamp, or the latest time at which the frame
    can have come where the interface has none (slcan); it may then have come `early_s` before.
    """

    id: int
    data: bytes
    time_s: float
    early_s: float = 0.0


def together(first: CanFrame, second: CanFrame, limit_s: float) -> bool:
    """Whether `second` may have followed `first` within `limit_s`.

    A gap that a stall of the host or the adapter's batches may have caused does not count.
    """
    return 0.0 <= second.time_s - first.time_s <= limit_s + second.early_s
