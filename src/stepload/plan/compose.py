"""A rig made of parts: a rig profile, data sheets of force sensors, and the plan's own keys.

A data sheet describes a sensor (`rig.force.profile`), not its mounting: `axis` and the address
among the driver's options stand in the rig. A device named in place of another one inherits nothing
of that one, nor do values of the rig that were stated for it remain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from stepload.declaration.sections import keys as keys_of
from stepload.errors import printable
from stepload.plan.overlay import SIMULATED, is_another, overlay, text
from stepload.plan.problems import Problem
from stepload.plan.rig import ArmSpec, DisplacementSpec, ForceSpec
from stepload.plan.tree import Mapping, Node, Place

_SENSORS = (("force",), ("second_force", "sensor"))
_DEVICES = {
    ("arm",): ArmSpec,
    ("force",): ForceSpec,
    ("second_force", "sensor"): ForceSpec,
    ("displacement",): DisplacementSpec,
}

Sheet = Callable[[Node], Node]
"""Returns the data sheet that a node names; Broken, and reported, where there is none."""


def with_data_sheets(rig: Mapping, sheet: Sheet, problems: list[Problem]) -> Mapping:
    """`rig` with every data sheet that its sensors name laid under their own keys."""
    for path in _SENSORS:
        sensor = at(rig, path)
        if isinstance(sensor, Mapping) and (name := sensor.entries.get("profile")):
            base: Node = sheet(name)
            if isinstance(base, Mapping):
                entries, keys = {**base.entries, "profile": name}, {**base.keys}
                keys["profile"] = sensor.keys["profile"]
                base = Mapping(base.place, entries, keys)
                if is_another(base, sensor):
                    message = (
                        f"this data sheet is of the driver {printable(str(text(base, 'driver')))}"
                    )
                    problems.append(name.place.problem(message, "leave `driver` or `profile` out"))
                base = overlay(base, sensor)
            rig = _with(rig, path, base)
    return rig


def composed(profile: Mapping, rig: Mapping) -> Mapping:
    """The rig profile with `rig`, data sheets in both laid under already, laid over it."""
    base = profile
    if is_another(at(profile, ("arm",)), at(rig, ("arm",))):
        base = _without(base, "system_stiffness", "second_force")
    elif is_another(at(profile, ("force",)), at(rig, ("force",))) and not _indicative(profile):
        base = _without(base, "system_stiffness")
    return overlay(base, rig)


def problems_of(rig: Node, own: Mapping, profile: Mapping | None, known: str) -> Iterator[Problem]:
    """Problems of a composed rig that explain why keys are missing; reported beside these.

    Args:
        own: the rig before the profile was laid under it.
        profile: the rig profile; None where none is named.
        known: the data sheets there are, for the hint.
    """
    name = text(own, "profile")
    for path, kind in _DEVICES.items():
        device, old = at(rig, path), at(profile, path)
        if not isinstance(device, Mapping):
            continue
        place, called = _key(rig, path), ".".join(path)
        lacks = any(key.required and key.name not in device.entries for key in keys_of(kind))
        if lacks and is_another(old, at(own, path)):
            sheet = f", or name a data sheet, profile: {known}" if kind is ForceSpec else ""
            yield place.problem(
                f"{called}: this is another device than that of the profile {name}, "
                f"{_shown(old)}: nothing is taken of that one",
                f"write every key of {called} here{sheet}",
            )
    yield from _of_the_whole(rig, own, profile, str(name))


def _of_the_whole(rig: Node, own: Mapping, profile: Mapping | None, name: str) -> Iterator[Problem]:
    """Values of the rig as a whole that do not hold with another arm or sensor."""
    device = "arm" if is_another(at(profile, ("arm",)), at(own, ("arm",))) else "force"
    shown = "arm" if device == "arm" else "force sensor"
    hints = {
        "system_stiffness": "give value and sigma, provenance: indicative until it is measured, "
        "or the record of `stepload calibrate`",
        "second_force": "say what checks the force sensor: source, tolerance, noise",
    }
    for key, hint in hints.items():
        if at(profile, (key,)) is not None and at(rig, (key,)) is None:
            yield _key(rig, (device,)).problem(
                f"{key} of the profile {name} does not hold with another {shown}", hint
            )


def at(rig: Node | None, path: tuple[str, ...]) -> Node | None:
    """The node at a path of keys; None where there is none."""
    for key in path:
        rig = rig.entries.get(key) if isinstance(rig, Mapping) else None
    return rig


def _key(rig: Node, path: tuple[str, ...]) -> Place:
    """Where the key at the end of a path stands."""
    parent = at(rig, path[:-1])
    return parent.keys[path[-1]] if isinstance(parent, Mapping) else rig.place


def _with(rig: Mapping, path: tuple[str, ...], node: Node) -> Mapping:
    """A copy of `rig` with another node at a path that it has."""
    key, rest = path[0], path[1:]
    inner = rig.entries[key]
    if rest:
        assert isinstance(inner, Mapping)
        node = _with(inner, rest, node)
    return Mapping(rig.place, {**rig.entries, key: node}, dict(rig.keys))


def _without(rig: Mapping, *keys: str) -> Mapping:
    kept = {key: node for key, node in rig.entries.items() if key not in keys}
    return Mapping(rig.place, kept, {key: rig.keys[key] for key in kept})


def _indicative(profile: Mapping) -> bool:
    """Whether its stiffness is a figure of its class only, which no sensor changes."""
    stiffness = at(profile, ("system_stiffness",))
    return isinstance(stiffness, Mapping) and text(stiffness, "provenance") == "indicative"


def _shown(device: Node | None) -> str:
    """A device by its data sheet, or by its driver."""
    name: object = None
    if isinstance(device, Mapping):
        name = text(device, "profile") or text(device, "driver")
    return "simulated one" if name == SIMULATED else printable(str(name))
