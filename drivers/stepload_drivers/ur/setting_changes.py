"""Settings of the controller that a run relies on: required values, and check for changes.

Only reported settings can be compared: speed slider, payload mass, its centre of gravity and TCP,
each if the controller reports it. Mounting, safety limits and the rest of the installation are not
reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from stepload.rig.device import ArmConfiguration
from stepload.rig.faults import FaultCode
from stepload.units import percent
from stepload_drivers.ur.settings import Settings
from stepload_drivers.ur.state import Problem

SAME_SLIDER = 0.005
SAME_KG = 1e-3
SAME_M = 1e-5
SAME_RAD = 1e-5

_SLIDER_HINT = (
    "set the speed slider at the foot of the pendant's Run screen to 100 % (in local control), "
    "switch to remote control again and start anew"
)
_SETTING_HINT = (
    "find out who changed it (pendant, another program); put it right in the pendant's "
    "installation, or give tcp_offset, payload_mass and payload_cog, and start anew"
)


def slow_problem(configuration: ArmConfiguration) -> Problem | None:
    """Why the arm would lag behind every target: the speed slider is not at 100 %."""
    fraction = configuration.speed_fraction
    if fraction is None or fraction >= 1.0 - SAME_SLIDER:
        return None
    return Problem(
        FaultCode.UNSUPPORTED,
        f"the speed slider is at {percent(fraction, 2)}, 100 % is needed: the arm would lag",
        _SLIDER_HINT,
    )


def expected(settings: Settings, told: ArmConfiguration) -> ArmConfiguration:
    """Required settings: those set through the options, otherwise as reported at arming.

    Settings that are not reported stay None. The slider must be at 100 %.
    """
    tcp, cog, mass = told.tcp_offset, told.payload_cog_m, told.payload_kg
    if tcp is not None and settings.tcp_offset_m is not None:
        tcp = (*settings.tcp_offset_m, 0.0, 0.0, 0.0)
    if settings.payload_mass_kg is not None:
        mass = None if mass is None else settings.payload_mass_kg
        cog = None if cog is None else settings.payload_cog_m
    slider = None if told.speed_fraction is None else 1.0
    return replace(told, tcp_offset=tcp, payload_kg=mass, payload_cog_m=cog, speed_fraction=slider)


def change(armed: ArmConfiguration, told: ArmConfiguration) -> Problem | None:
    """Every setting that has changed since arming, with both values; None: none has."""
    changes = list(_changes(armed, told))
    if not changes:
        return None
    only_slider = all(text.startswith("speed slider") for text in changes)
    return Problem(
        FaultCode.SETTING_CHANGED,
        f"changed since the arm was opened: {'; '.join(changes)}",
        _SLIDER_HINT if only_slider else _SETTING_HINT,
    )


def tcp_changed(armed: ArmConfiguration | None, told: ArmConfiguration | None) -> bool:
    """Whether a pose refers to another point of the arm than at arming, as far as reported."""
    if armed is None or told is None or armed.tcp_offset is None or told.tcp_offset is None:
        return False
    before, now = armed.tcp_offset, told.tcp_offset
    return _far(before[:3], now[:3], SAME_M) or _far(before[3:], now[3:], SAME_RAD)


def _changes(armed: ArmConfiguration, told: ArmConfiguration) -> Iterator[str]:
    slider, slider_now = armed.speed_fraction, told.speed_fraction
    if slider is not None and slider_now is not None and abs(slider_now - slider) > SAME_SLIDER:
        yield f"speed slider from {percent(slider, 2)} to {percent(slider_now, 2)}"
    mass, mass_now = armed.payload_kg, told.payload_kg
    if mass is not None and mass_now is not None and abs(mass_now - mass) > SAME_KG:
        yield f"payload mass from {mass:.3f} kg to {mass_now:.3f} kg"
    cog, cog_now = armed.payload_cog_m, told.payload_cog_m
    if cog is not None and cog_now is not None and _far(cog, cog_now, SAME_M):
        yield f"payload centre of gravity from {_mm(cog)} to {_mm(cog_now)}"
    tcp, tcp_now = armed.tcp_offset, told.tcp_offset
    if tcp is not None and tcp_now is not None and tcp_changed(armed, told):
        yield f"TCP from {_tcp(tcp)} to {_tcp(tcp_now)}"


def _far(before: tuple[float, ...], now: tuple[float, ...], limit: float) -> bool:
    return any(abs(a - b) > limit for a, b in zip(before, now, strict=True))


def _mm(vector_m: tuple[float, ...]) -> str:
    return f"({', '.join(f'{component * 1e3:g}' for component in vector_m)}) mm"


def _tcp(offset: tuple[float, ...]) -> str:
    rotation = ", ".join(f"{component:g}" for component in offset[3:])
    return f"{_mm(offset[:3])}, rotation ({rotation}) rad"
