"""Follows what a plan names by path or profile, so that one tree of nodes is left."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import resources
from pathlib import Path

from stepload.plan.leaves import FileName, LeafError
from stepload.plan.overlay import overlay
from stepload.plan.problems import PlanError, Problem, printable
from stepload.plan.source import Source, read_source
from stepload.plan.tree import Broken, Mapping, Node, Place, Scalar, parse_tree


def profiles() -> tuple[str, ...]:
    """Names of the rig profiles that come with stepload."""
    folder = resources.files("stepload.plan") / "profiles"
    return tuple(sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".yaml")))


def read_profile(name: str) -> Source:
    """The text of the profile `name`, which must be one of `profiles()`."""
    data = (resources.files("stepload.plan") / "profiles" / f"{name}.yaml").read_bytes()
    return Source(f"profile {name}", None, data.decode(), data)


class References:
    """Reads referenced files; collects them and what is wrong with them."""

    def __init__(self, sources: list[Source], problems: list[Problem]) -> None:
        self.sources = sources
        self.problems = problems

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
        try:
            name = FileName().read(node.value)
            home = node.place.source.path
            path = (home.parent if home else Path()) / name
            source = read_source(path)
        except PlanError as error:
            for problem in error.problems:
                if problem.line:
                    self.problems.append(problem)
                else:
                    shown = printable(node.value)
                    hint = problem.hint or "paths start at the directory of the file they stand in"
                    self.problems.append(node.place.problem(f"{shown}: {problem.message}", hint))
            return Broken(node.place)
        except LeafError as error:
            self.problems.append(node.place.problem(error.message, error.hint))
            return Broken(node.place)
        return self.parse(source)

    def rig(self, node: Node) -> Node:
        """`node`, the content of the file, or the profile it names, overrides laid over it."""
        if isinstance(node, Scalar) and isinstance(node.value, str):
            if not names_a_file(node.value):
                return self.profile(node)
            node = self.section(node)
        if not isinstance(node, Mapping) or "profile" not in node.entries:
            return node
        base = self.profile(node.entries["profile"])
        return overlay(base, node) if isinstance(base, Mapping) else Broken(node.place)

    def profile(self, node: Node) -> Node:
        """The tree of the profile that `node` names."""
        name = node.value if isinstance(node, Scalar) else None
        known = profiles()
        if isinstance(name, str) and name in known:
            return self.parse(read_profile(name))
        if not isinstance(node, Broken):
            shown = printable(str(name)) if name is not None else "this"
            near = get_close_matches(str(name)[:60], known, n=1)
            guess = f"did you mean {near[0]!r}? " if near else ""
            hint = f"{guess}profiles: {', '.join(known)}; a path ends in .yaml"
            self.problems.append(node.place.problem(f"{shown!r} is no rig profile", hint))
        return Broken(node.place)


def names_a_file(text: str) -> bool:
    """Whether a name in a plan is that of a file, not of a profile."""
    return "/" in text or text.lower().endswith((".yaml", ".yml", ".json"))
