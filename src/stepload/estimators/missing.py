"""A result that cannot be computed, with the reason: never a number in its place."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Missing:
    """There is no result; `why` says what the data lack, in a plain sentence."""

    why: str
