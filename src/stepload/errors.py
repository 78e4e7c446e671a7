"""Errors a user can act on: what, where, the limit, what to do; each knows its exit code."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of every `stepload` command."""

    OK = 0
    BUG = 1
    BAD_INPUT = 2
    REFUSED = 3
    STOPPED = 4
    HANGUP = 129
    INTERRUPTED = 130
    TERMINATED = 143


class SteploadError(Exception):
    """Base of every error that is shown to the user as text, without a traceback.

    Args:
        message: what is wrong, with value, unit and limit.
        hint: what to do about it.
    """

    exit_code: ExitCode = ExitCode.BUG

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\n  -> {self.hint}" if self.hint else self.message


class BadInputError(SteploadError):
    """A file, an option or a number that cannot be used as given (exit code 2)."""

    exit_code = ExitCode.BAD_INPUT


class DomainError(BadInputError, ValueError):
    """A number outside the domain of an equation (exit code 2)."""


class RefusedError(SteploadError):
    """Well-formed, but it may not or cannot be done (exit code 3)."""

    exit_code = ExitCode.REFUSED


class DeviceError(SteploadError):
    """A device did not do what it must (exit code 4).

    Args:
        code: value of `stepload.rig.faults.FaultCode`; programs branch on it, never on the text.
    """

    exit_code = ExitCode.STOPPED

    def __init__(self, message: str, *, code: str, hint: str = "") -> None:
        super().__init__(message, hint=hint)
        self.code = code


class LeftEarlyError(BaseException):
    """A signal ended the command before any motion; drivers' `except Exception` cannot catch it."""

    def __init__(self, signal_number: int) -> None:
        super().__init__(signal_number)
        self.signal_number = signal_number


def in_words(error: BaseException) -> str:
    """Class and text of any exception, even if its text cannot be made: reporting an error must not
    raise another one where the arm is made safe."""
    try:
        return f"{type(error).__name__}: {error}"
    except Exception as another:
        return f"{type(error).__name__}, whose text is a {type(another).__name__}"


def printable(text: str, limit: int = 60) -> str:
    """`text` cut to `limit` characters, with everything that could steer a terminal escaped."""
    cut = text if len(text) <= limit else text[: limit - 3] + "..."
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in cut)


def guess(name: str, known: Iterable[str]) -> str:
    """A question whether the nearest known name is meant, for a hint; "" where none is near."""
    near = get_close_matches(name[:60], list(known), n=1)
    return f"did you mean {near[0]!r}? " if near else ""
