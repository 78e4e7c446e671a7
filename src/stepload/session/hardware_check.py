"""Whether a plan may be pressed outside a dry run, as far as it can be read from the plan alone."""

from __future__ import annotations

from stepload.errors import RefusedError
from stepload.plan.model import ArmSpec, DisplacementSpec, ForceSpec, Plan
from stepload.plan.overlay import SIMULATED


def simulated_devices(plan: Plan) -> list[str]:
    """Keys of the devices of a plan that are simulated: it can be rehearsed, not run."""
    rig, second = plan.rig, plan.rig.second_force.sensor
    specs: dict[str, ArmSpec | ForceSpec | DisplacementSpec | None] = {
        "arm": rig.arm, "force": rig.force, "second_force.sensor": second,
        "displacement": rig.displacement,
    }  # fmt: skip
    return [f"rig.{key}" for key, spec in specs.items() if spec and spec.driver == SIMULATED]


def refuse_simulated(plan: Plan) -> None:
    """Refuse simulated devices outside a dry run: they press a payload of their own.

    Raises:
        RefusedError: with the keys that name them; what they say is no measurement.
    """
    named = simulated_devices(plan)
    if named:
        raise RefusedError(
            f"{', '.join(named)}: simulated, so nothing can be pressed",
            hint="add --dry-run to rehearse; name the drivers of your devices to press",
        )
