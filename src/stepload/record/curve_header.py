"""Determines the role and the unit of every column of a table from its header, or refuses it.

A name such as "Load On Sample (mN)", "displacement_um" or "Force / kN" contains a word for the
quantity and a unit. The spelling of units counts: mN and MN differ by 1e9. A word without a unit is
never read as SI; only the plain names `time_s`, `position_m`, `displacement_m`, `force_n`,
`lateral_n` carry theirs in lower case.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

COLUMNS = ("time_s", "position_m", "displacement_m", "force_n")
LATERAL = "lateral_n"
HINT = (
    "the first line names the columns: `time_s, position_m, force_n` (travel of the arm), "
    "or `displacement_m, force_n` (deformation, system stiffness already taken out); other names "
    'with their units: "Force [mN]", "Depth (nm)"'
)

_PREFIXES = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "μ": 1e-6, "u": 1e-6, "m": 1e-3, "": 1.0}
_UNITS = {
    "force": {p + "N": size for p, size in _PREFIXES.items()} | {"kN": 1e3, "MN": 1e6},
    "length": {p + "m": size for p, size in _PREFIXES.items()} | {"cm": 1e-2},
    "time": {p + "s": size for p, size in _PREFIXES.items() if p != "p"}
    | {"sec": 1.0, "min": 60.0, "h": 3600.0},
}
_KIND = {unit: kind for kind, units in _UNITS.items() for unit in units}
_SIZE = {unit: size for units in _UNITS.values() for unit, size in units.items()}
_SPELT = {
    "pico": "p", "nano": "n", "micro": "µ", "milli": "m", "kilo": "k", "mega": "M",
}  # fmt: skip
_WHOLE = {
    "newton": "N", "newtons": "N", "meter": "m", "meters": "m", "metre": "m", "metres": "m",
    "second": "s", "seconds": "s", "sec": "s", "micron": "µm", "microns": "µm",
}  # fmt: skip

_KIND_OF_ROLE = {
    "time_s": "time", "position_m": "length", "displacement_m": "length", "force_n": "force",
    LATERAL: "force",
}  # fmt: skip
_EXAMPLE = {"time": "[s]", "length": "[um]", "force": "[mN]"}
_WORDS = {
    LATERAL: {"lateral", "tangential", "shear", "friction", "transverse", "fx", "fy", "ft"},
    "force_n": {"force", "load", "fz", "fn", "kraft"},
    "displacement_m": {
        "displacement", "disp", "deformation", "indentation", "indent", "depth", "penetration",
        "compression", "separation",
    },
    "position_m": {
        "position", "pos", "travel", "stroke", "crosshead", "height", "piezo", "z", "zsensor",
    },
    "time_s": {"time", "zeit"},
}  # fmt: skip
_ABOUT = frozenset(
    {
        "std", "sd", "sigma", "deviation", "amplitude", "amp", "rate", "speed", "velocity", "error",
        "noise", "stiffness", "modulus", "hardness", "residual", "volt", "volts", "voltage",
        "setpoint", "target", "command", "commanded", "demand", "area", "rms",
    }
)  # fmt: skip
"""Words for quantities that are derived from a channel, and are not the channel itself."""


@dataclass(frozen=True, slots=True)
class Column:
    """One column: where it stands, its name in the file, what it is, and its unit in SI."""

    place: int
    name: str
    role: str
    unit: str
    scale: float


@dataclass(frozen=True, slots=True)
class Header:
    """The columns that are used, the delimiter (None: spaces), and how many cells a row has."""

    delimiter: str | None
    columns: tuple[Column, ...]
    width: int


def may_be_machine(column: Column) -> bool:
    """Whether a column of displacement may hold the machine's own deflection as well.

    Testing machines use such names for their crosshead's travel; depth, indentation and deformation
    are the payload's, and so is stepload's own name with any unit.
    """
    if column.role != "displacement_m" or re.fullmatch(r"displacement_\w+", column.name):
        return False
    return bool({"displacement", "disp", "compression"} & set(_words(column.name)))


class HeaderError(Exception):
    """A line that is no header; `known` says how much of one it looks like."""

    def __init__(self, message: str, *, hint: str = HINT, known: int = 0) -> None:
        super().__init__(message)
        self.message, self.hint, self.known = message, hint, known


def split(line: str, delimiter: str | None) -> list[str]:
    """The cells of a line, without quotes and spaces around them."""
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def delimiter_of(line: str) -> str | None:
    """Comma, semicolon or tab, whichever is there most often; None where there is none."""
    delimiter = max("\t;,", key=line.count)
    return delimiter if delimiter in line else None


def parse_header(line: str, units: str | None = None) -> Header:
    """Read the names of the columns.

    Args:
        line: the header, without its line end.
        units: the line below it; where it holds nothing but units, they count to the names.

    Raises:
        HeaderError: a column that is needed is missing, there twice, or without a known unit.
    """
    delimiter = delimiter_of(line)
    names = split(line, delimiter)
    if delimiter is None and any(_unit_of(name) is None for name in names):
        # Names of several words and no delimiter: one column, or prose.
        names = [line.strip()]
    if units is not None:
        names = _with_units(names, split(units, delimiter))
    try:
        return Header(delimiter, tuple(_columns(names)), len(names))
    except HeaderError as error:
        error.known = error.known if len(names) > 1 else 0
        raise


def _with_units(names: list[str], units: list[str]) -> list[str]:
    """Names with the units of the row below.

    Raises:
        HeaderError: that row is none of units.
    """
    bare = [unit.strip("[]() ") for unit in units]
    if len(bare) != len(names) or not all(u in ("", "-") or _unit(u) for u in bare):
        raise HeaderError("no row of units")
    return [f"{n} [{u}]" if _unit(u) else n for n, u in zip(names, bare, strict=True)]


def _columns(names: Sequence[str]) -> Iterable[Column]:
    for name in (*COLUMNS, LATERAL):
        if names.count(name) > 1:
            raise HeaderError(f"the column {name!r} is there {names.count(name)} times", known=4)
    found = {name: [names.index(name)] for name in (*COLUMNS, LATERAL) if name in names}
    loose: dict[str, list[int]] = {}
    for place, name in enumerate(names):
        role = _role(name)
        if role is not None and role not in found:
            loose.setdefault(role, []).append(place)
    chosen = {role: (names[places[0]], places) for role, places in found.items()}
    known = len(found)
    if found.keys() & {"position_m", "displacement_m"}:
        loose = {r: p for r, p in loose.items() if r not in ("position_m", "displacement_m")}
    refusal: HeaderError | None = None
    for role, places in loose.items():
        try:
            usable = _usable(role, [(place, names[place]) for place in places])
        except HeaderError as error:
            known += 1
            if refusal is None or role == "force_n":
                refusal = error
            continue
        if usable:
            known += 1
            chosen[role] = (names[usable[0]], usable)
    if refusal is not None:
        refusal.known = known
        raise refusal
    _complete(chosen, names, known)
    for role, (_, places) in chosen.items():
        for place in places:
            unit = "" if names[place] == role else _unit_of(names[place]) or ""
            yield Column(place, names[place], role, unit, _SIZE.get(unit, 1.0))


def _usable(role: str, candidates: Sequence[tuple[int, str]]) -> list[int]:
    """The indices of a role's columns: one, or several of a lateral force.

    Raises:
        HeaderError: several could be meant, or none has a unit of its kind.
    """
    kind = _KIND_OF_ROLE[role]
    units = {place: _unit_of(name) for place, name in candidates}
    good = [place for place, unit in units.items() if unit and _KIND[unit] == kind]
    names = dict(candidates)
    if len(good) > 1 and role != LATERAL:
        listed = ", ".join(repr(names[place]) for place in good)
        raise HeaderError(
            f"{len(good)} columns could be the {_called(role)}: {listed[:200]}",
            hint=f"call the one that is meant {role!r}, if it is in SI, or take out the others",
        )
    if good or role == LATERAL:
        return good
    place, name = candidates[0]
    unit = units[place]
    if unit:
        message = f"the column {name[:60]!r} is in {unit}, no unit of a {kind}"
    else:
        message = f"the column {name[:60]!r} has no unit that is known"
    near = _near(name, kind)
    word = re.split(r"[\[(/]", name)[0].strip(" _:,") or _called(role)
    hint = f'write its unit: "{word} {_EXAMPLE[kind]}"; known are {", ".join(_listed(kind))}'
    raise HeaderError(message + (f"; is {near!r} meant?" if near else ""), hint=hint)


def _complete(chosen: dict[str, tuple[str, list[int]]], names: Sequence[str], known: int) -> None:
    """Refuse a header without force, without travel, or with two travels."""
    if {"position_m", "displacement_m"} <= chosen.keys():
        one, other = chosen["position_m"][0], chosen["displacement_m"][0]
        raise HeaderError(
            f"both {one!r} and {other!r}: which one is meant?",
            hint="take one out: travel of the machine, or deformation of the payload alone",
            known=known,
        )
    needed = ["force_n"] if "displacement_m" in chosen else ["force_n", "position_m"]
    for role in needed:
        if role not in chosen:
            others = [name for name in names if name not in COLUMNS]
            near = difflib.get_close_matches(role, others, 1, 0.5)
            found = f"; is {near[0]!r} meant?" if near else f" among {', '.join(names)[:200]}"
            raise HeaderError(f"no column {role!r}{found}", known=known)


def _called(role: str) -> str:
    return {"time_s": "time", "force_n": "force", LATERAL: "lateral force"}.get(role, "travel")


def _listed(kind: str) -> list[str]:
    return [unit for unit in _UNITS[kind] if not unit.startswith(("u", "μ")) and unit != "sec"]


def _near(name: str, kind: str) -> str | None:
    """A unit of this kind that differs from the last word of the name by its case only."""
    last = re.split(r"[\s_\[\](),:/]+", name.strip(" ])_:,"))[-1]
    near = [unit for unit in _UNITS[kind] if unit.lower() == last.lower()]
    return " or ".join(near) if near else None


def _words(name: str) -> list[str]:
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", re.sub(r"[\[(][^\])]*[\])]", " ", name))
    return [word for word in re.split(r"[^A-Za-zµμ]+", apart.lower()) if word]


def _role(name: str) -> str | None:
    """The role that a name stands for; None for everything that is not used."""
    words = _words(name)
    if not words or _ABOUT & set(words):
        return None
    if words[:2] == ["contact", "depth"]:
        return None
    unit = _unit_of(name)
    if unit is not None and len(words) > 1 and words[-1] == unit.lower():
        words = words[:-1]
    bag = set(words)
    forces = bag & _WORDS["force_n"]
    if bag & _WORDS[LATERAL] or (forces and bag & {"x", "y"}):
        return LATERAL
    if forces:
        return "force_n"
    if {"tip", "position"} <= bag:
        return "displacement_m"
    for role in ("displacement_m", "position_m", "time_s"):
        if bag & _WORDS[role]:
            return role
    return None


def _unit(text: str) -> str | None:
    """The symbol of a unit as it is spelt, or in words."""
    text = text.strip()
    if text in _KIND:
        return text
    word = text.lower()
    for prefix, short in _SPELT.items():
        if word.startswith(prefix):
            rest = text[len(prefix) :].strip(" _-")
            symbol = short + _WHOLE.get(rest.lower(), rest)
            if symbol in _KIND:
                return symbol
    return _WHOLE.get(word)


def _unit_of(name: str) -> str | None:
    """The unit in a name: in brackets, behind a slash or at its end."""
    if name in _KIND_OF_ROLE:
        return {"time": "s", "length": "m", "force": "N"}[_KIND_OF_ROLE[name]]
    bracketed = [_unit(text) for text in re.findall(r"[\[(]([^\[\]()]*)[\])]", name)]
    units = {unit for unit in bracketed if unit}
    if bracketed:
        return units.pop() if len(units) == 1 else None
    parts = [part for part in re.split(r"\s*/\s*|[\s_,:]+", name.strip()) if part]
    if len(parts) < 2 or (unit := _unit(parts[-1])) is None:
        return None
    prefix = _SPELT.get(parts[-2].lower())
    if prefix is None:
        return unit
    joined = prefix + unit
    return joined if joined in _KIND else None
