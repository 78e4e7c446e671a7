"""YAML text → `Plan`, or a `PlanError` with every problem at its line and column."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date
from pathlib import Path
from typing import Any

from stepload.plan import build, checks
from stepload.plan.derived import elastic_travel, fill
from stepload.plan.driver_options import read_options
from stepload.plan.model import Payload, Plan, SourceFile
from stepload.plan.payload_section import PayloadSection
from stepload.plan.plan_section import PlanSection, json_schema
from stepload.plan.problems import PlanError, Problem, printable
from stepload.plan.references import References, profiles
from stepload.plan.source import Source, read_source
from stepload.plan.stiffness import Situation, settle_stiffness
from stepload.plan.tree import Broken, Mapping, Node, Place
from stepload.plan.validate import Values, read_section

__all__ = ["json_schema", "load_payload", "load_plan", "profiles"]

_DEVICES = {
    ("arm",): "stepload.arms",
    ("force",): "stepload.force_sensors",
    ("displacement",): "stepload.displacement_sensors",
    ("second_force", "sensor"): "stepload.force_sensors",
}


def load_plan(path: Path, *, payload: Path | None = None, today: date | None = None) -> Plan:
    """Read and check the plan in `path`; nothing in it is executed.

    Args:
        payload: a payload file to use instead of the plan's own payload.
        today: day against which calibration records are checked; None: today.

    Raises:
        PlanError: every problem found, with file, line and column.
    """
    return _Loader().plan(Path(path), payload, today or date.today())


def load_payload(path: Path) -> Payload:
    """Read and check a payload file.

    Raises:
        PlanError: every problem found, with file, line and column.
    """
    loader = _Loader()
    source = read_source(Path(path))
    root = loader.references.parse(source)
    values = read_section(PayloadSection, root, Place(source, 1, 1), loader.problems)
    found = loader.payload(values, root, ())
    loader.raise_problems()
    assert found is not None
    return found


class _Loader:
    def __init__(self) -> None:
        self.problems: list[Problem] = []
        self.sources: list[Source] = []
        self.references = References(self.sources, self.problems)

    def raise_problems(self) -> None:
        if not self.problems:
            return
        order = {source.name: index for index, source in enumerate(self.sources)}
        unique = dict.fromkeys(self.problems)
        raise PlanError(
            tuple(sorted(unique, key=lambda p: (order.get(p.file, len(order)), p.line, p.column)))
        )

    def plan(self, path: Path, payload: Path | None, today: date) -> Plan:
        source = read_source(path)
        root = self._resolved(self.references.parse(source), payload)
        values = read_section(PlanSection, root, Place(source, 1, 1), self.problems)
        pressed = self.payload(values.get("payload", {}), root, ("payload",))
        rig = values.get("rig", {})
        self._report(root, ("rig",), checks.check_rig(rig))
        self._settle(values, root, today)
        self._options(rig, root)
        self._report(root, ("procedure",), checks.check_procedure(values.get("procedure", {})))
        fill(values, pressed)
        self._report(root, (), checks.check_whole(values, elastic_travel(values, pressed)))
        self.raise_problems()
        assert pressed is not None
        return Plan(
            name=values["name"] or printable(path.stem, 100),
            path=path,
            payload=pressed,
            rig=build.build_rig(rig),
            procedure=build.build_procedure(values["procedure"]),
            identify=build.build_identify(values["identify"]),
            record=build.build_record(values["record"]),
            sources=tuple(SourceFile(s.name, s.text, s.sha256) for s in self.sources),
        )

    def payload(self, values: Values, root: Node, at: tuple[str, ...]) -> Payload | None:
        """The payload of `values`, None where a key of it is bad."""
        try:
            found = build.build_payload(values)
        except (KeyError, ArithmeticError):
            found = None
        self._report(root, at, checks.check_payload(values, found))
        return found

    def _resolved(self, root: Node, payload: Path | None) -> Node:
        """The tree with everything in it that it names by path."""
        if not isinstance(root, Mapping):
            return root
        merged = Mapping(root.place, dict(root.entries), dict(root.keys))
        if payload is not None:
            source = read_source(payload)
            merged.entries["payload"] = self.references.parse(source)
            merged.keys["payload"] = Place(source, 1, 1)
        elif "payload" in merged.entries:
            merged.entries["payload"] = self.references.section(merged.entries["payload"])
        if "rig" in merged.entries:
            merged.entries["rig"] = self.references.rig(merged.entries["rig"])
        if "procedure" in merged.entries:
            merged.entries["procedure"] = self.references.section(merged.entries["procedure"])
        return merged

    def _report(self, root: Node, at: tuple[str, ...], found: Iterable[checks.Finding]) -> None:
        for finding in found:
            place = _place(root, (*at, *finding.path))
            self.problems.append(place.problem(finding.message, finding.hint))

    def _settle(self, values: Values, root: Node, today: date) -> None:
        rig = values.get("rig", {})
        stiffness = rig.get("system_stiffness")
        if not stiffness:
            return
        wanted = Situation(
            rig=rig.get("name", ""),
            pose=rig.get("arm", {}).get("pose", ""),
            direction=rig.get("force", {}).get("axis", ""),
            temperature_c=values.get("identify", {}).get("temperature"),
            today=today,
        )
        at = _place(root, ("rig", "system_stiffness", "record"))
        settle_stiffness(stiffness, at, wanted, self.sources, self.problems)

    def _options(self, rig: Values, root: Node) -> None:
        for path, group in _DEVICES.items():
            device: Any = rig
            for key in path:
                device = device.get(key) if device else None
            if device and "driver" in device:
                at = _place(root, ("rig", *path, "driver"))
                device["options"] = read_options(
                    group, device["driver"], at, device.get("options"), self.problems
                )


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
