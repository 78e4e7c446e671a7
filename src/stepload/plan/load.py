"""YAML text → `Plan`, or a `PlanError` with every problem at its line and column."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from datetime import date
from operator import attrgetter
from pathlib import Path

from stepload.declaration.sections import UNKNOWN, UnknownError, put
from stepload.plan.checks import impossibilities, underivable
from stepload.plan.checks_between import impossibilities_between
from stepload.plan.compose import at
from stepload.plan.derived import fill
from stepload.plan.driver_options import read_options
from stepload.plan.impossible import Impossibility
from stepload.plan.kinematics import settle_kinematics
from stepload.plan.model import Payload, Plan, SourceFile
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import read_section
from stepload.plan.references import References, profiles
from stepload.plan.rig import DeviceSpec
from stepload.plan.schema import json_schema
from stepload.plan.shelf import Disk, Kept, Shelf
from stepload.plan.source import Source
from stepload.plan.stiffness import settle_stiffness
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar

__all__ = ["json_schema", "load_payload", "load_plan", "profiles"]

_DEVICES = {
    "arm": "stepload.arms",
    "force": "stepload.force_sensors",
    "displacement": "stepload.displacement_sensors",
    "second_force.sensor": "stepload.force_sensors",
}


def load_plan(path: Path, *, payload: Path | None = None, today: date | None = None) -> Plan:
    """Read and check the plan in `path`; nothing in it is executed.

    Args:
        payload: a payload file to use instead of the plan's own payload.
        today: day against which calibration records are checked; None: today.

    Raises:
        PlanError: every problem found, with file, line and column.
    """
    return _Loader(Disk()).plan(Path(path), payload, today or date.today())


def load_kept(
    texts: Sequence[tuple[str, bytes]], name: str, day: date, *, payload: str = ""
) -> Plan:
    """The plan `name` of a record from the texts it has kept, as it was on the day of the run.

    Args:
        texts: name in the record and bytes, the plan itself first, in the order they were kept.
        payload: the payload file that the run was given in place of the plan's own, "" for none.

    Raises:
        PlanError: the texts are not those of a plan, or name a driver that is not installed here.
    """
    instead = Path(payload) if payload else None
    return _Loader(Kept(texts)).plan(Path(f"{name}.yaml"), instead, day)


def load_payload(path: Path) -> Payload:
    """Read and check a payload file.

    Raises:
        PlanError: every problem found, with file, line and column.
    """
    loader = _Loader(Disk())
    source = loader.shelf.file(Path(path))
    root = loader.references.parse(source)
    _refuse_whole_plan(root)
    payload = read_section(Payload, root, Place(source, 1, 1), loader.problems)
    loader.report(root, impossibilities(payload))
    loader.raise_problems()
    return payload


class _Loader:
    def __init__(self, shelf: Shelf) -> None:
        self.shelf = shelf
        self.problems: list[Problem] = []
        self.missing: list[Problem] = []
        self.sources: list[Source] = []
        self.references = References(shelf, self.sources, self.problems)

    def raise_problems(self) -> None:
        if not self.problems:
            return
        order = {source.name: index for index, source in enumerate(self.sources)}
        unique = dict.fromkeys(self.problems)
        raise PlanError(
            tuple(sorted(unique, key=lambda p: (order.get(p.file, len(order)), p.line, p.column)))
        )

    def plan(self, path: Path, payload: Path | None, today: date) -> Plan:
        source = self.shelf.file(path)
        parsed = self.references.parse(source)
        _refuse_no_plan(parsed)
        root = self._resolved(parsed, payload)
        if isinstance(self.shelf, Kept):
            root = _without_empty(root)
        plan = read_section(Plan, root, Place(source, 1, 1), self.problems)
        put(plan, "path", path)
        put(plan, "payload_file", payload)
        self.report(root, impossibilities(plan))
        with suppress(UnknownError):
            at = _place(root, ("rig", "system_stiffness", "record"))
            settle_stiffness(plan, at, today, self.shelf, self.sources, self.problems)
        with suppress(UnknownError):
            settle_kinematics(plan, _place(root, ("rig", "arm", "kinematics")), self.problems)
        self._options(plan, root)
        fill(plan)
        self.report(root, impossibilities_between(plan))
        if not self.problems:
            self.report(root, underivable(plan))
        self.raise_problems()
        put(plan, "missing", tuple(self.missing))
        put(plan, "sources", tuple(SourceFile(s.name, s.text, s.sha256) for s in self.sources))
        return plan

    def _resolved(self, root: Node, payload: Path | None) -> Node:
        """The tree with every file that it names by path read into it."""
        if not isinstance(root, Mapping):
            return root
        merged = Mapping(root.place, dict(root.entries), dict(root.keys))
        if payload is not None:
            source = self.shelf.file(payload)
            merged.entries["payload"] = self.references.parse(source)
            merged.keys["payload"] = Place(source, 1, 1)
        elif "payload" in merged.entries:
            merged.entries["payload"] = self.references.section(merged.entries["payload"])
        if "rig" in merged.entries:
            merged.entries["rig"] = self.references.rig(merged.entries["rig"])
        if "payload" in merged.entries:
            _refuse_whole_plan(merged.entries["payload"])
        if "procedure" in merged.entries:
            merged.entries["procedure"] = self.references.section(merged.entries["procedure"])
        return merged

    def report(self, root: Node, found: Iterable[Impossibility]) -> None:
        for path, message, hint in found:
            self.problems.append(_place(root, path).problem(message, hint))

    def _options(self, plan: Plan, root: Node) -> None:
        """Check the options of every driver in the draft of a plan against what it declares."""
        for device, group in _DEVICES.items():
            with suppress(UnknownError):
                spec: DeviceSpec | None = attrgetter(device)(plan.rig)
                if spec is not None and spec.driver is not UNKNOWN:
                    options = read_options(
                        group,
                        spec.driver,
                        _place_for_options(root, device),
                        at(root, ("rig", *device.split("."), "options")),
                        self.problems,
                        f"rig.{device}",
                        self.missing,
                    )
                    put(spec, "options", options)


_PARTS: dict[str, tuple[set[str], str]] = {
    "rig file": (
        {"arm", "force", "system_stiffness", "second_force", "displacement"},
        "name it in a plan, `rig: {path}`; `stepload init {name} --plan plan.yaml` writes one",
    ),
    "payload file": (
        {"geometry", "material", "plate", "elastic_limit"},
        "name it in a plan, `payload: {name}`, or with --payload beside a plan",
    ),
    "procedure file": (
        {"top_force", "step", "levels", "hold"},
        "name it in a plan, `procedure: {name}`",
    ),
}
"""Parts of a plan, recognised by keys that only they have, and what to do with each."""


def _without_empty(node: Node) -> Node:
    """The tree without keys that have nothing behind them: earlier versions ran such plans."""
    if not isinstance(node, Mapping):
        return node
    kept = {
        name: _without_empty(entry)
        for name, entry in node.entries.items()
        if not (isinstance(entry, Scalar) and entry.value is None)
    }
    return Mapping(node.place, kept, {name: node.keys[name] for name in kept})


def _refuse_no_plan(root: Node) -> None:
    """Refuse what is one part of a plan only, in one sentence instead of one for every key.

    Raises:
        PlanError: it is such a part.
    """
    if not isinstance(root, Mapping) or root.entries.keys() & {"stepload", "payload", "procedure"}:
        return
    source = root.place.source
    for noun, (keys, hint) in _PARTS.items():
        if root.entries.keys() & keys:
            path = source.name if "/" in source.name else f"./{source.name}"
            told = hint.format(name=source.name, path=path)
            raise PlanError((source.problem(1, 1, f"this is a {noun}, not a plan", told),))


def _refuse_whole_plan(payload: Node) -> None:
    """Refuse a plan in the place of a payload file, in one sentence.

    Raises:
        PlanError: it is a plan.
    """
    if isinstance(payload, Mapping) and payload.entries.keys() >= {"payload", "procedure"}:
        hint = "write what is below its `payload:` to a file of its own"
        source = payload.place.source
        raise PlanError((source.problem(1, 1, "this is a plan, not a payload file", hint),))


def _place_for_options(root: Node, device: str) -> Place:
    """Where to report what a driver lacks: in the user's file, never in one of the package."""
    path = ("rig", *device.split("."), "driver")
    places = (_place(root, path[:end]) for end in range(len(path), 0, -1))
    return next((place for place in places if place.source.path is not None), root.place)


def _place(root: Node, path: tuple[str, ...]) -> Place:
    """Where the value at `path` stands, or the key of the nearest mapping above it."""
    node, place = root, root.place
    for depth, key in enumerate(path):
        if not isinstance(node, Mapping) or key not in node.entries:
            return place
        place = node.keys[key]
        node = node.entries[key]
        if depth == len(path) - 1 and not isinstance(node, (Mapping, Broken)):
            return node.place
    return place
