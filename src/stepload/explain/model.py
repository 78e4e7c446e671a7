"""The explanation of a code."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Explanation:
    """What a code means and what to do; `page` is a page of docs/."""

    group: str
    code: str
    means: str
    do: str
    page: str
