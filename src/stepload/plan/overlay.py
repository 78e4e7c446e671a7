"""A rig profile with a plan's own keys laid over it; every key keeps its own place."""

from __future__ import annotations

from stepload.plan.tree import Mapping, Node, Scalar

SIMULATED = "sim"
"""The driver that simulates any declared device; it leaves the declaration unchanged."""


def overlay(base: Mapping, over: Mapping) -> Mapping:
    """`base` with the keys of `over`, mapping by mapping.

    Two exceptions keep numbers that belong together from being mixed: of a device nothing is left
    where `over` names another one, and a `system_stiffness` with a `value` replaces the whole old
    one.
    """
    if is_another(base, over):
        return over
    merged = Mapping(over.place, dict(base.entries), dict(base.keys))
    if text(over, "driver") not in (None, text(base, "driver")):  # simulated: has its own options
        merged.entries.pop("options", None)
        merged.keys.pop("options", None)
    for key, node in over.entries.items():
        old = merged.entries.get(key)
        both = isinstance(old, Mapping) and isinstance(node, Mapping)
        whole = key == "system_stiffness" and isinstance(node, Mapping) and "value" in node.entries
        if both and not whole:
            assert isinstance(old, Mapping)
            assert isinstance(node, Mapping)
            node = overlay(old, node)
        merged.entries[key] = node
        merged.keys[key] = over.keys[key]
    return merged


def is_another(base: Node | None, over: Node | None) -> bool:
    """Whether `over` names another driver or another data sheet than the device in `base`."""
    if not (isinstance(base, Mapping) and isinstance(over, Mapping) and "driver" in base.entries):
        return False
    sheet, driver = text(over, "profile"), text(over, "driver")
    return sheet not in (None, text(base, "profile")) or driver not in (
        None, text(base, "driver"), SIMULATED,
    )  # fmt: skip


def text(mapping: Mapping, key: str) -> object:
    """The value of a scalar entry; None where there is none."""
    node = mapping.entries.get(key)
    return node.value if isinstance(node, Scalar) else None
