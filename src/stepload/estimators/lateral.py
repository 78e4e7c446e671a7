"""Lateral force while in contact: its samples, and its share of the axial force.

The share shows friction. Where a contact slides both ways, or sticks in its middle and slips at its
edge, it differs between the way up and the way down: a loop. A share that is the same both ways may
be a contact that slides one way from its first touch on, an arm that gives way sideways, or a plate
that is tilted: one press cannot distinguish them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stepload.estimators.fit import FloatArray

PLACES = 10
"""Number of forces at which a share is computed, evenly spaced from the least force to the top."""
LEAST_SHARE = 0.1
"""Below this share of the top force no share is computed: a small force makes any ratio."""
SIGMAS, LOOP, LOOP_OF_SHARE = 4.0, 0.01, 0.25
"""Largest difference of the shares at half the top force that is not yet a loop: in standard
uncertainties, absolute, and relative to the larger share. Of contacts that slid in simulation 95 %
had above 0.3."""


@dataclass(frozen=True, slots=True)
class Wrench:
    """Samples in contact, (N,) each, in the order of time; zeros taken out.

    Attributes:
        time_s: in s, not falling.
        force_n: along the pressing axis, positive when pressing.
        across_n: (N, 2) force along the sensor's two other axes, in the order x, y, z.
        rising: whether a sample belongs to a loading; else it belongs to an unloading.
        cycle: number of the cycle.
        held: number of the hold that a sample lies in, 0 between holds.
        noise_n: standard deviation of one reading across, of each of the two.
        torque_n_m: (N, 2) torque about the same two axes; None where the sensor measures none.
        torque_noise_n_m: standard deviation of one reading of each.
        turn: +1 where the two axes and the direction of the plate's push are right-handed in this
            order, -1 where they are left-handed; see `turn_of`.
    """

    time_s: FloatArray
    force_n: FloatArray
    across_n: FloatArray
    rising: NDArray[np.bool_]
    cycle: NDArray[np.integer]
    held: NDArray[np.integer]
    noise_n: float
    torque_n_m: FloatArray | None = None
    torque_noise_n_m: float = 0.0
    turn: float = 1.0

    def finite(self) -> Wrench:
        """Without the samples that contain a non-finite number."""
        names = [name for name in self.__slots__ if isinstance(getattr(self, name), np.ndarray)]
        columns = [getattr(self, name).reshape(self.time_s.size, -1) for name in names]
        keep = np.isfinite(np.concatenate(columns, axis=1)).all(axis=1)
        return replace(self, **{name: getattr(self, name)[keep] for name in names})


def turn_of(axis: str) -> float:
    """Handedness of a pressing axis "+fx" … "-fz" and the two other axes in the order x, y, z."""
    sign = -1.0 if axis[0] == "-" else 1.0
    return -sign if axis[1:] == "fy" else sign


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
    """Difference of the shares while loading and while unloading in the first cycle.

    Attributes:
        at_half: its size at half the top force; None without an unloading.
        sigma: its standard uncertainty by noise alone.
        friction: whether it is a loop, as where a contact slides or its edge slips.
    """

    at_half: float | None
    sigma: float
    friction: bool


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
    if down is None:
        return Loop(None, 0.0, friction=False)
    (one, u_one), (other, u_other) = up.at_half(), down.at_half()
    sigma = math.hypot(u_one, u_other)
    apart = float(np.hypot(*(one - other)))
    if not math.isfinite(apart):
        return Loop(None, sigma, friction=False)
    larger = max(float(np.hypot(*one)), float(np.hypot(*other)))
    return Loop(apart, sigma, friction=apart > max(SIGMAS * sigma, LOOP, LOOP_OF_SHARE * larger))


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
