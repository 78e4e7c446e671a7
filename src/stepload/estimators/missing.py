"""A result that is not to be had, and why: never a number in its place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Missing:
    """There is no result; `why` says what the data lack, in a plain sentence."""

    why: str
