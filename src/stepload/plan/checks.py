"""What cannot be, although every key by itself is sound."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import PurePath
from typing import NamedTuple

from stepload.contact.limit import no_limit_reason
from stepload.errors import DomainError
from stepload.plan.derived import MAX_LEVELS, number
from stepload.plan.model import Payload
from stepload.plan.validate import Values
from stepload.units import format_quantity

MAX_RUN_S = 86_400.0
"""Longest run, in s: holds, tares and cycles added up."""


class Finding(NamedTuple):
    """Something impossible at `path`, a chain of keys from the checked mapping down."""

    path: tuple[str, ...]
    message: str
    hint: str


def _newton(force: float) -> str:
    return format_quantity(force, "N", digits=6)


def _metre(length: float) -> str:
    return format_quantity(length, "m", digits=6)


def check_material(values: Values, body: str) -> Iterator[Finding]:
    modulus, strength = (
        number(values, body, "youngs_modulus"),
        number(values, body, "yield_strength"),
    )
    if modulus is not None and strength is not None and strength >= modulus:
        yield Finding(
            (body, "yield_strength"),
            f"yield strength {format_quantity(strength, 'Pa')} is not below Young's modulus "
            f"{format_quantity(modulus, 'Pa')}",
            "look for a wrong prefix (MPa, GPa) in one of the two",
        )


def check_payload(values: Values, payload: Payload | None) -> Iterator[Finding]:
    """Impossibilities of a payload; `payload` is None where a key of it is bad."""
    yield from check_material(values, "material")
    yield from check_material(values, "plate")
    radius, roughness = number(values, "geometry", "radius"), number(values, "roughness")
    if radius is not None and roughness is not None and roughness >= radius:
        yield Finding(
            ("roughness",),
            f"roughness {_metre(roughness)} is not below the radius {_metre(radius)}",
            "roughness is an rms height, some micrometres for machined parts",
        )
    if values.get("micro_hardness") is not None and "roughness" in values and roughness is None:
        yield Finding(
            ("micro_hardness",),
            "micro-hardness without roughness has no effect",
            "give `roughness` too, or leave both out",
        )
    if payload is None or payload.declared_force_limit_n is not None:
        return
    try:
        reason = no_limit_reason(payload.geometry, payload.material, payload.plate)
    except DomainError as error:
        yield Finding(("geometry",), error.message, error.hint)
        return
    if reason:
        yield Finding(
            (), f"missing key 'force_limit': {reason}",
            "declare the force that must not be exceeded, for example force_limit: 400 N",
        )  # fmt: skip


def check_rig(values: Values) -> Iterator[Finding]:
    """Impossibilities of a rig."""
    second = values.get("second_force", {})
    if "source" in second and "sensor" in second:
        if second["source"] == "sensor" and second["sensor"] is None:
            yield Finding(
                ("second_force",), "source is sensor, but there is no `sensor`", "describe it there"
            )
        elif second["source"] != "sensor" and second["sensor"] is not None:
            yield Finding(
                ("second_force", "sensor"), f"a sensor, but source is {second['source']}",
                "write source: sensor, or remove it",
            )  # fmt: skip
        elif second["source"] != "none" and second.get("tolerance") == 0.0:
            yield Finding(
                ("second_force", "tolerance") if second["tolerance"] == 0.0 else ("second_force",),
                "a second channel with a tolerance of 0 N would stop every run",
                "give the difference that its noise and gain error explain",
            )
    for path in (("force",), ("second_force", "sensor")):
        rated = number(values, *path, "range")
        for key in ("resolution", "noise"):
            part = number(values, *path, key)
            if rated is not None and part is not None and part >= 0.1 * rated:
                yield Finding(
                    (*path, key),
                    f"{key} {_newton(part)} is more than a tenth of the range {_newton(rated)}",
                    "such a sensor cannot measure",
                )
    stiffness = number(values, "system_stiffness", "value")
    sigma = number(values, "system_stiffness", "sigma")
    if stiffness is not None and sigma is not None and sigma >= stiffness:
        yield Finding(
            ("system_stiffness", "sigma"),
            f"uncertainty {format_quantity(sigma, 'N/m')} is not below the stiffness "
            f"{format_quantity(stiffness, 'N/m')}",
            "a stiffness known so badly is not known: calibrate it",
        )
    yield from _check_stiffness(values.get("system_stiffness", {}))


def _check_stiffness(values: Values) -> Iterator[Finding]:
    if {"value", "sigma", "record"} <= values.keys():
        value, sigma = values["value"], values["sigma"]
        if value is None and values["record"] is None:
            yield Finding(
                ("system_stiffness",), "neither `value` nor `record`",
                "give value and sigma, or the record of a calibration",
            )  # fmt: skip
        elif (value is None) != (sigma is None):
            yield Finding(
                ("system_stiffness",), "`value` and `sigma` belong together",
                "a stiffness without its uncertainty cannot be compensated",
            )  # fmt: skip
    first, last = values.get("measured_on"), values.get("valid_until")
    if first and last and last < first:
        yield Finding(
            ("system_stiffness", "valid_until"), f"{last} is before measured_on {first}",
            "check the two dates",
        )  # fmt: skip


def check_levels(values: Values) -> Iterator[Finding]:
    """Impossibilities of the load levels."""
    top, step = number(values, "top_force"), number(values, "step")
    if not {"step", "levels"} <= values.keys():
        return
    levels = values["levels"]
    if step is None and levels is None:
        yield Finding((), "missing key 'step'", "give the load step, or every level in `levels`")
    elif step is not None and levels is not None:
        yield Finding(("levels",), "both `step` and `levels`", "give one of the two")
    elif levels is not None:
        pairs = list(pairwise(levels))
        if not levels or len(levels) > MAX_LEVELS:
            yield Finding(
                ("levels",), f"{len(levels)} levels", f"expected 1 to {MAX_LEVELS} levels"
            )
        elif bad := next((pair for pair in pairs if pair[1] <= pair[0]), None):
            yield Finding(
                ("levels",), f"{_newton(bad[1])} after {_newton(bad[0])}", "levels must rise"
            )
        elif top is not None and levels[-1] != top:
            yield Finding(
                ("levels",),
                f"the last level {_newton(levels[-1])} is not the top force {_newton(top)}",
                "end the levels with top_force",
            )
    elif step is not None and top is not None and step > top:
        yield Finding(
            ("top_force",), f"top force {_newton(top)} is below one step of {_newton(step)}",
            "raise top_force or lower step",
        )  # fmt: skip
    elif step is not None and top is not None and top / step > MAX_LEVELS:
        yield Finding(
            ("step",), f"{top / step:.0f} load levels", f"at most {MAX_LEVELS}: use a larger step"
        )


def check_travel(values: Values) -> Iterator[Finding]:
    """Impossibilities of the search for the surface."""
    distance, uncertainty = (
        number(values, "surface_distance"),
        number(values, "surface_uncertainty"),
    )
    search = number(values, "search_distance")
    if distance is not None and uncertainty is not None and uncertainty > distance:
        yield Finding(
            ("surface_uncertainty",),
            f"{_metre(uncertainty)} is more than the surface_distance {_metre(distance)}: the "
            "payload might touch already at the start",
            "start farther away, or measure the distance better",
        )
    if search is not None and uncertainty is not None and search < 2.0 * uncertainty:
        yield Finding(
            ("search_distance",),
            f"the search ends after {_metre(search)}, within the uncertain band of "
            f"2 x {_metre(uncertainty)}",
            f"search at least {_metre(2.0 * uncertainty)}",
        )


def check_procedure(given: Values) -> Iterator[Finding]:
    """Impossibilities of a procedure, from the values as given."""
    yield from check_levels(given)
    yield from check_travel(given)


def check_whole(values: Values, travel_m: float | None) -> Iterator[Finding]:
    """Impossibilities between sections, defaults filled in; `travel_m` is the elastic travel."""
    procedure = values.get("procedure", {})
    top, touch = number(procedure, "top_force"), number(procedure, "touch_force")
    levels = procedure.get("levels")
    noise = number(values, "rig", "force", "noise")
    if touch is not None and levels and touch >= levels[0]:
        yield Finding(
            ("procedure", "touch_force"),
            f"contact threshold {_newton(touch)} is not below the first level {_newton(levels[0])}",
            "lower touch_force, or begin with a higher level",
        )
    elif touch is not None and noise is not None and touch < 4.0 * noise:
        yield Finding(
            ("procedure", "touch_force"),
            f"contact threshold {_newton(touch)} is within 4 sigma of the noise {_newton(noise)}",
            f"use at least {_newton(6.0 * noise)}",
        )
    retract = number(procedure, "retract")
    if retract is not None and travel_m is not None and retract <= travel_m:
        yield Finding(
            ("procedure", "retract"),
            f"a retract of {_metre(retract)} does not part the contact: arm and payload give way "
            f"by {_metre(travel_m)} at the top force",
            f"retract at least {format_quantity(2.0 * travel_m, 'm', digits=2)}",
        )
    fuse = number(values, "rig", "mechanical_fuse")
    if fuse is not None and top is not None and fuse <= top:
        yield Finding(
            ("procedure", "top_force"),
            f"the mechanical fuse opens at {_newton(fuse)}, before the top force {_newton(top)}",
            "lower top_force or use a stronger fuse",
        )
    secant = number(values, "identify", "secant_force")
    if secant is not None and top is not None and secant > top:
        yield Finding(
            ("identify", "secant_force"),
            f"the secant at {_newton(secant)} is beyond the top force {_newton(top)}",
            "the law is not extrapolated: use a force the run reaches",
        )
    yield from _check_duration(procedure)
    directory = values.get("record", {}).get("directory")
    if directory is not None and ".." in PurePath(directory).parts:
        yield Finding(
            ("record", "directory"), "a directory with `..` in it",
            "name it from the working directory down, or absolutely",
        )  # fmt: skip


def _check_duration(procedure: Values) -> Iterator[Finding]:
    levels, hold, cycles = (procedure.get(key) for key in ("levels", "hold", "cycles"))
    if levels and hold is not None and cycles is not None:
        holds = len(levels) * cycles * (2 if procedure.get("unload") else 1)
        if holds * hold > MAX_RUN_S:
            yield Finding(
                ("procedure", "hold"),
                f"{holds} holds of {hold:g} s last {holds * hold / 3600.0:.1f} h",
                f"a run lasts at most {MAX_RUN_S / 3600.0:g} h: shorten hold or cycles",
            )
