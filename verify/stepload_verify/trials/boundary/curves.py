"""Stored curves of boundary elements as contacts.

Computed by tamaas 2.9 on 128 × 128 points: rigid bodies on a free half-space (no images) with the
modulus of acetal, 2.75 GPa / (1 − 0.3²), to a tolerance of 1e-8. Where a hardness is given, no
pressure exceeds it while the body is loaded; what was pressed in beyond that stays, and the
unloading from 330 N is elastic. The script is in the history, `boundary/make.py`.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

from stepload.identification.fit import FloatArray

FILE = Path(__file__).with_name("curves.csv")
SPACED = 60
"""So many forces, evenly spaced, at which the exponent of a curve is fitted."""


@dataclass(frozen=True)
class Branch:
    """Indentation over force from the first touch, by a cubic spline of their logarithms.

    Below its first point it goes on as a power law.
    """

    force_n: FloatArray
    deformation_m: FloatArray

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(np.log(self.force_n), np.log(self.deformation_m), bc_type="natural")

    def at(self, force_n: FloatArray | float) -> FloatArray:
        """Indentation in m at forces in N above 0."""
        logged = np.log(np.asarray(force_n, dtype=float))
        first = float(np.log(self.force_n[0]))
        start, slope = float(self._spline(first)), float(self._spline(first, 1))
        below = start + slope * (logged - first)
        return np.exp(np.where(logged < first, below, self._spline(np.maximum(logged, first))))


@dataclass(frozen=True)
class Contact:
    """A body; `again` is the branch of all that follows its first loading, where that differs."""

    name: str
    loading: Branch
    again: Branch | None = None

    def exponent(self, from_n: float, to_n: float) -> float:
        """n of the power law with a free zero that is nearest to its loading."""
        force_n = np.linspace(from_n, to_n, SPACED)
        deep_m = self.loading.at(force_n) / self.loading.at(to_n)

        def left(n: float) -> float:
            columns = np.stack([np.ones(SPACED), (force_n / to_n) ** (1.0 / n)], axis=1)
            fitted, *_ = np.linalg.lstsq(columns, deep_m, rcond=None)
            return float(((columns @ fitted - deep_m) ** 2).sum())

        return float(minimize_scalar(left, bounds=(0.7, 4.0), method="bounded").x)


def contacts() -> Iterator[Contact]:
    """Every stored body."""
    with FILE.open(newline="") as file:
        rows = list(csv.DictReader(file))
    for name in dict.fromkeys(row["body"] for row in rows):
        own = [row for row in rows if row["body"] == name]
        branches = [_branch(own, each) for each in ("loading", "unloading")]
        loading, again = branches
        if loading is None:
            raise ValueError(f"{FILE}: {name} has no loading")
        yield Contact(name, loading, again)


def _branch(rows: list[dict[str, str]], name: str) -> Branch | None:
    own = [(float(r["force_n"]), float(r["deformation_m"])) for r in rows if r["branch"] == name]
    return Branch(*np.array(own).T) if own else None
