"""Lateral share (force across the pressing axis over axial force) while loading and unloading.

It shows friction. Where a contact slides both ways, the share differs between the way up and the
way down: a loop. The same happens where a contact sticks in its middle and slips at its edge. A
share that is the same both ways and at every force may be a contact that slides one way from its
first touch on, or an arm that gives way sideways, or a plate that is not square to the axis: one
press cannot distinguish them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.estimators.wrench import Wrench

PLACES = 10
"""Number of forces at which a share is computed, evenly spaced from the least force to the top."""
LEAST_SHARE = 0.1
"""Below this share of the top force no share is computed: a small force makes any ratio."""
SIGMAS = 4.0
LOOP, LOOP_OF_SHARE = 0.01, 0.25
"""Largest difference of the shares at half the top force that is not yet a loop: absolute, and
relative to the larger share. Of contacts that slid in simulation 95 % had above 0.3."""
NEIGHBOURS, PLATEAU = 3, 0.1
"""A sliding share is constant over this many neighbouring forces, within this part of the
difference of the two branches."""
NOTICED = 0.02
"""Shares below this are not reported: tilt and mounting of a good rig cause as much."""
SAME = 0.25
"""A share whose scatter over the forces is below this part of itself is called constant."""
TILT_SIGMA_RAD = math.radians(0.64)
"""Error of the half sum of both sliding angles at 5 N in simulation (six axes, item 6); at 10 N
0.45 degrees."""

Kind = Literal["little", "slides", "loop", "constant", "changes"]


@dataclass(frozen=True, slots=True)
class BranchShare:
    """The share of one branch of one cycle.

    Attributes:
        cycle: its number; `rising` whether it is the loading.
        force_n: (P,) the forces in N at which it is computed.
        share: (P, 2) for the sensor's two axes across, with sign; NaN where nothing was measured.
        sigma: (P,) standard uncertainty of each of the two components, from noise alone.
    """

    cycle: int
    rising: bool
    force_n: FloatArray
    share: FloatArray
    sigma: FloatArray

    @property
    def median(self) -> FloatArray:
        """(2,) the median of each component over the forces; NaN without one."""
        known = self.share[np.isfinite(self.share).all(axis=1)]
        return np.median(known, axis=0) if known.size else np.full(2, np.nan)

    @property
    def size(self) -> float:
        """Size of the median share."""
        return float(np.hypot(*self.median))

    def at_half(self) -> tuple[FloatArray, float]:
        """Share (2,) and its uncertainty at half the top force; NaN where it was not measured."""
        place = int(np.argmin(np.abs(self.force_n - 0.5 * self.top_n)))
        return self.share[place], float(self.sigma[place])

    @property
    def top_n(self) -> float:
        """The top force for which the places were chosen."""
        return float(self.force_n[-1] + 0.5 * (self.force_n[1] - self.force_n[0]))


@dataclass(frozen=True, slots=True)
class Loop:
    """Comparison of the shares while loading and while unloading in the first cycle.

    Attributes:
        kind: "little": below 2 %; "slides": the branches differ, and each keeps its share over
            neighbouring forces, which is friction that slides both ways; "loop": the branches
            differ at half the top force, as where a contact slides or where its edge slips while
            it sticks; "constant": the same share at all forces both ways, which is sliding
            from first contact on or coupling of the arm, tilt or mounting; "changes": neither.
        at_half: size of the difference of both branches' shares at half the top force; None
            without an unloading.
        sigma: its standard uncertainty by noise alone.
        tilt_bound_rad: where the contact slid both ways: an angle that tilt of the plate and
            mounting of the sensor together do not exceed along the direction of sliding (95 %, for
            a friction that is the same both ways). None where nothing can be said.
    """

    kind: Kind
    at_half: float | None
    sigma: float
    tilt_bound_rad: float | None


def branch_shares(wrench: Wrench, top_n: float) -> list[BranchShare]:
    """The shares of every branch, loading before unloading.

    Args:
        wrench: samples in contact, finite.
        top_n: the largest force of the run in N, above 0.
    """
    edges = np.linspace(LEAST_SHARE * top_n, top_n, PLACES + 1)
    place = np.searchsorted(edges, wrench.force_n, side="right") - 1
    place = np.where(wrench.force_n >= edges[-1], PLACES - 1, place)
    inside = place >= 0
    found = []
    for cycle in np.unique(wrench.cycle).tolist():
        for rising in (True, False):
            mask = inside & (wrench.cycle == cycle) & (wrench.rising == rising)
            if mask.any():
                found.append(_branch(wrench, place, mask, edges, int(cycle), rising=rising))
    return found


def _branch(
    wrench: Wrench, place: np.ndarray, mask: np.ndarray, edges: FloatArray, cycle: int, *,
    rising: bool,
) -> BranchShare:  # fmt: skip
    where = place[mask]
    count = np.bincount(where, minlength=PLACES).astype(float)
    along = np.bincount(where, wrench.force_n[mask], PLACES)
    across = [np.bincount(where, wrench.across_n[mask, axis], PLACES) for axis in (0, 1)]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.stack(across, axis=1) / along[:, None]
        sigma = wrench.noise_n * np.sqrt(count) / along
    share[count == 0.0] = np.nan
    return BranchShare(cycle, rising, 0.5 * (edges[1:] + edges[:-1]), share, sigma)


def loop_of(branches: list[BranchShare]) -> Loop | None:
    """Compare the branches of the first cycle; None without its loading."""
    first = [branch for branch in branches if branch.cycle == branches[0].cycle]
    up = next((branch for branch in first if branch.rising), None)
    down = next((branch for branch in first if not branch.rising), None)
    if up is None:
        return None
    at_half, sigma = None, 0.0
    if down is not None:
        (one, u_one), (other, u_other) = up.at_half(), down.at_half()
        sigma = math.hypot(u_one, u_other)
        if np.isfinite(one).all() and np.isfinite(other).all():
            at_half = float(np.hypot(*(one - other)))
            larger = max(float(np.hypot(*one)), float(np.hypot(*other)))
            if at_half > max(SIGMAS * sigma, LOOP, LOOP_OF_SHARE * larger):
                both = _both_ways(up, down)
                if both is None:
                    return Loop("loop", at_half, sigma, None)
                return Loop("slides", at_half, sigma, _tilt_bound(*both))
    known = up.share[np.isfinite(up.share).all(axis=1)]
    noise = float(np.nanmedian(up.sigma)) if known.size else 0.0
    if not up.size > max(SIGMAS * noise, NOTICED):
        return Loop("little", at_half, sigma, None)
    scatter = float(np.hypot(*known.std(axis=0)))
    kind: Kind = "constant" if scatter < max(SAME * up.size, 2.0 * noise) else "changes"
    return Loop(kind, at_half, sigma, None)


def _both_ways(up: BranchShare, down: BranchShare) -> tuple[FloatArray, FloatArray] | None:
    """Shares of both branches, where each is constant over neighbouring forces, that differ most.

    The shares of a sticking contact vary with the force; they pass through those of sliding.
    """
    best, most = None, 0.0
    for first in range(PLACES - NEIGHBOURS + 1):
        here = slice(first, first + NEIGHBOURS)
        one, other = up.share[here].mean(axis=0), down.share[here].mean(axis=0)
        width = float(np.hypot(*(one - other)))
        moved = max(float(np.hypot(*np.ptp(branch.share[here], axis=0))) for branch in (up, down))
        if width > most and moved < PLATEAU * width:
            best, most = (one, other), width
    return best


def _tilt_bound(up: FloatArray, down: FloatArray) -> float | None:
    """(atan r+ + atan r-)/2 along the direction in which the shares differ, and its uncertainty.

    Only where the friction has reversed: the shares have opposite signs.
    """
    direction = (up - down) / float(np.hypot(*(up - down)))
    forth, back = float(up @ direction), float(down @ direction)
    if not back < 0.0 < forth:
        return None
    middle = 0.5 * (math.atan(forth) + math.atan(back))
    return abs(middle) + 2.0 * TILT_SIGMA_RAD


def change_of_share(branches: list[BranchShare]) -> tuple[float, float] | None:
    """Size of the change of the loading's share from cycle 1 to 2, and its uncertainty.

    Over the upper half of the forces: below, a contact that stays closed between the cycles still
    has the friction of the unloading. None without a second loading.
    """
    loadings = [branch for branch in branches if branch.rising]
    if len(loadings) < 2:
        return None
    one, other = loadings[0], loadings[1]
    high = one.force_n > 0.5 * one.top_n
    apart = other.share[high] - one.share[high]
    known = np.isfinite(apart).all(axis=1)
    if not known.any():
        return None
    sigma = np.hypot(one.sigma[high], other.sigma[high])[known]
    middle = np.median(apart[known], axis=0)
    return float(np.hypot(*middle)), float(sigma.max())
