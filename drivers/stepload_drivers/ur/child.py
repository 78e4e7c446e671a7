"""The process that holds ur_rtde, which may hang or crash there without harm to the run.

Arguments: descriptor of the socket, settings as JSON, control period, seconds to connect.
"""

from __future__ import annotations

import os
import resource
import socket
import sys
from typing import Any

from stepload.errors import DeviceError
from stepload.rig.faults import FaultCode
from stepload_drivers.streamed import prefer_this_thread
from stepload_drivers.ur import procedures, wire
from stepload_drivers.ur.loop import HANG_S, Loop, stay_alive_for
from stepload_drivers.ur.procedures import RequestError
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.wire import Link


def _serve(loop: Loop, request: dict[str, Any]) -> None:
    number = request["number"]
    try:
        match request:
            case {"op": "safe"}:
                fields = procedures.stop_servo(loop)
            case {"op": "retract", "distance_m": distance_m, "speed_m_s": speed_m_s}:
                fields = procedures.retract(loop, distance_m, speed_m_s)
            case {"op": "prove", "distance_m": distance_m, "speed_m_s": speed_m_s}:
                fields = procedures.prove(loop, distance_m, speed_m_s)
            case _:
                raise RequestError(f"unknown request {request['op']!r}")
        reply = wire.pack_json(wire.REPLY, number=number, ok=True, **fields)
    except RequestError as error:
        loop.expect_stop = False
        reply = wire.pack_json(wire.REPLY, number=number, ok=False, message=str(error))
    loop.link.send(reply)


def _run(loop: Loop) -> None:
    """Serve until the run sends quit, or has ended: then unload."""
    while not loop.link.closed:
        loop.step()
        if loop.requests:
            request = loop.requests.pop(0)
            if request["op"] == "quit":
                return
            _serve(loop, request)
    procedures.unload(loop)


def _report_failure(
    link: Link, code: FaultCode, message: str, hint: str = "see the pendant's log"
) -> None:
    link.send(wire.pack_json(wire.FAULT, code=code.value, message=message, hint=hint, time_s=0.0))
    link.drain(0.1)


def main() -> None:
    """Connect, say hello, serve; ends without ur_rtde's destructors, which can hang."""
    descriptor, settings, period_s, connect_s = sys.argv[1:]
    prefer_this_thread()  # ur_rtde keeps only the newest package
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    stay_alive_for(float(connect_s))
    link = Link(socket.socket(fileno=int(descriptor)))
    try:
        link.send(wire.pack_json(wire.STAGE, name="RTDE receive interface"))
        loop = Loop(link, Settings.from_json(settings), float(period_s))
        link.send(wire.pack_json(wire.STAGE, name="RTDE control interface"))
        stay_alive_for(float(connect_s))
        procedures.connect(loop)
    except DeviceError as error:
        _report_failure(link, FaultCode(error.code), error.message, error.hint)
    except RuntimeError as error:
        _report_failure(link, FaultCode.NOT_CONNECTED, f"ur_rtde: {error}")
    except RequestError as error:
        _report_failure(link, FaultCode.REFUSED_COMMAND, str(error))
    else:
        stay_alive_for(HANG_S)
        link.send(wire.pack_json(wire.HELLO, start=list(loop.start)))
        _run(loop)
        procedures.leave(loop)
        link.drain(0.1)
    os._exit(0)


if __name__ == "__main__":
    main()
