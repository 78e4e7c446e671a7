"""Follows what a plan names by path or profile, so that one tree of nodes is left."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

from pydantic_core import PydanticCustomError

from stepload.declaration.quantities import path_of
from stepload.errors import guess, printable
from stepload.plan.compose import at, composed, problems_of, replaced, with_data_sheets
from stepload.plan.model import Plan
from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import PROFILES, SENSORS, Disk, Shelf, Source, shipped_names
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, Sequence, parse_tree

_TABLE = ("geometry", "table")
_HEAD = re.compile(r"\s*(r|z)\s*\[\s*([a-zµμ]+)\s*\]\s*")
"""A column of a profile's table, with its unit."""


def profiles() -> tuple[str, ...]:
    """Names of the rig profiles that come with stepload."""
    return shipped_names(PROFILES)


def data_sheets() -> tuple[str, ...]:
    """Names of the data sheets of force sensors that come with stepload."""
    return shipped_names(SENSORS)


def read_profile(name: str) -> Source:
    """The text of the profile `name`, which must be one of `profiles()`."""
    return Disk().shipped(PROFILES, name)


def read_data_sheet(name: str) -> Source:
    """The text of the data sheet `name`, which must be one of `data_sheets()`."""
    return Disk().shipped(SENSORS, name)


def about(source: Source) -> str:
    """The comment that a profile or a data sheet begins with, as one line."""
    comment = re.match(r"(?:#[^\n]*\n)+", source.text)
    return re.sub(r"\n?# ?", " ", comment[0]).strip() if comment else ""


def title(source: Source) -> str:
    """What a profile or a data sheet is, in a few words: the first clause of `about`."""
    return re.split(r"[.:](?:\s|$)", about(source))[0]


class References:
    """Reads referenced files; collects them and what is wrong with them."""

    def __init__(self, shelf: Shelf) -> None:
        self.shelf = shelf
        self.sources: list[Source] = []
        self.problems: list[Problem] = []

    def parse(self, source: Source) -> Node:
        """The tree of `source`; Broken where there is none."""
        self.sources.append(source)
        try:
            root, problems = parse_tree(source)
        except PlanError as error:
            self.problems.extend(error.problems)
            return Broken(Place(source, 1, 1))
        self.problems.extend(problems)
        return root

    def section(self, node: Node) -> Node:
        """`node`, or the content of the file it names."""
        if not (isinstance(node, Scalar) and isinstance(node.value, str)):
            return node
        source = self._file(node, node.value)
        return Broken(node.place) if source is None else self.parse(source)

    def payload(self, node: Node) -> Node:
        """A payload, with the table of its profile read from the file that it names."""
        node = self.section(node)
        named = at(node, _TABLE)
        if not (isinstance(node, Mapping) and isinstance(named, Scalar)):
            return node
        if not isinstance(named.value, str):
            return node
        table: Node = Broken(named.place)
        if (source := self._file(named, named.value)) is not None:
            self.sources.append(source)
            try:
                table = _table_of(source)
            except PlanError as error:
                self.problems.extend(error.problems)
        return replaced(node, _TABLE, table)

    def _file(self, node: Node, name: str) -> Source | None:
        """The file that a node names; None, and reported, where there is none."""
        try:
            return self.shelf.file(node.place.source.beside(path_of(name)))
        except PlanError as error:
            for problem in error.problems:
                if problem.line:
                    self.problems.append(problem)
                else:
                    hint = problem.hint or "paths start at the directory of the file they stand in"
                    message = f"{printable(name)}: {problem.message}"
                    self.problems.append(node.place.problem(message, hint))
        except PydanticCustomError as error:
            hint = (error.context or {}).get("hint", "")
            self.problems.append(node.place.problem(error.message(), hint))
        return None

    def rig(self, node: Node) -> Node:
        """`node`, the content of the file, or the profile it names, overrides laid over it."""
        if isinstance(node, Scalar) and isinstance(node.value, str):
            if not names_a_file(node.value):
                return self.profile(node)
            node = self.section(node)
        return self._composed(node) if isinstance(node, Mapping) else node

    def _composed(self, own: Mapping) -> Node:
        """A rig of a profile, of data sheets and of its own keys."""
        own = with_data_sheets(own, self.data_sheet, self.problems)
        rig, base = own, None
        if "profile" in own.entries:
            named = self.profile(own.entries["profile"])
            if not isinstance(named, Mapping):
                return Broken(own.place)
            base = with_data_sheets(named, self.data_sheet, self.problems)
            rig = composed(base, own)
        self.problems.extend(problems_of(rig, own, base, ", ".join(data_sheets())))
        return rig

    def profile(self, node: Node) -> Node:
        """The tree of the rig profile that `node` names."""
        more = "; a file of yours is no profile: `rig: FILE.yaml`"
        return self._named(node, PROFILES, "rig profile", more)

    def data_sheet(self, node: Node) -> Node:
        """The tree of the data sheet that `node` names."""
        return self._named(node, SENSORS, "data sheet of a force sensor")

    def _named(self, node: Node, folder: str, what: str, more: str = "") -> Node:
        name, known = node.value if isinstance(node, Scalar) else None, shipped_names(folder)
        if isinstance(name, str) and name in known:
            return self.parse(self.shelf.shipped(folder, name))
        if not isinstance(node, Broken):
            shown = printable(str(name)) if name is not None else "this"
            hint = f"{guess(str(name), known)}profiles: {', '.join(known)}{more}"
            self.problems.append(node.place.problem(f"{shown!r} is no {what}", hint))
        return Broken(node.place)


def _table_of(source: Source) -> Node:
    """The points of a profile in a CSV file, as if they were written in the payload.

    Raises:
        PlanError: a line that is no point, or heads that are not `r [mm],z [mm]`.
    """
    lines = [(number, line) for number, line in enumerate(source.lines, 1) if line.strip()]
    heads = [_HEAD.fullmatch(cell) for cell in lines[0][1].split(",")] if lines else []
    names = [head[1] for head in heads if head]
    if sorted(names) != ["r", "z"] or len(heads) != 2:
        raise PlanError((source.problem(1, 1, "this is no table of r and z",
                                        "the first line is `r [mm],z [mm]`"),))  # fmt: skip
    units = [head[2] for head in heads if head]
    points: list[Node] = []
    problems: list[Problem] = []
    for number, line in lines[1:]:
        place, cells = Place(source, number, 1), line.split(",")
        if len(cells) != 2:
            problems.append(place.problem("this is not a point of r and z"))
            points.append(Broken(place))
            continue
        texts = [f"{cell.strip()} {unit}" for cell, unit in zip(cells, units, strict=True)]
        items: list[Node] = [Scalar(place, text, text) for text in texts]
        points.append(Sequence(place, items if names == ["r", "z"] else items[::-1]))
    if problems:
        raise PlanError(tuple(problems))
    return Sequence(Place(source, 1, 1), points)


def names_a_file(text: str) -> bool:
    """Whether a name in a plan is that of a file, not of a profile."""
    return "/" in text or text.lower().endswith((".yaml", ".yml", ".json"))


def tree_of(path: Path, shelf: Disk | None = None) -> Node | None:
    """The nodes of a plan file; None where it cannot be read."""
    with suppress(PlanError):
        return parse_tree((shelf or Disk()).file(path))[0]
    return None


def place_of(plan: Plan, key: str, shelf: Disk | None = None) -> Place | None:
    """The place of a key such as `procedure.top_force`, or of the last part of it that is written.

    None where nothing of it is written, or the plan has no file.
    """
    home, found = plan.path, None
    node = tree_of(home, shelf)
    for name in key.split(".") if key else ():
        if isinstance(node, Scalar) and isinstance(node.value, str) and names_a_file(node.value):
            home = home.parent / node.value
            node = tree_of(home, shelf)
        if not isinstance(node, Mapping) or name not in node.entries:
            break
        found = node.keys[name]
        node = node.entries[name]
        if not isinstance(node, Mapping):
            found = node.place
    return found
