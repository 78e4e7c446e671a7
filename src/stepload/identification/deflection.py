"""Deflection of the system over force, δ_s(F), as a table of one pose; where there is none, K_s.

A stiffness is one number, and a load path is seldom linear: joints, gears and mounts are softer at
small force. The table says how far the system gives way at each force, and is subtracted in place
of F/K_s (27). Its rows are joined by a monotone cubic (F. N. Fritsch and J. Butland, SIAM J. Sci.
Stat. Comput. 5 (1984) 300), as by `scipy.interpolate.PchipInterpolator`, whose import takes longer
than a short run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stepload.errors import DomainError
from stepload.identification.fit import FloatArray

MOST_ROWS = 1000


def table_problem(
    force_n: Sequence[float], deflection_m: Sequence[float], sigma_m: Sequence[float]
) -> str:
    """Why these rows are not a valid table; "" where they are."""
    counts = len(force_n), len(deflection_m), len(sigma_m)
    if len(set(counts)) > 1:
        return (
            f"{counts[0]} forces, {counts[1]} deflections and {counts[2]} uncertainties; every row "
            "needs all three"
        )
    if not 1 <= counts[0] <= MOST_ROWS:
        return f"{counts[0]} rows; a table has 1 to {MOST_ROWS}"
    for name, values in (("force", force_n), ("deflection", deflection_m)):
        before = 0.0
        for value in values:
            if not before < value < math.inf:
                return f"a {name} of {value:.6g} after {before:.6g}; they must rise from row to row"
            before = value
    bad = next((value for value in sigma_m if not 0.0 <= value < math.inf), None)
    if bad is None:
        return ""
    return f"an uncertainty of {bad:.6g} m; it must be finite and not below 0"


def upper_stiffness_n_per_m(force_n: Sequence[float], deflection_m: Sequence[float]) -> float:
    """Stiffness of a table above 40 % of its forces, where K_s is fitted."""
    rows = [(0.0, 0.0), *zip(force_n, deflection_m, strict=True)]
    first = max(index for index, row in enumerate(rows[:-1]) if row[0] <= 0.4 * force_n[-1])
    return (rows[-1][0] - rows[first][0]) / (rows[-1][1] - rows[first][1])


ASSUMED_RELATIVE = 0.05
"""Relative standard uncertainty of a K_s that nobody states one of."""
BEGINS = 0.25
"""A table's first row must lie at or below this share of the peak force: below it the table is a
straight line to zero, and a chord begins at 10 %."""
REACHED = 0.97
"""Least force that a run reaches over its planned top force. With it, a table that satisfies
`BEGINS` for the plan also does for the run."""
BEYOND = 1.05
"""Peak force over a table's highest row (a mean over forces) up to which nothing is said."""


def rising_curve(x: FloatArray, y: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """The curve through (M,) points, M at least 2, `x` and `y` both rising.

    Beyond the points its first and last piece go on.
    """
    width = np.diff(x)
    secant = np.diff(y) / width
    slope = _slopes(width, secant)
    bend = (slope[:-1] + slope[1:] - 2.0 * secant) / width
    cubic, square = bend / width, (secant - slope[:-1]) / width - bend

    def curve(at: FloatArray) -> FloatArray:
        piece = np.searchsorted(x[1:-1], at, side="right")
        s = at - x[piece]
        return np.asarray(
            y[piece] + slope[piece] * s + square[piece] * (s * s) + cubic[piece] * (s * s * s)
        )

    return curve


def _slopes(width: FloatArray, secant: FloatArray) -> FloatArray:
    """Slopes at the points: weighted harmonic means of the neighbouring secants."""
    if len(secant) == 1:
        return np.repeat(secant, 2)
    before, after = 2.0 * width[1:] + width[:-1], width[1:] + 2.0 * width[:-1]
    mean = (before / secant[:-1] + after / secant[1:]) / (before + after)
    first = _slope_at_end(width[0], width[1], secant[0], secant[1])
    last = _slope_at_end(width[-1], width[-2], secant[-1], secant[-2])
    return np.concatenate([[first], 1.0 / mean, [last]])


def _slope_at_end(width: float, next_width: float, secant: float, next_secant: float) -> float:
    """Of the parabola through the last three points, where it rises at the end; else none."""
    slope = ((2.0 * width + next_width) * secant - width * next_secant) / (width + next_width)
    return max(slope, 0.0)


@lru_cache(maxsize=16)
def _curve(
    force_n: tuple[float, ...], deflection_m: tuple[float, ...]
) -> Callable[[FloatArray], FloatArray]:
    """The monotone curve through the rows and through 0 m at 0 N."""
    return rising_curve(np.array([0.0, *force_n]), np.array([0.0, *deflection_m]))


@dataclass(frozen=True, slots=True)
class DeflectionTable:
    """Deflection of the system over force.

    Below the first row it goes straight to 0 at 0 N, between the rows it is monotone (PCHIP),
    beyond the last one straight on with the slope of the last two.

    Attributes:
        force_n: (M,) forces, rising, above 0.
        deflection_m: (M,) deflection there, rising, above 0.
        sigma_m: (M,) standard uncertainty of each row, correlated over the correlation length of
            the smooth error; an error proportional to the whole table is not included.
    """

    force_n: tuple[float, ...]
    deflection_m: tuple[float, ...]
    sigma_m: tuple[float, ...]

    def __post_init__(self) -> None:
        if problem := table_problem(self.force_n, self.deflection_m, self.sigma_m):
            raise DomainError(f"table of the system's deflection: {problem}")

    def at(self, force_n: FloatArray) -> FloatArray:
        """Deflection (N,) in m at forces (N,); odd in the force, so that a pull mirrors a push."""
        size, last_n = np.abs(np.asarray(force_n, dtype=np.float64)), self.force_n[-1]
        inside = _curve(self.force_n, self.deflection_m)(np.minimum(size, last_n))
        further = np.maximum(size - last_n, 0.0) * self._last_slope
        return np.asarray(np.sign(force_n) * (inside + further))

    def sigma_at(self, force_n: FloatArray) -> FloatArray:
        """Standard uncertainty (N,) in m at forces (N,); beyond the rows that of the nearest."""
        return np.asarray(np.interp(np.abs(force_n), self.force_n, self.sigma_m))

    def uncovered_sigma_at(self, force_n: FloatArray) -> FloatArray:
        """Standard uncertainty (N,) in m where no row is near, fully correlated; elsewhere 0.

        Beyond the last row the slope counts as known to `ASSUMED_RELATIVE`, or to the difference of
        the last slope and the mean one. Below a first row above `BEGINS` of the largest force, that
        share of its deflection may be a bow.
        """
        size, first_n, last_n = np.abs(force_n), self.force_n[0], self.force_n[-1]
        mean = self.deflection_m[-1] / last_n
        bent = max(ASSUMED_RELATIVE * mean, abs(self._last_slope - mean) / math.sqrt(3.0))
        found = np.maximum(size - last_n, 0.0) * bent
        if REACHED * first_n > BEGINS * float(size.max(initial=0.0)):
            u = np.minimum(size / first_n, 1.0)
            found = found + ASSUMED_RELATIVE * self.deflection_m[0] * 4.0 * u * (1.0 - u)
        return np.asarray(found)

    @property
    def _last_slope(self) -> float:
        """Slope of the last two rows in m/N; the origin counts as a row."""
        before_n, before_m = (0.0, *self.force_n)[-2], (0.0, *self.deflection_m)[-2]
        return (self.deflection_m[-1] - before_m) / (self.force_n[-1] - before_n)

    def beyond(self, peak_force_n: float) -> str:
        """A remark on this table at a peak force; "" where its rows cover it."""
        last_n, first_n = self.force_n[-1], self.force_n[0]
        if REACHED * first_n > BEGINS * peak_force_n:
            return (
                f"the table of the system's deflection begins at {first_n:.4g} N, above a quarter "
                f"of the {peak_force_n:.4g} N of the data: below its first row nobody has looked"
            )
        if peak_force_n <= BEYOND * last_n:
            return ""
        return (
            f"the table of the system's deflection ends at {last_n:.4g} N, the data reach "
            f"{peak_force_n:.4g} N: beyond it the slope of its last rows was taken"
        )
