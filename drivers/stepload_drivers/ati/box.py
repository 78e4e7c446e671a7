"""What an ATI Ethernet sensor says about itself on its page `netftapi2.xml`."""

from __future__ import annotations

import contextlib
import http.client
import logging
import math
import re
import socket
import zlib
from collections.abc import Mapping
from dataclasses import dataclass

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.ati.rdt import AXIA, NET_BOX, Scale, StatusWord
from stepload_drivers.streamed import Deadline
from stepload_drivers.units import UNITS_N, UNITS_NM

HTTP_PORT = 80
PAGE = "/netftapi2.xml"
MOST_BYTES = 65536
ALIVE_S = 0.05
_log = logging.getLogger(__name__)
_ENTRY = re.compile(r"<(\w+)>([^<]*)</\1>")


@dataclass(frozen=True, slots=True)
class Box:
    """A device as described by its page.

    Attributes:
        scale: N and N·m of one count.
        internal_hz: rate at which it measures and counts.
        rated_n: calibrated range of |Fx|, |Fy|, |Fz|; inf where the page does not state it.
        status: format of its status word.
        calibration: active calibration and everything that scales the counts, as one text.
    """

    model: str
    serial_number: str
    firmware: str
    scale: Scale
    internal_hz: float
    rated_n: tuple[float, float, float]
    status: StatusWord
    calibration: str


def fetch(host: str, port: int, name: str, deadline: Deadline) -> str:
    """The page, as text.

    Raises:
        DeviceError: no answer, or something other than the page.
    """
    link = http.client.HTTPConnection(host, port, timeout=deadline.left_s(f"{name}: its page"))
    try:
        link.request("GET", PAGE)
        answer = link.getresponse()
        text = answer.read(MOST_BYTES).decode("utf-8", "replace")
        status = answer.status
        _log.debug("http://%s:%d%s -> %d, %s", host, port, PAGE, status, text)
        if answer.length:  # cut short, or more than any device has to say
            raise http.client.IncompleteRead(b"", answer.length)
    except (OSError, http.client.HTTPException) as error:
        raise DeviceError(
            f"{name}: http://{host}:{port}{PAGE} does not answer ({error or 'no answer'})",
            code=FaultCode.NOT_CONNECTED,
            hint="check power, cable, the address, and that this computer has one in its network",
        ) from error
    finally:
        link.close()
    if status != http.client.OK:
        raise DeviceError(
            f"{name}: http://{host}:{port}{PAGE} answers {status}, not the device's settings",
            code=FaultCode.UNSUPPORTED,
            hint="no ATI device is there",
        )
    return text


def answers(host: str, port: int) -> bool:
    """Whether something takes a connection for the page within 50 ms: the device is alive."""
    with contextlib.suppress(OSError), socket.create_connection((host, port), ALIVE_S):
        return True
    return False


def read_box(text: str, name: str) -> Box:
    """Parse the page of a device.

    Raises:
        DeviceError: RDT is switched off, or a number or unit is missing or makes no sense.
    """
    page: dict[str, str] = dict(_ENTRY.findall(text))
    if page.get("comrdte", "Enabled").strip() in ("Disabled", "0"):
        raise DeviceError(
            f"{name}: its RDT interface is switched off",
            code=FaultCode.REFUSED_COMMAND,
            hint="switch it on under Communications on the device's own web pages",
        )
    force, torque = _unit(page, "scfgfu", UNITS_N, name), _unit(page, "scfgtu", UNITS_NM, name)
    model = page.get("prodname", "").strip()
    scale = Scale(
        force / _number(page, ("cfgcpf",), name), torque / _number(page, ("cfgcpt",), name)
    )
    serial_number = page.get("cfgcalsn", "").strip()
    shift = page.get("cfgtfx", "").strip()
    filtered = (page.get("setuserfilter") or page.get("setiirshift") or "?").strip()
    revision = zlib.crc32(repr((scale, shift)).encode())
    return Box(
        model or "ATI Net F/T",
        serial_number or "unknown",
        page.get("mfgdigver", "unknown").strip(),
        scale,
        _number(page, ("runrate", "setrate"), name),
        _rated(page, force),
        AXIA if "setrate" in page or "axia" in model.lower() else NET_BOX,
        f"calibration {page.get('cfgcalsel', '?').strip()}, scale {revision:08x}, "
        f"filter {filtered}",
    )


def _unit(page: Mapping[str, str], key: str, units: Mapping[str, float], name: str) -> float:
    told = page.get(key, "")
    unit = units.get(re.sub(r"[-·. ]", "", told))
    if unit is None:
        raise _senseless(name, key, told)
    return unit


def _number(page: Mapping[str, str], keys: tuple[str, ...], name: str) -> float:
    key = next((key for key in keys if key in page), keys[0])
    told = page.get(key, "")
    with contextlib.suppress(ValueError):
        value = float(told)
        if math.isfinite(value) and value > 0.0:
            return value
    raise _senseless(name, key, told)


def _senseless(name: str, key: str, told: str) -> DeviceError:
    return DeviceError(
        f"{name}: its page says {key} = {told!r}, which makes no sense",
        code=FaultCode.OUT_OF_RANGE,
        hint="look at the active configuration on the device's own web pages",
    )


def _rated(page: Mapping[str, str], force_unit_n: float) -> tuple[float, float, float]:
    try:
        fx, fy, fz, *_ = (float(value) * force_unit_n for value in page["cfgmr"].split(";"))
    except (KeyError, ValueError):
        return (math.inf,) * 3
    x, y, z = (rated if rated > 0.0 else math.inf for rated in (fx, fy, fz))
    return (x, y, z)
