"""One RTDE client of the emulated controller: recipes, packages, what faults do to them."""

from __future__ import annotations

import math
import random
import struct
from typing import Protocol

from stepload_drivers.ur import frames
from stepload_drivers.ur.frames import DATA, Frame, encode, package_struct, split_names
from stepload_verify.emulators.ur_faults import Faults
from stepload_verify.emulators.ur_variables import INPUT_TYPES, Version, output_type

Value = float | int | tuple[float, ...]


class Controller(Protocol):
    """What a session needs of the controller."""

    version: Version
    rate_hz: float
    faults: Faults

    def value(self, name: str) -> Value: ...
    def write_input(self, name: str, value: Value) -> None: ...
    def owner_of(self, name: str) -> object | None: ...


class Session:
    """Protocol state of one connection to port 30004."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._reader = frames.FrameReader()
        self._outputs: list[str] = []
        self._output_struct = package_struct([])
        self._inputs: dict[int, tuple[list[str], struct.Struct]] = {}
        self._started = False
        self._every = 1
        self._cycle = 0
        self._last = b""
        self._random = random.Random(1)
        self.registers: set[str] = set()

    @property
    def controls(self) -> bool:
        """Whether this client writes inputs, as ur_rtde's control interface does."""
        return bool(self._inputs)

    def feed(self, data: bytes) -> bytes:
        """Answer to what the client sent.

        Raises:
            FrameError: not RTDE; the connection is to be closed.
        """
        return b"".join(self._answer(frame) for frame in self._reader.feed(data))

    def _answer(self, frame: Frame) -> bytes:
        kind, payload = frame
        if kind == frames.REQUEST_PROTOCOL_VERSION:
            return encode(kind, bytes([payload == b"\x00\x02"]))
        if kind == frames.GET_VERSION:
            return encode(kind, struct.pack(">4I", *self._controller.version))
        if kind == frames.SETUP_OUTPUTS:
            return encode(kind, self._set_outputs(payload))
        if kind == frames.SETUP_INPUTS:
            return encode(kind, self._set_inputs(payload))
        if kind == frames.START:
            self._started = bool(self._outputs)
            return encode(kind, bytes([self._started]))
        if kind == frames.PAUSE:
            self._started = False
            return encode(kind, b"\x01")
        if kind == DATA:
            self._write(payload)
        return b""

    def _set_outputs(self, payload: bytes) -> bytes:
        (hz,) = struct.unpack_from(">d", payload)
        names = split_names(payload[8:])
        types = [output_type(name, self._controller.version) for name in names]
        if "NOT_FOUND" in types:
            return b"\x00" + ",".join(types).encode()
        self._outputs, self._output_struct = names, package_struct(types)
        self._every = max(1, round(self._controller.rate_hz / hz)) if hz > 0 else 1
        return b"\x01" + ",".join(types).encode()

    def _set_inputs(self, payload: bytes) -> bytes:
        names = split_names(payload)
        types = [INPUT_TYPES.get(name, "NOT_FOUND") for name in names]
        for index, name in enumerate(names):
            if self._controller.owner_of(name) not in (None, self):
                types[index] = "IN_USE"
        if "NOT_FOUND" in types or "IN_USE" in types:
            return b"\x00" + ",".join(types).encode()
        number = len(self._inputs) + 1
        self._inputs[number] = (names, package_struct(types))
        self.registers.update(names)
        return bytes([number]) + ",".join(types).encode()

    def _write(self, payload: bytes) -> None:
        if self._controller.faults.ignore_inputs:
            return
        names, layout = self._inputs.get(payload[0] if payload else 0, ([], None))
        if layout is None or layout.size != len(payload):
            return
        values = list(layout.unpack(payload)[1:])
        for name in names:
            if INPUT_TYPES[name] == "VECTOR6D":
                self._controller.write_input(name, tuple(values[:6]))
                del values[:6]
            else:
                self._controller.write_input(name, values.pop(0))

    def package(self) -> bytes:
        """This period's data package; empty when there is none to send."""
        if not self._started:
            return b""
        self._cycle += 1
        if self._cycle % self._every:
            return b""
        faults = self._controller.faults
        if not (faults.repeat and self._last):
            self._last = encode(DATA, self._payload(faults))
        package = self._last
        if faults.wrong_size == ("control" if self.controls else "receive"):
            package, faults.wrong_size = struct.pack(">H", 1) + package[2:], ""
        if faults.wrong_type:
            package = package[:2] + b"Z" + package[3:]
        return package

    def _payload(self, faults: Faults) -> bytes:
        if faults.random:
            return b"\x01" + self._random.randbytes(self._output_struct.size - 1)
        flat: list[float | int] = []
        for name in self._outputs:
            value = self._controller.value(name)
            flat.extend(value if isinstance(value, tuple) else (value,))
        if faults.nan:
            flat = [math.nan if isinstance(x, float) else x for x in flat]
        recipe = 9 if faults.wrong_recipe else 1
        payload = self._output_struct.pack(recipe, *flat)
        return payload[: len(payload) // 2] if faults.short else payload
