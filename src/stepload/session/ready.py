"""Whether a plan may be pressed outside a dry run, as far as it can be read from the plan alone."""

from __future__ import annotations

from stepload.envelope.envelope import Envelope
from stepload.envelope.proof import unproven
from stepload.errors import RefusedError
from stepload.plan.model import ArmSpec, DisplacementSpec, ForceSpec, Plan
from stepload.plan.overlay import SIMULATED

PROVE = (
    "push by hand on the tool, as the plate will, see which component answers with which sign,"
    " write axis and pushed_on (stepload setup does it step by step)"
)


def simulated_devices(plan: Plan) -> list[str]:
    """Keys of the devices of a plan that are simulated: it can be rehearsed, not run."""
    rig, second = plan.rig, plan.rig.second_force.sensor
    specs: dict[str, ArmSpec | ForceSpec | DisplacementSpec | None] = {
        "arm": rig.arm, "force": rig.force, "second_force.sensor": second,
        "displacement": rig.displacement,
    }  # fmt: skip
    return [f"rig.{key}" for key, spec in specs.items() if spec and spec.driver.name == SIMULATED]


def refuse_simulated(plan: Plan) -> None:
    """Refuse simulated devices outside a dry run: they press a payload of their own.

    Raises:
        RefusedError: with the keys that name them; what they say is no measurement.
    """
    named = simulated_devices(plan)
    if named:
        raise RefusedError(
            f"{named[0]} names the driver {SIMULATED}, which simulates a payload of its own and"
            " not the plan's: what it says is no measurement",
            hint="rehearse the plan with --dry-run, or name the drivers of your devices: "
            + ", ".join(f"{key}.driver" for key in named),
        )


def refuse_unproven(envelope: Envelope) -> None:
    """Refuse a run in which nothing proves axis and sign of the force channels.

    Raises:
        RefusedError: neither a push by hand nor the run itself proves one of them.
    """
    found = unproven(envelope.plan)
    if found:
        raise RefusedError(
            f"axis and sign of the force are not proven: {'; '.join(found)}", hint=PROVE
        )
