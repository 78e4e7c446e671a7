"""Where the texts of a plan come from: its files and what comes with stepload, or a record."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from stepload.plan.problems import PlanError, Problem
from stepload.plan.source import Source, read_source

PROFILES, SENSORS, ARMS = "profiles", "sensors", "arms"


_CALLED = {PROFILES: "profile", SENSORS: "data sheet", ARMS: "arm"}


def shipped_names(folder: str) -> tuple[str, ...]:
    """Names of the texts in a folder of the package."""
    files = (resources.files("stepload.plan") / folder).iterdir()
    return tuple(sorted(f.name[:-5] for f in files if f.name.endswith(".yaml")))


class Disk:
    """The files as they are now."""

    def file(self, path: Path) -> Source:
        """A file of the user.

        Raises:
            PlanError: it is not there, or no text.
        """
        return read_source(path)

    def shipped(self, folder: str, name: str) -> Source:
        """A text of the package: a profile, a data sheet or an arm."""
        data = (resources.files("stepload.plan") / folder / f"{name}.yaml").read_bytes()
        return Source(f"{_CALLED[folder]} {name}", None, data.decode(), data)

    def has(self, path: Path) -> bool:
        """Whether there is such a file."""
        return path.exists()


class Kept:
    """The texts that a record has kept, whatever has become of the files since.

    They are given out in the order in which the plan asked for them when it was loaded: the order
    in which they were kept.

    Args:
        texts: name in the record and bytes, the plan itself first.
    """

    def __init__(self, texts: Sequence[tuple[str, bytes]]) -> None:
        self._left = list(texts)
        self._given = False

    def file(self, path: Path) -> Source:
        """The next text, which must have the name of the file; the first is the plan itself."""
        return self._next(path.name if self._given else "", path)

    def shipped(self, folder: str, name: str) -> Source:
        """The next text, which must be this profile or data sheet."""
        return self._next(f"{_CALLED[folder]} {name}", None)

    def has(self, path: Path) -> bool:
        """Whether the next text is that of the file."""
        return bool(self._left) and self._left[0][0].endswith(path.name)

    def _next(self, wanted: str, path: Path | None) -> Source:
        if not self._left or not self._left[0][0].endswith(wanted):
            found = self._left[0][0] if self._left else "nothing more"
            message = f"the record has kept {found} where its plan names {wanted}"
            raise PlanError((Problem(wanted, 0, 0, "", message, ""),))
        name, data = self._left.pop(0)
        self._given = True
        try:
            return Source(name, path, data.decode(), data)
        except UnicodeDecodeError:
            message = "the text that the record has kept is not UTF-8"
            raise PlanError((Problem(name, 0, 0, "", message, ""),)) from None


Shelf = Disk | Kept
"""Gives texts by path, or by the name of what comes with stepload."""
