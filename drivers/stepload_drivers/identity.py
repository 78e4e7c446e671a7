"""Check that a device is the one named in the rig file."""

from __future__ import annotations

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode


def require_serial_number(name: str, found: str, expected: str) -> None:
    """Refuse another device; an empty `expected` takes any.

    Raises:
        DeviceError: another serial number.
    """
    if expected and found != expected:
        raise DeviceError(
            f"{name} has serial number {found!r}, the rig file says {expected!r}",
            code=FaultCode.WRONG_DEVICE,
            hint="connect the right device, or correct `serial_number` in the rig file",
        )
