"""The truth of a simulated rig, and how a simulator is found (group `stepload.worlds`).

A `WorldFactory` takes a `WorldSpec` and gives a `SimulatedRig`: devices that pass the contract
suite (`stepload.rig.contract_world`), and a clock that makes the world go on when it is slept on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Protocol, cast

from stepload.errors import BadInputError
from stepload.rig.clock import Clock
from stepload.rig.device import Arm, DisplacementSensor, ForceSensor
from stepload.rig.mount import Mount
from stepload.rig.plugins import WORLDS, load_plugin


@dataclass(frozen=True, slots=True)
class PayloadTruth:
    """The contact as it really is; what is not given is absent.

    Attributes:
        law: "smooth", "rough", "elastic_plastic" or "rough_elastic_plastic".
        k, n: the smooth law in N/m^n.
        elastic_limit_n: force at which plastic flow begins, for the plastic laws.
        roughness_m, kappa: σ_eq and κ of (8)–(12), for the rough laws.
        hysteresis: share of the loading work lost in a cycle.
        hard_stop_m: deformation at which a hidden stop takes over (inf: none).
        stop_stiffness_n_per_m: stiffness of that stop.
        pad_stiffness_n_per_m, pad_depth_m: a linear pad in series, until it is compressed by its
            depth.
        adhesion_n, adhesion_law: pull-off force, "dmt" or "jkr" (n = 1.5 without roughness).
        seating_m, seating_depth_m: travel that is never given back, in proportion to the deepest
            deformation so far, all of it once that has reached `seating_depth_m`.
        creep: final growth of the deformation under constant force, as a share.
        creep_time_s, creep_decades: time constants `creep_time_s` · 10^0 … 10^decades, which share
            the creep evenly.
        poisson_ratio: of the body that yields first: how much a lateral load lowers its limit.
    """

    law: str
    k: float
    n: float
    elastic_limit_n: float = math.inf
    roughness_m: float = 0.0
    kappa: float = 0.0
    hysteresis: float = 0.0
    hard_stop_m: float = math.inf
    stop_stiffness_n_per_m: float = 1e9
    pad_stiffness_n_per_m: float = math.inf
    pad_depth_m: float = 0.0
    adhesion_n: float = 0.0
    adhesion_law: str = "dmt"
    seating_m: float = 0.0
    seating_depth_m: float = 0.0
    creep: float = 0.0
    creep_time_s: float = 1.0
    creep_decades: int = 0
    poisson_ratio: float = 0.3


@dataclass(frozen=True, slots=True)
class WorldFault:
    """A fault at `start_s` of world time for `duration_s`; `kind` is one of the world's FAULTS."""

    kind: str
    start_s: float
    duration_s: float
    magnitude: float


@dataclass(frozen=True, slots=True)
class WorldSpec:
    """Everything a simulated rig needs; SI units, unit in the name.

    `surface_m` is the travel at which the payload really touches. `start_force_bias_n` is the
    sensor's reading in free air before tare. `gauge_rate_hz` 0: no displacement gauge;
    `second_force_rate_hz` 0: no second force sensor.
    `kinematic_error_m` is the sd of a smooth error of the measured position in contact, correlated
    over `kinematic_length_m` of travel.

    `drift_m_s` is the speed at which the surface comes nearer, unseen by the arm; `slip_m` lost
    motion between the measured travel and the drive. The load path's compliance is
    1/K_s (1 + `softness` exp(−F/`softness_force_n`)). `lateral` is the lateral force over
    the force along it; the force sensor reads `cross_talk` of it along the axis, and besides
    errors of `sensor_quadratic` and `sensor_cubic` of full scale at full scale.
    Force sensors of `six_components` have noise across the axis too. `mount` gives
    the rig six axes; without it, it has the pressing axis alone.
    """

    seed: int
    payload: PayloadTruth
    surface_m: float
    arm_rate_hz: float
    system_stiffness_n_per_m: float
    system_damping_n_s_per_m: float
    effective_mass_kg: float
    command_delay_s: float
    lag_s: float
    max_speed_m_s: float
    max_acceleration_m_s2: float
    max_push_n: float
    position_quantum_m: float
    position_noise_m: float
    arm_has_force: bool
    arm_force_noise_n: float
    force_rate_hz: float
    force_axis: str
    force_noise_n: float
    force_quantum_n: float
    force_delay_s: float
    force_range_n: float
    start_force_bias_n: float
    lost_motion_m: float = 0.0
    kinematic_error_m: float = 0.0
    kinematic_length_m: float = 0.0
    force_drift_n_per_s: float = 0.0
    gauge_rate_hz: float = 0.0
    gauge_quantum_m: float = 0.0
    gauge_noise_m: float = 0.0
    faults: tuple[WorldFault, ...] = ()
    second_force_rate_hz: float = 0.0
    second_force_axis: str = "+fz"
    second_force_noise_n: float = 0.0
    second_force_quantum_n: float = 0.0
    second_force_delay_s: float = 0.0
    second_force_range_n: float = 0.0
    drift_m_s: float = 0.0
    slip_m: float = 0.0
    softness: float = 0.0
    softness_force_n: float = 100.0
    lateral: float = 0.0
    cross_talk: float = 0.0
    sensor_quadratic: float = 0.0
    sensor_cubic: float = 0.0
    six_components: bool = False
    mount: Mount | None = None


DEFAULT_SPEC = WorldSpec(
    seed=0,
    payload=PayloadTruth("smooth", k=6.57e8, n=1.5),
    surface_m=2e-3,
    arm_rate_hz=500.0,
    system_stiffness_n_per_m=3.49e6,
    system_damping_n_s_per_m=2.0 * math.sqrt(3.49e6 * 20.0),
    effective_mass_kg=20.0,
    command_delay_s=0.002,
    lag_s=0.004,
    max_speed_m_s=0.25,
    max_acceleration_m_s2=2.0,
    max_push_n=1000.0,
    position_quantum_m=2e-6,
    position_noise_m=0.5e-6,
    arm_has_force=True,
    arm_force_noise_n=3.0,
    force_rate_hz=1000.0,
    force_axis="+fz",
    force_noise_n=0.1,
    force_quantum_n=0.05,
    force_delay_s=0.002,
    force_range_n=1000.0,
    start_force_bias_n=5.0,
)
"""A stiff one-axis machine with the paper's plastic sphere, 2 mm above it."""


class WorldView(Protocol):
    """What tests and campaigns may ask of a world, and the engine may not."""

    @property
    def true_peak_force_n(self) -> float:
        """Largest true contact force so far: the resultant of all its components."""

    @property
    def true_peak_equivalent_n(self) -> float:
        """Largest |f|/g(t) so far: the axial force that brings the payload as near to its limit.

        g is the share of the elastic limit that a lateral share t = tangential/normal force leaves.
        """

    @property
    def true_force_n(self) -> float:
        """True contact force now."""


@dataclass(slots=True)
class SimulatedRig:
    """Devices of a simulated rig; `second_force` is None when the arm is the second channel.

    `world` is None where the simulator does not tell the truth: nothing but tests asks for it.
    """

    arm: Arm
    force: ForceSensor
    displacement: DisplacementSensor | None
    second_force: ForceSensor | None
    clock: Clock
    world: WorldView | None = None


class WorldFactory(Protocol):
    """Makes simulated rigs.

    It may have two attributes: `OPTIONS`, declared as a driver's are, and given by name; `faults`,
    the kinds of `WorldFault` it knows, each with one line of help.
    """

    def __call__(self, spec: WorldSpec, **options: object) -> SimulatedRig: ...


def faults_of(world: WorldFactory) -> Mapping[str, str]:
    """The kinds of faults that a world can show, each with one line of help."""
    faults: Mapping[str, str] = getattr(world, "faults", {})
    return faults


def load_world(name: str = "sim") -> WorldFactory:
    """The installed simulator called `name`.

    Raises:
        BadInputError: not installed, or broken, with the reason.
    """
    return cast(WorldFactory, load_plugin(WORLDS, name))


EFFECTS = (
    "law", "hysteresis", "hard_stop_m", "pad_stiffness_n_per_m", "adhesion_n", "seating_m", "creep",
    "faults", "mount", "gauge_rate_hz", "second_force_rate_hz", "lost_motion_m",
    "kinematic_error_m", "force_drift_n_per_s", "drift_m_s", "slip_m", "softness", "lateral",
    "cross_talk", "sensor_quadratic", "sensor_cubic",
)  # fmt: skip
"""Fields of payload and rig that ask for something unless they have their default."""


def refuse_unsimulated(spec: WorldSpec, *simulated: str) -> None:
    """Refuse what a plan asks of its simulated rig and a world leaves out.

    Args:
        simulated: the `EFFECTS` that the world has.

    Raises:
        BadInputError: another one is asked for.
    """
    for part in (spec.payload, spec):
        for each in fields(part):
            value = getattr(part, each.name)
            default = "smooth" if each.name == "law" else each.default
            if each.name in EFFECTS and each.name not in simulated and value != default:
                raise BadInputError(
                    f"this world does not simulate {each.name} = {value}",
                    hint="leave it out (law: smooth) in rig.simulation, or use another world",
                )
