"""Settings of a USB serial adapter, as the system reports them."""

from __future__ import annotations

from pathlib import Path

USB_SERIAL = Path("/sys/bus/usb-serial/devices")
MAX_LATENCY_MS = 1


def latency_timer_ms(port: str) -> int | None:
    """The adapter's latency timer, None for ports that have none (not FTDI, not USB).

    An adapter at its factory 16 ms delivers samples in bursts of that length.
    """
    try:
        return int((USB_SERIAL / Path(port).resolve().name / "latency_timer").read_text())
    except (OSError, ValueError):
        return None
