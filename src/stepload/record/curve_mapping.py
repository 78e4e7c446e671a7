"""What a user states about a file of another machine, and a refusal that says how to state it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from stepload.errors import BadInputError
from stepload.record.curve_words import KIND_OF_ROLE, kind_of, listed, unit

ROLES = {"time": "time_s", "position": "position_m", "displacement": "displacement_m",
         "force": "force_n", "lateral": "lateral_n"}  # fmt: skip
"""Role in a table by its name on the command line."""
CALLED = {role: name for name, role in ROLES.items()}
ALL, NONE = "all", "none"
Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class CurveMapping:
    """What is stated about a file; empty where the file itself says it.

    Attributes:
        columns: the name of a role, and the name or number (from 1) of its column, or "none".
        units: the name of a role and its unit; "kN not N" where that of the file is wrong.
        specimen: which of several tests in the file, "1"; "all": they are one test.
    """

    columns: Pairs = ()
    units: Pairs = ()
    sheet: str = ""
    decimal: str = ""
    encoding: str = ""
    specimen: str = ""

    @classmethod
    def of(cls, options: Mapping[str, str | None]) -> CurveMapping:
        """What options say; raises BadInputError where a pair, a unit or a number is none."""
        given: dict[str, Any] = {key: text for key, text in options.items() if text}
        for key in {"columns", "units"} & given.keys():
            given[key] = parse_pairs(f"--{key}", given[key])
        made = cls(**given)
        for name, text in made.units:
            kind = KIND_OF_ROLE[ROLES[name]]
            if kind_of(made.unit(name)[0]) != kind:
                raise BadInputError(
                    f"--units {name}={text}: no unit of a {kind}", hint=f"known: {listed(kind)}"
                )
        if made.decimal not in ("", ".", ","):
            raise BadInputError(f"--decimal {made.decimal!r}", hint="a point or a comma")
        if not re.fullmatch("|all|[1-9][0-9]{0,5}", made.specimen):
            raise BadInputError(f"--specimen {made.specimen!r}", hint="1, 2, … or all")
        return made

    @property
    def numbers(self) -> list[int]:
        """The places (from 0) of the columns where all are stated by number, else none."""
        texts = [text for _, text in self.columns if text != NONE]
        return [int(text) - 1 for text in texts] if all(map(str.isdigit, texts)) else []

    def unit(self, name: str) -> tuple[str, str]:
        """The unit that is stated for a role, and the wrong one of the file; "" for none."""
        right, _, wrong = dict(self.units).get(name, "").partition(" not ")
        return unit(right) or "", unit(wrong) or ""

    def joined(self, more: CurveMapping) -> CurveMapping:
        """This with more: pairs are added, or replace those of the same name."""
        given = asdict(self) | {key: value for key, value in asdict(more).items() if value}
        for key in ("columns", "units"):
            given[key] = tuple((dict(getattr(self, key)) | dict(given[key])).items())
        return CurveMapping(**given)

    def texts(self) -> dict[str, str]:
        """What is stated, each as an option is written."""
        return {
            key: value if isinstance(value, str) else ", ".join(map("=".join, value))
            for key, value in asdict(self).items()
            if value
        }


def parse_pairs(flag: str, text: str) -> Pairs:
    """The pairs of "force=Fn (µN), position=Pd (µm)".

    Raises:
        BadInputError: another form, an unknown name, or one that is there twice.
    """
    pairs: dict[str, str] = {}
    for part in re.split(rf",\s*(?=(?:{'|'.join(ROLES)})\s*=)", text.strip()):
        name, _, value = (each.strip() for each in part.partition("="))
        if name not in ROLES or not value or name in pairs:
            example = "force=kN, position=mm" if "units" in flag else "force=Fn (µN), position=3"
            hint = f"as in {example!r}; names: {', '.join(ROLES)}"
            raise BadInputError(f"{flag} {text!r}: {part!r}", hint=hint)
        pairs[name] = value
    return tuple(pairs.items())


class Refusal(Exception):  # noqa: N818  it may be a question
    """What cannot be read at a line and column (from 1), or needs an answer.

    Args:
        hint: what to do; a comment behind the command where there is a `remedy`.
        known: how much of a header it looked like.
        remedy: fields of a `CurveMapping` that answer it.
    """

    def __init__(
        self, message: str, line: int = 1, column: int = 1, *, hint: str = "", known: int = 0,
        **remedy: Any,
    ) -> None:  # fmt: skip
        super().__init__(message)
        self.message, self.line, self.column, self.hint = message, line, column, hint
        self.remedy, self.known = remedy, known

    def as_error(self, path: Path, mapping: CurveMapping) -> BadInputError:
        """The error that a user sees: with the command line that answers it."""
        hint = self.hint
        if self.remedy:
            words = mapping.joined(CurveMapping(**self.remedy)).texts().items()
            options = [word for key, text in words for word in (f"--{key}", text)]
            command = shlex.join(["stepload", "identify", str(path), *options])
            hint = f"{command}  # {hint}" if hint else command
        return BadInputError(f"{path}:{self.line}:{self.column}: {self.message}", hint=hint)
