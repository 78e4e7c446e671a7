"""The texts a plan is made of: small regular UTF-8 files, what comes with stepload, or a record."""

from __future__ import annotations

import hashlib
import os
import re
import stat
from codecs import BOM_UTF8
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import resources
from pathlib import Path

from stepload.errors import printable
from stepload.plan.problems import PlanError, Problem

MAX_BYTES = 1 << 20
"""Largest plan file, in bytes."""

_LINE_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
"""What the YAML scanner counts as the end of a line."""


@dataclass(frozen=True)
class Source:
    """One file: `name` is what errors call it, `path` where it is (None: comes with stepload)."""

    name: str
    path: Path | None
    text: str
    data: bytes = field(repr=False)

    @cached_property
    def lines(self) -> list[str]:
        return _LINE_BREAK.split(self.text)

    def start_of(self, line: int) -> int:
        """The character (from 0) of the text at which a line (from 1) begins."""
        ends = [found.end() for found in _LINE_BREAK.finditer(self.text)]
        return [0, *ends][line - 1]

    def beside(self, name: str | Path) -> Path:
        """The path of a file that this one names: from its own directory."""
        return (self.path.parent if self.path else Path()) / name

    @property
    def sha256(self) -> str:
        return hashlib.sha256(self.data).hexdigest()

    def problem(self, line: int, column: int, message: str, hint: str = "") -> Problem:
        """A problem at `line`, `column` (from 1) of this file."""
        text = self.lines[line - 1] if 0 < line <= len(self.lines) else ""
        return Problem(self.name, line, column, text, message, hint)

    def problem_at(self, position: int, message: str, hint: str = "") -> Problem:
        """A problem at the character `position` (from 0) of the text."""
        before = self.text[:position]
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        return self.problem(line, column, message, hint)


def read_source(path: Path, name: str | None = None) -> Source:
    """Read `path`; never blocks on a pipe or device, never reads more than `MAX_BYTES`.

    Raises:
        PlanError: not there, not a regular file, too large, or not UTF-8.
    """
    name = printable(name or str(path), 200)
    data = _read(path, name)
    body = data.removeprefix(BOM_UTF8)
    try:
        text = body.decode()
    except UnicodeDecodeError as error:
        readable = Source(name, path, body.decode(errors="replace"), data)
        position = len(body[: error.start].decode())
        message = f"byte 0x{body[error.start]:02x} is not UTF-8"
        problem = readable.problem_at(position, message, "save the file as UTF-8 text")
        raise PlanError((problem,)) from None
    return Source(name, path, text, data)


def _read(path: Path, name: str) -> bytes:
    def fail(message: str, hint: str = "") -> PlanError:
        return PlanError((Problem(name, 0, 0, "", message, hint),))

    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        raise fail("no such file") from None
    except (OSError, ValueError) as error:
        raise fail(f"cannot be opened: {getattr(error, 'strerror', None) or error}") from None
    try:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise fail("is not a regular file")
        with open(handle, "rb", closefd=False) as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise fail(f"cannot be read: {error.strerror}") from None
    finally:
        os.close(handle)
    if len(data) > MAX_BYTES:
        raise fail(
            f"is larger than {MAX_BYTES // 1024} KiB",
            "a plan is a short text; is this the right file?",
        )
    return data


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


class Folder(Disk):
    """The files of one folder; the plan itself is a text that need not be saved there.

    Args:
        folder: resolved; no path outside it is opened, also not by a link.
        path: of the plan, inside the folder.
    """

    def __init__(self, folder: Path, path: Path, text: str) -> None:
        self._folder, self._path, self._text = folder, path, text

    def file(self, path: Path) -> Source:
        """The plan, or a file that it names.

        Raises:
            PlanError: the file is outside the folder, not there, or no text.
        """
        if path == self._path:
            name = str(path.relative_to(self._folder))
            return Source(name, path, self._text, self._text.encode())
        if not self._inside(path):
            message = f"is outside {self._folder}"
            raise PlanError((Problem(path.name, 0, 0, "", message, "only its files are read"),))
        return read_source(path, str(path.relative_to(self._folder)))

    def has(self, path: Path) -> bool:
        """Whether the folder has such a file."""
        return self._inside(path) and path.exists()

    def _inside(self, path: Path) -> bool:
        try:
            return path.is_relative_to(self._folder) and path.resolve().is_relative_to(self._folder)
        except (OSError, ValueError, RuntimeError):  # a null byte, a loop of links
            return False


class Kept:
    """The texts that a record has kept, whatever has become of the files since.

    They are given out in the order in which they were kept, that in which the plan asked for them.

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
