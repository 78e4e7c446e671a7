"""Role and unit of a column by its name, in ten languages; the words are in curve_words.toml.

The spelling of units counts: mN and MN differ by 1e9. A word without a unit is never read as SI;
only the plain names `time_s`, `position_m`, `displacement_m`, `force_n`, `lateral_n` carry theirs.
"""

from __future__ import annotations

import re
import tomllib
from functools import lru_cache
from importlib import resources
from unicodedata import normalize

LATERAL = "lateral_n"
KIND_OF_ROLE = {
    "time_s": "time", "position_m": "length", "displacement_m": "length", "force_n": "force",
    LATERAL: "force",
}  # fmt: skip
_SI = {"time": "s", "length": "m", "force": "N"}
_PREFIXES = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "μ": 1e-6, "u": 1e-6, "m": 1e-3, "": 1.0}
_POUND, _GRAM = 4.4482216152605, 9.80665e-3
UNITS = {
    "force": {p + "N": size for p, size in _PREFIXES.items()}
    | {"cN": 1e-2, "daN": 10.0, "kN": 1e3, "MN": 1e6, "gf": _GRAM, "kgf": 9.80665}
    | {"lbf": _POUND, "ozf": _POUND / 16.0, "dyn": 1e-5},
    "length": {p + "m": size for p, size in _PREFIXES.items()}
    | {"cm": 1e-2, "in": 0.0254, "mil": 2.54e-5, "Å": 1e-10},
    "time": {p + "s": size for p, size in _PREFIXES.items() if p != "p"}
    | {"min": 60.0, "h": 3600.0},
}
_KIND = {unit: kind for kind, units in UNITS.items() for unit in units}
MASSES = {"g": "gf", "gr": "gf", "kg": "kgf", "lb": "lbf", "lbs": "lbf", "oz": "ozf"}
"""Units of mass, and the force that is often meant by them."""
_SPELT = {
    "pico": "p", "nano": "n", "micro": "µ", "milli": "m", "kilo": "k", "mega": "M",
}  # fmt: skip
_BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_TABLE = tomllib.loads((resources.files("stepload.record") / "curve_words.toml").read_text("utf-8"))
_WHOLE = {word: unit for unit, words in _TABLE["units"].items() for word in words}
_ROS = re.compile(r"(?:^|.*[./])(?:wrench[./]force|pose[./]position|header[./]stamp)(?:[./][xyz])?")
_NANOSECONDS = re.compile(r"%time|(?:.*[./])?header[./]stamp")
"""Clocks in the files of `rostopic echo -p`."""


def kind_of(unit: str) -> str:
    """Force, length or time; "" for what is no unit."""
    return _KIND.get(unit, "")


def scale_of(unit: str) -> float:
    """The size of a unit in SI."""
    return UNITS[_KIND[unit]][unit]


def unit(text: str) -> str | None:
    """The symbol of a unit as it is spelt, or in words."""
    text = normalize("NFC", normalize("NFKC", text).strip(" []()")).replace("μ", "µ")
    if text in _KIND:
        return text
    word = text.lower().strip(".")
    for prefix, short in _SPELT.items():
        if word.startswith(prefix):
            rest = text[len(prefix) :].strip(" _-")
            symbol = short + _WHOLE.get(rest.lower(), rest)
            if symbol in _KIND:
                return symbol
    return _WHOLE.get(word)


def bracketed(name: str) -> str:
    """The last text in brackets of a name; "" where there is none."""
    return ([""] + _BRACKETS.findall(name))[-1].strip()


@lru_cache(4096)
def unit_of(name: str) -> str | None:
    """The unit in a name: in brackets, behind a slash or at its end; that of a ROS message."""
    if name in KIND_OF_ROLE:
        return _SI[KIND_OF_ROLE[name]]
    if _NANOSECONDS.fullmatch(name):
        return "ns"
    if _ROS.fullmatch(name):
        return "N" if "force" in name else "m"
    name = normalize("NFKC", name)
    inside = [unit(text) for text in _BRACKETS.findall(name)]
    units = {each for each in inside if each}
    if inside:
        return units.pop() if len(units) == 1 else None
    parts = [part for part in re.split(r"\s*/\s*|[\s_,:]+", name.strip()) if part]
    if len(parts) < 2 or (found := unit(parts[-1])) is None:
        return None
    joined = _SPELT.get(parts[-2].lower(), "") + found
    return joined if joined in _KIND else None


def near(name: str, kind: str) -> str | None:
    """A unit of this kind that differs from the last word of the name by its case only."""
    last = re.split(r"[\s_\[\](),:/]+", name.strip(" ])_:,"))[-1]
    found = [each for each in UNITS[kind] if each.lower() == last.lower()]
    return " or ".join(found) if found else None


def _plain(text: str) -> str:
    """A text without accents, in lower case."""
    letters = normalize("NFD", text.lower()).replace("ł", "l")
    return normalize("NFC", "".join(c for c in letters if not "\u0300" <= c <= "\u036f"))


def words(name: str) -> list[str]:
    """The words of a name without brackets and accents, in lower case."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", _BRACKETS.sub(" ", normalize("NFKC", name)))
    return re.findall(r"[^\W\d_]+", _plain(apart))


def has_word(name: str, which: str) -> bool:
    """Whether a name has a word of this list of the table."""
    return _has(tuple(words(name)), which)


def _has(found: tuple[str, ...], which: str) -> bool:
    known: list[str] = _TABLE["roles"].get(which) or _TABLE["other"][which]
    for word in known:
        if word[0] == "*":
            if any(each.endswith(word[1:]) and each != word[1:] for each in found):
                return True
        elif word in found or (word > "\u3000" and len(word) > 1 and word in "".join(found)):
            return True
    return False


@lru_cache(4096)
def role(name: str) -> str | None:
    """The role that a name stands for; None for everything that is not used."""
    if name in KIND_OF_ROLE:
        return name
    found = words(name)
    in_it = unit_of(name)
    if in_it is not None and len(found) > 1 and found[-1] == in_it.lower():
        found = found[:-1]
    bag = tuple(found)
    if not bag or found[:2] == ["contact", "depth"] or _has(bag, "about"):
        return None
    if _has(bag, LATERAL) or (_has(bag, "force_n") and {"x", "y"} & set(bag)):
        return LATERAL
    if _has(bag, "force_n"):
        return "force_n"
    if {"tip", "position"} <= set(bag):
        return "displacement_m"
    for each in ("displacement_m", "position_m", "time_s"):
        if _has(bag, each):
            return each
    return None
