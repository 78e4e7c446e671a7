"""A rig profile with a plan's own keys laid over it; every key keeps its own place."""

from __future__ import annotations

from stepload.plan.tree import Mapping, Node, Scalar


def overlay(base: Mapping, over: Mapping) -> Mapping:
    """`base` with the keys of `over`, mapping by mapping.

    Two exceptions keep numbers that belong together from being mixed: another `driver` drops the
    options of the old one, and a `system_stiffness` with a `value` replaces the whole old one.
    """
    merged = Mapping(over.place, dict(base.entries), dict(base.keys))
    if _text(over.entries.get("driver")) not in (None, _text(base.entries.get("driver"))):
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


def _text(node: Node | None) -> object:
    return node.value if isinstance(node, Scalar) else None
