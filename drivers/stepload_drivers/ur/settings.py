"""Options of the UR arm, as one checked value that also crosses to the child process as JSON."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import Annotated

from pydantic import AfterValidator
from pydantic.dataclasses import dataclass

from stepload.declaration.quantities import (
    Choice,
    Flag,
    PathText,
    Setting,
    Vector,
    Verbatim,
    number,
    refused,
)
from stepload.declaration.sections import SECTION, key

Vector3 = tuple[float, float, float]


def _unit(vector: Vector3) -> Vector3:
    """A direction with length 1, which stays as it is when it is read again."""
    x, y, z = vector
    length = math.hypot(x, y, z)
    if length < 1e-6:
        raise refused("a direction without length", "for example [0, 0, -1]: downwards")
    if math.isclose(length, 1.0, rel_tol=1e-15):
        return vector
    return (x / length, y / length, z / length)


@dataclass(frozen=True, slots=True, kw_only=True, config=SECTION)
class Settings:
    """Options of `UrArm`; `approach` has length 1."""

    host: Annotated[PathText, key("address of the controller, a number rather than a name")]
    approach: Annotated[
        Vector,
        AfterValidator(_unit),
        key("approach direction in the base frame, any length, as in [0, 0, -1]"),
    ] = (0.0, 0.0, -1.0)
    serial_number: Annotated[Verbatim, key("refuse any other controller; empty: take any")] = ""
    upper_registers: Annotated[
        Flag, key("use RTDE registers 24 and up, where a fieldbus holds 0 to 23")
    ] = False
    lookahead_s: Annotated[float, Setting("s", 0.03, 0.2), key("servo look-ahead time")] = 0.1
    gain: Annotated[float, number(100.0, 2000.0), key("servo gain")] = 300.0
    tcp_offset_m: Annotated[
        Vector | None, key("TCP from the flange in m; not given: as installed")
    ] = None
    payload_mass_kg: Annotated[
        Annotated[float, Setting("kg", 0.0, 50.0)] | None,
        key("mass at the flange; not given: as installed"),
    ] = None
    payload_cog_m: Annotated[Vector, key("centre of gravity from the flange in m")] = (
        0.0, 0.0, 0.0,
    )  # fmt: skip
    watchdog_hz: Annotated[
        float,
        Setting("Hz", 1.0, 100.0),
        key("rate below which the controller stops the arm by itself"),
    ] = 10.0
    prove_watchdog: Annotated[Flag, key("at open, stop sending once and see the program end")] = (
        True
    )
    max_age_s: Annotated[float, Setting("s", 0.01, 2.0), key("older data are a fault")] = 0.02
    command_timeout_s: Annotated[
        float,
        Setting("s", 0.02, 2.0),
        key("silence of the run after which the arm is left to its watchdog"),
    ] = 0.1
    orphan_retract_m: Annotated[
        float,
        Setting("m", 0.0, 0.05),
        key("way back along the approach when the run has died under way; 0 m: only stop"),
    ] = 0.005
    max_lead_m: Annotated[
        float,
        Setting("m", 1e-5, 0.05),
        key("a target further ahead of the measured position or of the last target is refused"),
    ] = 0.002
    wrench_sign: Annotated[
        str,
        Choice(("reaction", "applied")),
        key(
            "whether the controller's wrench is the reaction on the tool or the force applied by it"
        ),
    ] = "reaction"

    def to_json(self) -> str:
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> Settings:
        return Settings(**json.loads(text))
