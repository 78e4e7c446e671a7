"""Reads the files a plan is made of: small regular UTF-8 files and nothing else."""

from __future__ import annotations

import hashlib
import os
import re
import stat
from codecs import BOM_UTF8
from dataclasses import dataclass, field
from functools import cached_property
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
