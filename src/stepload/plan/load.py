"""YAML text → `Plan`, or a `PlanError` with every problem at its line and column."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import date
from operator import attrgetter
from pathlib import Path

from stepload.declaration.sections import put
from stepload.plan.checks import contradictions
from stepload.plan.compose import at, text
from stepload.plan.derived import fill
from stepload.plan.driver_options import options_from_words, read_options
from stepload.plan.kinematics import settle_kinematics
from stepload.plan.model import Payload, Plan, SourceFile
from stepload.plan.problems import PlanError, Problem
from stepload.plan.reader import read_section
from stepload.plan.references import References, profiles
from stepload.plan.schema import json_schema
from stepload.plan.source import Disk, Folder, Kept
from stepload.plan.stiffness import settle_stiffness
from stepload.plan.tree import Mapping, Node, Place, locate
from stepload.rig.plugins import WORLDS

__all__ = ["json_schema", "load_payload", "load_plan", "profiles"]

_DEVICES = {
    "arm": "stepload.arms",
    "force": "stepload.force_sensors",
    "displacement": "stepload.displacement_sensors",
    "second_force.sensor": "stepload.force_sensors",
    "simulation": WORLDS,
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


def in_world(plan: Plan, name: str) -> Plan:
    """The plan with another simulator for dry runs; with its own options where it names that one.

    Raises:
        BadInputError: no such simulator.
        PlanError: it has an option that must be given: in the plan.
    """
    simulation = plan.rig.simulation
    if name == simulation.world:
        return plan
    options = options_from_words(WORLDS, name, ())
    other = replace(simulation, world=name, world_options=options)
    return replace(plan, rig=replace(plan.rig, simulation=other))


def load_text(text: str, path: Path, folder: Path) -> Plan:
    """The plan of a text that is edited; it reads no file outside `folder`.

    Args:
        path: where the plan is, or would be saved: files that it names are found from there.
        folder: resolved, around `path`.

    Raises:
        PlanError: every problem found, with file, line and column.
    """
    return _Loader(Folder(folder, path, text)).plan(path, None, date.today())


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
    root = loader.payload(loader.parse(source))
    _refuse_whole_plan(root)
    payload = read_section(Payload, root, Place(source, 1, 1), loader.problems)
    loader.raise_problems()
    assert payload is not None
    return payload


class _Loader(References):
    def raise_problems(self, waiting: bool = False) -> None:
        """Raise the problems found; `waiting`: others can be seen only without these."""
        order = {source.name: index for index, source in enumerate(self.sources)}
        found = sorted(
            dict.fromkeys(self.problems),
            key=lambda each: (order.get(each.file, len(order)), each.line, each.column),
        )
        if found:
            raise PlanError(tuple(found), waiting)

    def plan(self, path: Path, payload: Path | None, today: date) -> Plan:
        source = self.shelf.file(path)
        parsed = self.parse(source)
        _refuse_no_plan(parsed)
        root = self._resolved(parsed, payload)
        plan = read_section(Plan, root, Place(source, 1, 1), self.problems)
        missing: list[Problem] = []
        options = dict(self._options(root, missing))
        if plan is not None:
            put(plan, "path", path)
            put(plan, "payload_file", payload)
            for device, values in options.items():
                field = "world_options" if device == "simulation" else "options"
                put(attrgetter(device)(plan.rig), field, values)
            settle_stiffness(plan, _place(root, "rig.system_stiffness.record"), today, self)
            settle_kinematics(plan, _place(root, "rig.arm.kinematics"), self.problems)
        self.raise_problems(waiting=True)
        assert plan is not None
        for found in fill(plan), contradictions(plan):
            self.problems += [_place(root, key).problem(*told) for key, *told in found]
            self.raise_problems()
        put(plan, "missing", tuple(missing))
        put(plan, "sources", tuple(SourceFile(s.name, s.text, s.sha256) for s in self.sources))
        return plan

    def _resolved(self, root: Node, payload: Path | None) -> Node:
        """The tree with every file that it names by path read into it."""
        if not isinstance(root, Mapping):
            return root
        entries, keys = dict(root.entries), dict(root.keys)
        if payload is not None:
            source = self.shelf.file(payload)
            entries["payload"], keys["payload"] = self.parse(source), Place(source, 1, 1)
        for name, read in (
            ("payload", self.payload),
            ("rig", self.rig),
            ("procedure", self.section),
        ):
            if name in entries:
                entries[name] = read(entries[name])
        _refuse_whole_plan(entries.get("payload"))
        return Mapping(root.place, entries, keys)

    def _options(
        self, root: Node, missing: list[Problem]
    ) -> Iterator[tuple[str, dict[str, object]]]:
        """The options of every device and of the world, checked against what each declares."""
        for device, group in _DEVICES.items():
            named, key, waiting = "driver", "options", missing
            if group == WORLDS:
                named, key, waiting = "world", "world_options", self.problems
            rig = at(root, ("rig", *device.split(".")))
            name = text(rig, named)
            if name is None and group == WORLDS and at(rig, (key,)):
                name = "sim"
            if isinstance(rig, Mapping) and isinstance(name, str):
                place = _place_for_options(root, f"rig.{device}.{named}")
                given, called = rig.entries.get(key), f"rig.{device}"
                yield (
                    device,
                    read_options(group, name, place, given, self.problems, called, waiting),
                )


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


def _refuse_whole_plan(payload: Node | None) -> None:
    """Refuse a plan in the place of a payload file, in one sentence.

    Raises:
        PlanError: it is a plan.
    """
    if isinstance(payload, Mapping) and payload.entries.keys() >= {"payload", "procedure"}:
        hint = "write what is below its `payload:` to a file of its own"
        source = payload.place.source
        raise PlanError((source.problem(1, 1, "this is a plan, not a payload file", hint),))


def _place_for_options(root: Node, path: str) -> Place:
    """Where to report what a driver lacks: in the user's file, never in one of the package."""
    keys = path.split(".")
    places = (_place(root, ".".join(keys[:end])) for end in range(len(keys), 0, -1))
    return next((place for place in places if place.source.path is not None), root.place)


def _place(root: Node, path: str) -> Place:
    return locate(root, path.split("."), root.place)
