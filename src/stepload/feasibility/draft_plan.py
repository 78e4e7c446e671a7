"""Makes a plan from rig, payload, top force and order, and reads it like any plan file."""

from __future__ import annotations

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload.plan.problems import PlanError
from stepload.plan.references import names_a_file, profiles

FREE_S = 4.0
"""Time in s in free air after each cycle."""
CYCLES = 2
"""One cycle cannot separate drift from creep, and the identification does not use a third."""


@dataclass(frozen=True, slots=True)
class Order:
    """Equal steps up to its top force, ramps and holds; the default is that of a map."""

    steps: int = 6
    hold_s: float = 3.0
    ramp_s: float = 1.0


DEFAULT = Order()
SURFACE = "5 mm"
"""Travel to the surface where none is given. It takes time and changes no result."""


def plan_of(
    rig: str, payload: Path, top_n: float, order: Order = DEFAULT, surface: str = SURFACE
) -> Plan:
    """The plan of equal steps up to `top_n`; `surface` is the travel to the surface.

    Raises:
        BadInputError: no such rig or payload, or no plan with these numbers.
        PlanError: what is wrong in their files.
    """
    if not payload.is_file():
        raise BadInputError(f"{payload}: there is no such payload file")
    tree = {
        "stepload": 1,
        "payload": str(payload.resolve()),
        "rig": rig_of(rig),
        "procedure": {
            "top_force": f"{top_n!r} N", "step": f"{top_n / order.steps!r} N",
            "load_rate": f"{top_n / order.steps / order.ramp_s!r} N/s",
            "hold": f"{order.hold_s!r} s", "cycles": CYCLES, "surface_distance": surface,
        },
    }  # fmt: skip
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "map.yaml"
        path.write_text(json.dumps(tree), encoding="utf-8")
        try:
            return load_plan(path)
        except PlanError as error:
            # Problems of the generated plan itself are reported without their place.
            if all(problem.file == str(path) for problem in error.problems):
                first = error.problems[0]
                raise BadInputError(
                    f"at a top force of {top_n:.4g} N in {order.steps} steps: {first.message}",
                    hint=first.hint or "another top force",
                ) from error
            raise


def rig_of(rig: str) -> str | dict[str, Any]:
    """The `rig` of a plan; devices of a profile are simulated, for it names no addresses.

    Raises:
        BadInputError: there is no such rig.
    """
    if names_a_file(rig):
        if not Path(rig).is_file():
            raise BadInputError(f"{rig}: there is no such rig file")
        return str(Path(rig).resolve())
    if rig in profiles():
        return {"profile": rig, "arm": {"driver": "sim"}, "force": {"driver": "sim"}}
    raise BadInputError(
        f"no rig profile is named {rig!r}", hint=f"there are {', '.join(profiles())}; or a FILE"
    )
