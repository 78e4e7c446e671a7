"""The declaration of the simulated rig: how the truth of a dry run differs from the plan."""

from collections.abc import Iterator, Mapping
from typing import Annotated

from pydantic import Field
from pydantic.dataclasses import dataclass

from stepload.declaration import quantities as q
from stepload.declaration.sections import CHECKED, SECTION, Contradiction
from stepload.plan.mounting import Mounting

_Factor = Annotated[float, q.number(0.01, 100.0)]
_Bend = Annotated[float, q.Quantity("%", -0.1, 0.1)]


@dataclass(frozen=True, slots=True, config=SECTION)
class Simulation:
    """How the simulated rig differs from what the plan believes; only dry runs use it."""

    seed: Annotated[int, q.number(0, 2**31 - 1)] = 1
    """Seed of all random numbers."""
    law: Annotated[str, q.Choice(("declared", "smooth", "rough", "elastic_plastic"))] = "declared"
    """Contact law; declared: rough or plastic where the payload's data say so."""
    payload_factor: _Factor = 1.0
    """True payload stiffness over the planned one."""
    stiffness_factor: _Factor = 1.0
    """True system stiffness over K_s."""
    surface_error_m: Annotated[float, q.Quantity("m", -0.1, 0.1)] = 0.0
    """True minus expected surface; negative: nearer."""
    hysteresis: Annotated[float, q.Quantity("%", 0.0, 0.9)] = 0.0
    """Share of the loading work lost in a cycle."""
    kinematic_error_m: q.LengthOrZero = 0.0
    """Standard deviation of the smooth error of the measured travel."""
    kinematic_length_n: q.Force = 50.0
    """Correlation length of that error in force."""
    force_drift_n_per_s: Annotated[float, q.Quantity("N/s", -10.0, 10.0)] = 0.0
    """True drift of the force zero."""
    roughness_m: q.LengthOrZero | None = None
    """True rms roughness σ_eq; none: the payload's."""
    micro_hardness_pa: q.Pressure | None = None
    """True micro-hardness; none: the payload's, or five times the lower yield strength."""
    yield_force_n: q.Force | None = None
    """True elastic limit of a sphere (14); none: as `law` says."""
    creep: q.Share = 0.0
    """Final creep at constant force, share of the deformation."""
    creep_time_s: q.Duration = 5.0
    """Shortest time constant of the creep."""
    creep_decades: Annotated[int, q.number(0, 6)] = 0
    """Decades of time constants above `creep_time`; 0: one time constant."""
    seating_m: q.LengthOrZero = 0.0
    """Travel of the payload's one-time seating."""
    seating_force_n: q.Force = 100.0
    """Force at which seating is complete."""
    slip_m: q.LengthOrZero = 0.0
    """Lost motion behind the measured travel after a reversal."""
    drift_m_s: Annotated[float, q.Quantity("m/s", -1e-4, 1e-4)] = 0.0
    """Growth of the load path towards the plate, not measured by the arm."""
    pad_stiffness_n_per_m: q.Stiffness | None = None
    """Stiffness of a soft pad over the payload; none: no pad."""
    pad_depth_m: q.LengthOrZero = 0.0
    """Largest compression of the pad."""
    stop_depth_m: q.Length | None = None
    """Deformation at which a hidden stop begins to carry; none: no stop."""
    stop_stiffness_n_per_m: q.Stiffness = 1e9
    """Stiffness of that stop."""
    adhesion_n: q.ForceOrZero = 0.0
    """Adhesive force of the contact."""
    adhesion_law: Annotated[str, q.Choice(("dmt", "jkr"))] = "dmt"
    """dmt: the force less `adhesion`; jkr: a soft smooth sphere."""
    softness: Annotated[float, q.Quantity("%", 0.0, 10.0)] = 0.0
    """Extra compliance of the load path at zero force, as a share."""
    softness_force_n: q.Force = 100.0
    """Force over which that share falls by 1/e."""
    lateral: q.ShareAcross = 0.0
    """Lateral force, share of the axial force."""
    lateral_coupling: q.ShareAcross = 0.3
    """Axial travel of the tip under lateral force, over F/K_s."""
    cross_talk: Annotated[float, q.Quantity("%", -1.0, 1.0)] = 0.0
    """Share of the lateral force in the axial reading."""
    sensor_quadratic: _Bend = 0.0
    """Sensor error that grows as F², share of full scale."""
    sensor_cubic: _Bend = 0.0
    """Sensor error that grows as F³, share of full scale."""
    mount: Mounting | None = None
    """Six axes: lateral compliance, friction, tilt; none: the axial motion only."""
    world: q.Name = "sim"
    """Name of an installed simulator; `stepload drivers` lists them."""
    world_options: Mapping[str, object] = Field(default_factory=dict)
    """Options of that simulator."""

    sound = CHECKED

    def contradictions(self) -> Iterator[Contradiction]:
        if (self.pad_stiffness_n_per_m is None) != (self.pad_depth_m == 0.0):
            yield (
                "",
                "`pad_stiffness` and `pad_depth` belong together",
                "a pad is a spring that can be compressed by its depth: give both, or neither",
            )
        if self.roughness_m and self.law not in ("declared", "rough"):
            yield (
                "roughness",
                f"a roughness, but the simulated law is {self.law}",
                "write law: rough or law: declared; `yield_force` makes them flow as well",
            )
        if self.roughness_m == 0.0 and self.law == "rough":
            yield "roughness", "a rough law without roughness", "write law: smooth"
        jkr = self.adhesion_n > 0.0 and self.adhesion_law == "jkr"
        if jkr and (self.law == "rough" or self.roughness_m):
            yield "adhesion_law", "jkr adhesion of a rough contact", "asperities part it: use dmt"
        if self.cross_talk != 0.0 and self.lateral == 0.0:
            yield (
                "cross_talk",
                "cross-talk without a lateral force has no effect",
                "give `lateral` too, or leave both out",
            )
