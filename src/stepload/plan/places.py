"""Where a key of a plan stands, as FILE:LINE:COLUMN."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from stepload.plan.model import Plan
from stepload.plan.problems import PlanError
from stepload.plan.references import names_a_file
from stepload.plan.source import read_source
from stepload.plan.tree import Mapping, Node, Place, Scalar, parse_tree


def tree_of(path: Path) -> Node | None:
    """The nodes of a plan file; None where it cannot be read."""
    with suppress(PlanError):
        return parse_tree(read_source(path))[0]
    return None


def place_of(plan: Plan, key: str) -> Place | None:
    """The place of a key such as `procedure.top_force`, or of the last part of it that is written.

    None where nothing of it is written, or the plan has no file.
    """
    home, found = plan.path, None
    node = tree_of(home)
    for name in key.split(".") if key else ():
        if isinstance(node, Scalar) and isinstance(node.value, str) and names_a_file(node.value):
            home = home.parent / node.value
            node = tree_of(home)
        if not isinstance(node, Mapping) or name not in node.entries:
            break
        found = node.keys[name]
        node = node.entries[name]
        if not isinstance(node, Mapping):
            found = node.place
    return found
