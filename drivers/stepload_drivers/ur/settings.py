"""Options of the UR arm as one checked value that also crosses to the child process as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from stepload.errors import BadInputError
from stepload.rig.options import Option

Vector3 = tuple[float, float, float]

OPTIONS: Mapping[str, Option] = {
    "host": Option("text", "address of the controller, a number rather than a name", required=True),
    "approach": Option(
        "vector",
        "approach direction in the base frame, any length, as in [0, 0, -1]",
        default=(0.0, 0.0, -1.0),
    ),
    "serial_number": Option("text", "refuse any other controller; empty: take any", default=""),
    "upper_registers": Option(
        "boolean", "use RTDE registers 24 and up, where a fieldbus holds 0 to 23", default=False
    ),
    "lookahead": Option(
        "quantity", "servo look-ahead time", unit="s", default=0.1, low=0.03, high=0.2
    ),
    "gain": Option("number", "servo gain", default=300.0, low=100.0, high=2000.0),
    "tcp_offset": Option("vector", "TCP from the flange in m; not given: as installed"),
    "payload_mass": Option(
        "quantity", "mass at the flange; not given: as installed", unit="kg", low=0.0, high=50.0
    ),
    "payload_cog": Option("vector", "centre of gravity from the flange in m", default=(0, 0, 0)),
    "watchdog": Option(
        "quantity",
        "rate below which the controller stops the arm by itself",
        unit="Hz",
        default=10.0,
        low=1.0,
        high=100.0,
    ),
    "prove_watchdog": Option(
        "boolean", "at open, stop sending once and see the program end", default=True
    ),
    "max_age": Option(
        "quantity", "older data are a fault", unit="s", default=0.02, low=0.01, high=2.0
    ),
    "leash": Option(
        "quantity",
        "silence of the run after which the arm is left to its watchdog",
        unit="s",
        default=0.1,
        low=0.02,
        high=2.0,
    ),
    "orphan_retract": Option(
        "quantity",
        "way back along the approach when the run has died under way; 0 m: only stop",
        unit="m",
        default=0.005,
        low=0.0,
        high=0.05,
    ),
    "max_lead": Option(
        "quantity",
        "a target further ahead of the measured position or of the last target is refused",
        unit="m",
        default=0.002,
        low=1e-5,
        high=0.05,
    ),
    "wrench_sign": Option(
        "text",
        "whether the controller's wrench is the reaction on the tool or the force applied by it",
        default="reaction",
        choices=("reaction", "applied"),
    ),
}


@dataclass(frozen=True, slots=True)
class Settings:
    """Options of `UrArm`, checked; `approach` has length 1."""

    host: str
    approach: Vector3
    serial_number: str
    upper_registers: bool
    lookahead_s: float
    gain: float
    tcp_offset_m: Vector3 | None
    payload_mass_kg: float | None
    payload_cog_m: Vector3
    watchdog_hz: float
    prove_watchdog: bool
    max_age_s: float
    leash_s: float
    orphan_retract_m: float
    max_lead_m: float
    wrench_sign: str

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> Settings:
        fields = json.loads(text)
        for name in ("approach", "tcp_offset_m", "payload_cog_m"):
            if fields[name] is not None:
                fields[name] = tuple(fields[name])
        return Settings(**fields)


def settings_from(options: Mapping[str, Any]) -> Settings:
    """Settings from option values, defaults filled in.

    Raises:
        BadInputError: unknown or missing option, or a value outside its limits.
    """
    if unknown := sorted(set(options) - set(OPTIONS)):
        raise BadInputError(
            f"ur: unknown option {unknown[0]!r}", hint=f"options: {', '.join(OPTIONS)}"
        )
    values = {name: options.get(name, option.default) for name, option in OPTIONS.items()}
    for name, option in OPTIONS.items():
        value = values[name]
        if option.required and not value:
            raise BadInputError(f"ur: option {name!r} is missing", hint=option.help)
        if option.choices and value not in option.choices:
            raise BadInputError(f"ur: {name} = {value!r}", hint=f"one of {option.choices}")
        if value is None or option.low is None or option.high is None:
            continue
        if not option.low <= value <= option.high:  # also refuses NaN
            raise BadInputError(
                f"ur: {name} = {value} {option.unit}",
                hint=f"between {option.low} and {option.high} {option.unit}",
            )
    return Settings(
        host=str(values["host"]),
        approach=_unit(values["approach"]),
        serial_number=str(values["serial_number"]),
        upper_registers=bool(values["upper_registers"]),
        lookahead_s=float(values["lookahead"]),
        gain=float(values["gain"]),
        tcp_offset_m=None if values["tcp_offset"] is None else _vector(values["tcp_offset"]),
        payload_mass_kg=values["payload_mass"],
        payload_cog_m=_vector(values["payload_cog"]),
        watchdog_hz=float(values["watchdog"]),
        prove_watchdog=bool(values["prove_watchdog"]),
        max_age_s=float(values["max_age"]),
        leash_s=float(values["leash"]),
        orphan_retract_m=float(values["orphan_retract"]),
        max_lead_m=float(values["max_lead"]),
        wrench_sign=str(values["wrench_sign"]),
    )


def _vector(value: Any) -> Vector3:
    x, y, z = (float(component) for component in value)
    if not all(math.isfinite(component) for component in (x, y, z)):
        raise BadInputError(f"ur: vector {list(value)} is not finite")
    return (x, y, z)


def _unit(value: Any) -> Vector3:
    x, y, z = _vector(value)
    length = math.hypot(x, y, z)
    if length < 1e-6:
        raise BadInputError("ur: approach has no length", hint="for example [0, 0, -1]: downwards")
    return (x / length, y / length, z / length)
