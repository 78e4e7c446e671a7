"""What a user states about a file of another machine, and a refusal that says how to state it."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.record.curve_words import KIND_OF_ROLE, UNITS, kind_of, unit

ROLES = {"time": "time_s", "position": "position_m", "displacement": "displacement_m",
         "force": "force_n", "lateral": "lateral_n"}  # fmt: skip
"""Role in a table by its name on the command line."""
CALLED = {role: name for name, role in ROLES.items()}
ALL = "all"
Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class CurveMapping:
    """What is stated about a file; "" or nothing where the file itself says it.

    Attributes:
        columns: the name of a role ("force") and the name or number (from 1) of its column.
        units: the name of a role and its unit.
        sheet: of a workbook.
        decimal: the decimal mark, "." or ",".
        encoding: of the text.
        specimen: which of several tests in the file, "1"; "all": they are one test.
    """

    columns: Pairs = ()
    units: Pairs = ()
    sheet: str = ""
    decimal: str = ""
    encoding: str = ""
    specimen: str = ""

    def check(self) -> None:
        """Raises BadInputError where a unit, a mark or a number is none."""
        for name, text in self.units:
            kind = KIND_OF_ROLE[ROLES[name]]
            if kind_of(unit(text) or "") != kind:
                raise BadInputError(
                    f"--units {name}={text}: no unit of a {kind}",
                    hint=f"known: {listed(kind)}",
                )
        if self.decimal not in ("", ".", ","):
            raise BadInputError(f"--decimal {self.decimal!r}", hint="a point or a comma")
        if self.specimen not in ("", ALL) and not re.fullmatch("[1-9][0-9]{0,5}", self.specimen):
            raise BadInputError(f"--specimen {self.specimen!r}", hint="1, 2, … or all")

    def command(self, path: Path, **more: Any) -> str:
        """The command line that reads `path` with this and more."""
        for key in {"columns", "units"} & more.keys():
            names = dict(more[key])
            kept = tuple(each for each in getattr(self, key) if each[0] not in names)
            more[key] = kept + more[key]
        given = replace(self, **more)
        words = ["stepload", "identify", str(path)]
        for key in ("columns", "units", "sheet", "decimal", "encoding", "specimen"):
            if value := getattr(given, key):
                text = value if isinstance(value, str) else ", ".join(map("=".join, value))
                words += [f"--{key}", text]
        return shlex.join(words)


def parse_pairs(flag: str, text: str) -> Pairs:
    """The pairs of "force=Fn (µN), position=Pd (µm)".

    Raises:
        BadInputError: another form, an unknown name, or one that is there twice.
    """
    hint = "as in --columns 'force=Fn (µN), position=Pd (µm)' --units force=kN,position=mm; " \
        f"names: {', '.join(ROLES)}"  # fmt: skip
    pairs = []
    for part in re.split(rf",\s*(?=(?:{'|'.join(ROLES)})\s*=)", text.strip()):
        name, equals, value = (each.strip() for each in part.partition("="))
        if name not in ROLES or not value or (name != "lateral" and name in dict(pairs)):
            raise BadInputError(f"{flag} {text!r}: {part!r}", hint=hint)
        pairs.append((name, value))
    return tuple(pairs)


def listed(kind: str) -> str:
    """The units of a kind, in words."""
    return ", ".join(each for each in UNITS[kind] if not each.startswith(("u", "μ")))


class Refusal(Exception):
    """What cannot be read, or needs an answer.

    Args:
        line, column: place in the file, both from 1.
        hint: what to do; a comment behind the command where there is a `remedy`.
        remedy: fields of a `CurveMapping` that answer it.
        known: how much of a header it looked like.
    """

    def __init__(
        self, message: str, line: int = 1, column: int = 1, *, hint: str = "", known: int = 0,
        **remedy: Any,
    ) -> None:  # fmt: skip
        super().__init__(message)
        self.message, self.line, self.column, self.hint = message, line, column, hint
        self.remedy, self.known = remedy, known

    def as_error(self, path: Path, mapping: CurveMapping) -> BadInputError:
        """The error that a user sees."""
        hint = self.hint
        if self.remedy:
            hint = mapping.command(path, **self.remedy) + (f"  # {hint}" if hint else "")
        return BadInputError(f"{path}:{self.line}:{self.column}: {self.message}", hint=hint)
