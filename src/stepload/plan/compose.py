"""A rig made of parts: a rig profile, data sheets of force sensors, and the plan's own keys.

A data sheet describes a sensor (`rig.force.profile`), not its mounting: `axis` and the address
among the driver's options stand in the rig. A device named in place of another one inherits nothing
of that one, nor do values of the rig that were stated for it remain.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

from stepload.declaration.sections import keys as keys_of
from stepload.errors import printable
from stepload.plan.problems import Problem
from stepload.plan.rig import ArmSpec, DisplacementSpec, ForceSpec
from stepload.plan.tree import Mapping, Node, Place, Scalar, locate

SIMULATED = "sim"
"""The driver that simulates any declared device; it leaves the declaration unchanged."""


def overlay(base: Mapping, over: Mapping) -> Mapping:
    """`base` with the keys of `over`, mapping by mapping; every key keeps its own place.

    Two exceptions keep numbers that belong together from being mixed: of a device nothing is left
    where `over` names another one, and a `system_stiffness` with a `value` replaces the whole old
    one.
    """
    if is_another(base, over):
        return over
    if text(over, "driver") not in (None, text(base, "driver")):  # simulated: has its own options
        base = _without(base, "options")
    entries = {**base.entries, **over.entries}
    for key, node in over.entries.items():
        old = base.entries.get(key)
        if isinstance(old, Mapping) and isinstance(node, Mapping):
            whole = key == "system_stiffness" and "value" in node.entries
            entries[key] = node if whole else overlay(old, node)
    return Mapping(over.place, entries, base.keys | over.keys)


def is_another(base: Node | None, over: Node | None) -> bool:
    """Whether `over` names another driver or another data sheet than the device in `base`."""
    if not (isinstance(base, Mapping) and isinstance(over, Mapping) and "driver" in base.entries):
        return False
    sheet, driver = text(over, "profile"), text(over, "driver")
    return sheet not in (None, text(base, "profile")) or driver not in (
        None, text(base, "driver"), SIMULATED,
    )  # fmt: skip


def text(node: Node | None, key: str) -> object:
    """The value of a scalar entry; None where there is none."""
    entry = at(node, (key,))
    return entry.value if isinstance(entry, Scalar) else None


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
                keys = {**base.keys, "profile": sensor.keys["profile"]}
                base = Mapping(base.place, {**base.entries, "profile": name}, keys)
                if is_another(base, sensor):
                    driver = printable(str(text(base, "driver")))
                    message = f"this data sheet is of the driver {driver}"
                    problems.append(name.place.problem(message, "leave `driver` or `profile` out"))
                base = overlay(base, sensor)
            rig = replaced(rig, path, base)
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
        if not isinstance(device, Mapping) or not is_another(old, at(own, path)):
            continue
        called = ".".join(path)
        if any(key.required and key.name not in device.entries for key in keys_of(kind)):
            sheet = f", or name a data sheet, profile: {known}" if kind is ForceSpec else ""
            yield _place(rig, path).problem(
                f"{called}: this is another device than that of the profile {name}, "
                f"{_shown(old)}: nothing is taken of that one",
                f"write every key of {called} here{sheet}",
            )
    other = "arm" if is_another(at(profile, ("arm",)), at(own, ("arm",))) else "force"
    shown = "arm" if other == "arm" else "force sensor"
    for key, hint in _OF_THE_WHOLE.items():
        if at(profile, (key,)) is not None and at(rig, (key,)) is None:
            message = f"{key} of the profile {name} does not hold with another {shown}"
            yield _place(rig, (other,)).problem(message, hint)


_OF_THE_WHOLE = {
    "system_stiffness": "give value and sigma, provenance: indicative until it is measured, "
    "or the record of `stepload calibrate`",
    "second_force": "say what checks the force sensor: source, tolerance, noise",
}
"""Values of a rig that do not hold with another arm or sensor, and what to write then."""


def at(node: Node | None, path: Iterable[str]) -> Node | None:
    """The node at a path of keys; None where there is none."""
    for key in path:
        node = node.entries.get(key) if isinstance(node, Mapping) else None
    return node


def _place(rig: Node, path: tuple[str, ...]) -> Place:
    """Where the key at the end of a path stands, that of a mapping."""
    return locate(rig, path, rig.place)


def replaced(rig: Mapping, path: tuple[str, ...], node: Node) -> Mapping:
    """A copy of a tree with another node at a path that it has."""
    key, rest = path[0], path[1:]
    inner = rig.entries[key]
    if rest and isinstance(inner, Mapping):
        node = replaced(inner, rest, node)
    return Mapping(rig.place, {**rig.entries, key: node}, rig.keys)


def _without(rig: Mapping, *keys: str) -> Mapping:
    kept = {key: node for key, node in rig.entries.items() if key not in keys}
    return Mapping(rig.place, kept, rig.keys)


def _indicative(profile: Mapping) -> bool:
    """Whether its stiffness is a figure of its class only, which no sensor changes."""
    return text(at(profile, ("system_stiffness",)), "provenance") == "indicative"


def _shown(device: Node | None) -> str:
    """A device by its data sheet, or by its driver."""
    name = text(device, "profile") or text(device, "driver")
    return "simulated one" if name == SIMULATED else printable(str(name))
