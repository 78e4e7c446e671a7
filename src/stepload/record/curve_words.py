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

LATERAL, TRAVELS = "lateral_n", {"position_m", "displacement_m"}
KIND_OF_ROLE = {
    "time_s": "time", "position_m": "length", "displacement_m": "length", "force_n": "force",
    LATERAL: "force",
}  # fmt: skip
_PREFIXES = {"p": 1e-12, "n": 1e-9, "µ": 1e-6, "u": 1e-6, "m": 1e-3, "": 1.0}
_POUND, _GRAM = 4.4482216152605, 9.80665e-3
UNITS = {
    "force": {p + "N": size for p, size in _PREFIXES.items()}
    | {"cN": 1e-2, "daN": 10.0, "kN": 1e3, "MN": 1e6, "gf": _GRAM, "kgf": 1e3 * _GRAM}
    | {"lbf": _POUND, "ozf": _POUND / 16.0, "dyn": 1e-5},
    "length": {p + "m": size for p, size in _PREFIXES.items()}
    | {"cm": 1e-2, "in": 0.0254, "mil": 2.54e-5, "Å": 1e-10},
    "time": {p + "s": size for p, size in _PREFIXES.items() if p != "p"}
    | {"min": 60.0, "h": 3600.0},
}
_KIND = {unit: kind for kind, units in UNITS.items() for unit in units}
_SPELT = {"pico": "p", "nano": "n", "micro": "µ", "milli": "m", "kilo": "k", "mega": "M"}
_ALONE = {*"pnuμmkMcG", "da"}
"""A prefix apart from its unit, "m N": not read as newtons."""
_BRACKETS = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_TABLE: dict[str, dict[str, list[str]]] = tomllib.loads(
    (resources.files("stepload.record") / "curve_words.toml").read_text("utf-8")
)
_WORDS = {
    which: (
        {word for word in words if word[0] != "*"},
        [word[1:] for word in words if word[0] == "*"],
        [word for word in words if word > "\u3000" and len(word) > 1],
    )
    for which, words in (_TABLE["roles"] | _TABLE["other"]).items()
}
"""Whole words, ends of words, and parts of a name in Japanese or Chinese."""
_WHOLE = {word: unit for unit, words in _TABLE["units"].items() for word in words}
_FACTOR = re.compile(
    r"[*×÷/]\s*\d|(?<![^\W_])[xX]\s*10+(?!\d)|\d[eE][+-]?\d|10\s*\^"
    r"|(?<!\S)\d+(?:[.,]\d+)?\s+[^\W\d_]+$"
)


def kind_of(unit: str) -> str:
    """Force, length or time; "" for what is no unit."""
    return _KIND.get(unit, "")


def scale_of(unit: str) -> float:
    """The size of a unit in SI."""
    return UNITS[_KIND[unit]][unit]


def listed(kind: str) -> str:
    """The units of a kind, in words."""
    return ", ".join(each for each in UNITS[kind] if not each.startswith("u"))


def unit(text: str) -> str | None:
    """The symbol of a unit as it is spelt, or in words."""
    text = normalize("NFKC", text).strip(" []()").replace("μ", "µ")
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


@lru_cache(4096)
def unit_of(name: str) -> str | None:
    """The unit in a name: in brackets, behind a slash or at its end."""
    if name in KIND_OF_ROLE:
        return {"time": "s", "length": "m", "force": "N"}[KIND_OF_ROLE[name]]
    name = normalize("NFKC", name)
    if inside := _BRACKETS.findall(name):
        units = {symbol for text in inside if (symbol := unit(text))}
        return units.pop() if len(units) == 1 else None
    parts = [part for part in re.split(r"\s*/\s*|[\s_,:]+", name.strip()) if part]
    if len(parts) < 2 or (found := unit(parts[-1])) is None:
        return None
    if len(parts) > 2 and parts[-2] in _ALONE:
        return None
    joined = _SPELT.get(parts[-2].lower(), "") + found
    return joined if joined in _KIND else None


def has_factor(name: str) -> bool:
    """Whether a name may say that its numbers are multiplied: "Force x10 (N)", "Force/2 (N)"."""
    return bool(_FACTOR.search(normalize("NFKC", name)))


def words(name: str) -> list[str]:
    """The words of a name without brackets and accents, in lower case."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", _BRACKETS.sub(" ", normalize("NFKC", name)))
    letters = normalize("NFD", apart.lower()).replace("ł", "l")
    plain = "".join(c for c in letters if not "\u0300" <= c <= "\u036f")
    return re.findall(r"[^\W\d_]+", normalize("NFC", plain))


@lru_cache(4096)
def has_word(name: str, which: str) -> bool:
    """Whether a name has a word of this list of the table."""
    return _has(words(name), which)


def _has(found: list[str], which: str) -> bool:
    whole, ends, parts = _WORDS[which]
    return (
        not whole.isdisjoint(found)
        or any(each.endswith(end) and each != end for end in ends for each in found)
        or any(part in "".join(found) for part in parts)
    )


def is_specimen(name: str) -> bool:
    """Whether a column says which specimen a row is of, by name or number."""
    found = words(name)
    number = {"id", "no", "nr", "num", "number", "name", "nummer"}
    return _has(found, "specimen") and all(w in number or _has([w], "specimen") for w in found)


@lru_cache(4096)
def role(name: str) -> str | None:
    """The role that a name stands for; None for everything that is not used."""
    if name in KIND_OF_ROLE:
        return name
    found = words(name)
    if len(found) > 1 and found[-1] == (unit_of(name) or "").lower():
        found.pop()
    if not found or found[:2] == ["contact", "depth"] or _has(found, "about"):
        return None
    force = _has(found, "force_n")
    if _has(found, LATERAL) or (force and {"x", "y"} & set(found)):
        return LATERAL
    if {"tip", "position"} <= set(found) and not force:
        return "displacement_m"
    order = ("force_n", "displacement_m", "position_m", "time_s")
    return next((each for each in order if _has(found, each)), None)
