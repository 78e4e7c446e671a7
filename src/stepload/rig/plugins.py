"""Finds drivers by entry point; knows none of them by name."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, EntryPoints, entry_points
from typing import Any, cast

from stepload.errors import BadInputError
from stepload.rig.device import Arm, Device, DisplacementSensor, ForceSensor, NoOptions

GROUPS: dict[str, type[Device]] = {
    "stepload.arms": Arm,
    "stepload.force_sensors": ForceSensor,
    "stepload.displacement_sensors": DisplacementSensor,
}
WORLDS = "stepload.worlds"
"""The group of simulated rigs: `stepload.rig.world`."""


@dataclass(frozen=True, slots=True)
class Listed:
    """One installed driver or world, or the reason why it cannot be used."""

    group: str
    name: str
    distribution: str
    version: str
    problem: str


@cache
def _all_installed() -> Any:  # another class in Python 3.11 than later
    """What the installed packages offer; they are looked through once in a process."""
    return entry_points()


def installed(group: str) -> EntryPoints:
    """What they offer in one group."""
    found: EntryPoints = _all_installed().select(group=group)
    return found


def _load(group: str, point: EntryPoint) -> Any:
    loaded = point.load()
    if group == WORLDS:
        if not callable(loaded):
            raise TypeError(f"{point.value} cannot be called with a WorldSpec")
        return loaded
    kind = GROUPS[group]
    if not (inspect.isclass(loaded) and issubclass(loaded, kind)):
        raise TypeError(f"{point.value} is not a subclass of stepload.rig.device.{kind.__name__}")
    if missing := sorted(getattr(loaded, "__abstractmethods__", ())):
        raise TypeError(f"{point.value} does not implement {', '.join(missing)}")
    return loaded


def list_drivers() -> list[Listed]:
    """Every installed driver and world, broken ones with the reason. Touches no device."""
    found = []
    for group in (*GROUPS, WORLDS):
        for point in sorted(installed(group), key=lambda p: p.name):
            problem = ""
            try:
                _load(group, point)
            except Exception as error:  # a lab's broken package must not break the list
                problem = f"{type(error).__name__}: {error}"
            package, version = (point.dist.name, point.dist.version) if point.dist else ("", "")
            found.append(Listed(group, point.name, package, version, problem))
    return found


def driver_names(group: str) -> list[str]:
    """Names installed in `group`, without loading anything."""
    return sorted(point.name for point in installed(group))


def load_arm(name: str) -> type[Arm]:
    """The arm's driver class called `name`; raises as `load_driver`."""
    return cast(type[Arm], load_driver("stepload.arms", name))


def load_driver(group: str, name: str) -> type[Device]:
    """The driver class called `name`; raises as `load_plugin`."""
    return cast(type[Device], load_plugin(group, name))


def load_plugin(group: str, name: str) -> Any:
    """The driver class, or the world, called `name`.

    Raises:
        BadInputError: not installed, or broken, with the reason.
    """
    points = list(installed(group).select(name=name))
    noun = "world" if group == WORLDS else "driver"
    kind = "" if group == WORLDS else f" for {GROUPS[group].__name__}"
    if not points:
        names = ", ".join(driver_names(group)) or "none"
        raise BadInputError(f"no {noun} named {name!r}{kind}", hint=f"installed: {names}")
    try:
        return _load(group, points[0])
    except Exception as error:
        raise BadInputError(
            f"{noun} {name!r}{kind} cannot be used: {type(error).__name__}: {error}",
            hint="see `stepload drivers`",
        ) from error


def options_of(group: str, name: str) -> type:
    """What the driver or world called `name` declares as its options; raises as `load_plugin`."""
    declared: type = getattr(load_plugin(group, name), "OPTIONS", NoOptions)
    return declared
