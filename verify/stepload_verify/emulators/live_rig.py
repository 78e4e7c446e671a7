"""Emulators of a whole rig around one contact world, in one process and in real time."""

from __future__ import annotations

import json
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.rig.world import DEFAULT_SPEC, PayloadTruth, WorldFault, WorldSpec
from stepload_drivers.sim.live import LiveWorld
from stepload_verify.emulators.catalog import CAN_SENSORS, EMULATORS, GAUGES
from stepload_verify.emulators.emulator import Emulator
from stepload_verify.emulators.faults import FaultBoard
from stepload_verify.emulators.physics import AXES, Tool, Wrench, WrenchSource
from stepload_verify.emulators.ur_world import LiveAxis, mount_from


class WorldPhysics:
    """Contact force and deformation of a live world, with a sensor's offset and drift."""

    def __init__(self, world: LiveWorld, spec: WorldSpec) -> None:
        self._world = world
        self._bias_n = spec.start_force_bias_n
        self._drift_n_per_s = spec.force_drift_n_per_s
        self._index = AXES.index(spec.force_axis[1:])
        self._sign = -1.0 if spec.force_axis[0] == "-" else 1.0

    def force_n(self, time_s: float) -> float:
        age_s = time_s - self._world.origin_s
        state = self._world.at(time_s)
        felt_n = state.force_n if state.felt is None else self._sign * state.felt[self._index]
        return felt_n + self._bias_n + self._drift_n_per_s * age_s

    def beside(self, time_s: float) -> Wrench | None:
        """The wrench without the component that shows the press; None of a rig with one axis."""
        felt = self._world.at(time_s).felt
        if felt is None:
            return None
        a, b, c, d, e, f = (0.0 if i == self._index else part for i, part in enumerate(felt))
        return a, b, c, d, e, f

    def closed_m(self, time_s: float) -> float:
        return self._world.at(time_s).deformation_m


def dump_spec(spec: WorldSpec) -> str:
    """`spec` as JSON text, for `load_spec`."""
    return json.dumps(asdict(spec))


def load_spec(path: Path) -> WorldSpec:
    """A `WorldSpec` from JSON; what the file does not say is a stiff machine's.

    Raises:
        BadInputError: not readable, not JSON, or an unknown field.
    """
    try:
        data: dict[str, Any] = json.loads(path.read_text())
        if "payload" in data:
            data["payload"] = PayloadTruth(**data["payload"])
        if data.get("mount") is not None:
            data["mount"] = mount_from(data["mount"])
        if "faults" in data:
            data["faults"] = tuple(WorldFault(**fault) for fault in data["faults"])
        return replace(DEFAULT_SPEC, **data)
    except (OSError, ValueError, TypeError, AttributeError) as error:
        names = ", ".join(field.name for field in fields(WorldSpec))
        raise BadInputError(
            f"{path} does not describe a world: {error}", hint=f"a JSON object of {names}"
        ) from error


class LiveRig:
    """One world, and emulated sensors that feel it; sensors run from `start` to `stop`.

    Args:
        sensors: driver names, each once; those of `GAUGES` measure the deformation.
        boards: fault board of each sensor by name; sound where there is none.
        transport: of sensors on CAN, "slcan" or "socketcand".
    """

    def __init__(
        self,
        spec: WorldSpec,
        sensors: tuple[str, ...],
        boards: dict[str, FaultBoard],
        transport: str = "slcan",
    ) -> None:
        self.world = LiveWorld(spec)
        self.axis = LiveAxis(self.world)
        self.tool = Tool()
        physics = WorldPhysics(self.world, spec)
        self.emulators: dict[str, Emulator] = {}
        for name in sensors:
            if name not in EMULATORS:
                raise BadInputError(
                    f"no emulator named {name!r}", hint=f"one of {', '.join(EMULATORS)}"
                )
            source = WrenchSource(physics, spec.force_axis, spec.force_noise_n, tool=self.tool)
            options: dict[str, Any] = {}
            if name in GAUGES:
                options["rate_hz"] = spec.gauge_rate_hz or 10.0
            elif name in ("bota_serial", "ati_can", "ati_net", "line_serial"):
                options["rated_n"] = spec.force_range_n
            elif spec.force_range_n > 200.0:
                options["model_name"] = "RFT80-6A03"
            if name in CAN_SENSORS:
                options["transport"] = transport
            self.emulators[name] = EMULATORS[name](
                source, boards.get(name, FaultBoard()), **options
            )

    def start(self) -> None:
        """Serve all sensors."""
        for emulator in self.emulators.values():
            emulator.start()

    def stop(self) -> None:
        """End the service of all sensors."""
        for emulator in self.emulators.values():
            emulator.stop()
