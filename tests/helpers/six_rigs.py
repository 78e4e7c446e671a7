"""Rigs with six axes for the tests of this room."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from stepload.rig.mount import Matrix3, Mount
from stepload.rig.world import DEFAULT_SPEC, WorldSpec
from stepload_drivers.sim.six_plant import SixPlant
from stepload_drivers.sim.springs import times

SURFACE_M = 1e-4


def springs(stiffness: float, across: float = 1.0, x: float = 0.0, y: float = 0.0) -> Matrix3:
    """Compliance of a tip: 1/K_s along, `across` times that across, couplings x and y over it."""
    c = 1.0 / stiffness
    return (across * c, 0.0, x * c), (0.0, across * c, y * c), (x * c, y * c, c)


def rig(
    stiffness: float = 9e4, k: float = 8e6, n: float = 1.5, payload: Any = (), **truth: Any
) -> WorldSpec:
    """A quick, noiseless arm of 8 kg above a smooth payload."""
    payload = replace(DEFAULT_SPEC.payload, k=k, n=n, **dict(payload))
    spec = replace(
        DEFAULT_SPEC,
        payload=payload,
        surface_m=SURFACE_M,
        system_stiffness_n_per_m=stiffness,
        system_damping_n_s_per_m=0.3 * (stiffness * 8.0) ** 0.5,
        effective_mass_kg=8.0,
        command_delay_s=0.0,
        lag_s=0.0,
        max_acceleration_m_s2=1e6,
        max_push_n=1e6,
    )
    return replace(spec, **truth)


def plant(spec: WorldSpec, mount: Mount, **refine: float) -> SixPlant:
    return SixPlant(spec, mount, step_s=1e-3, **refine)


def tip_shift_m(six: SixPlant) -> tuple[float, float]:
    """How far the tip is across the press from where it began."""
    x_m, y_m, _ = times(six.to_press, six.tip.at)
    return x_m, y_m


def rub(
    static: float, kinetic: float | None = None, *, x: float = 0.0, y: float = 0.0, **more: Any
) -> Mount:
    """An arm of 9e4 N/m with friction and coupling."""
    held = {"compliance_m_per_n": springs(9e4, 0.8, x, y)} | more
    return Mount(
        friction_static=static, friction_kinetic=static if kinetic is None else kinetic, **held
    )


def go(six: SixPlant, to_m: float, seconds: float = 1.0, *, settle_s: float = 0.5) -> None:
    """Ramp the drive along the press, then wait."""
    steps, begin_m = round(seconds * 1000), six.drive_m
    for i in range(1, steps + 1):
        six.command(six.time_s, begin_m + (to_m - begin_m) * i / steps)
        six.step()
    wait(six, settle_s)


def shift(six: SixPlant, x_m: float, y_m: float = 0.0, seconds: float = 1.0) -> None:
    """Ramp the drives across the press, then wait."""
    steps, begin = round(seconds * 1000), six.shift_m
    for i in range(1, steps + 1):
        x, y = (a + (b - a) * i / steps for a, b in zip(begin, (x_m, y_m), strict=True))
        six.command_shift(six.time_s, x, y)
        six.step()
    wait(six, 0.5)


def wait(six: SixPlant, seconds: float) -> None:
    for _ in range(round(seconds * 1000)):
        six.step()
