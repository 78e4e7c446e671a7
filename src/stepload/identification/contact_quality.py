"""How the contact of one run was made: lateral force, slip, and the place of the contact.

With r from the sensor's origin to the place on the pressing axis at the contact's height and e from
there to the contact, T = (r + e) × f. Of the two torques across the axis this leaves e (six axes,
item 4), whatever the force across.

A slip is a jump of the lateral force that no change of the load explains. That force follows the
load with the running ratio r of the two; its deviation from that over 40 ms is compared with the
noise and with a share of the load (six axes, item 5)::

    |ΔF_across - r ΔF| > max(6 σ √(2/k), 1 % of F)        means over k samples, 8 ms
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stepload.identification.fit import FloatArray, Missing

LEAST_SHARE = 0.1
"""Below this share of the top force no lateral share is taken: a small force makes any ratio."""
MEAN_S, COMPARED_S, LASTS_S = 0.008, 0.04, 0.006
RATIO_S = 0.3
"""Time before a sample over which the ratio r is taken."""
SIGMAS, SHARE = 6.0, 0.01
LEAST_SLIP_SHARE = 0.02
"""Below this share of the top force slips are not looked for: a touch is no slip."""
STEADY = 0.5
"""Largest change just before and after a jump, as a part of the jump."""
OFF_AXIS_M = 2e-3
"""Largest distance of a contact from the pressing axis without a warning."""
HIGH_SHARE = 0.3
"""Only holds above this share of the largest force are compared with one another."""
APART, LEAST_APART_M = 3.0, 5e-4
"""Least scatter of the places that puts the lever on the other side: over that with that lever, and
in m."""
NO_HOLDS = "where the plate is touched is not known: there is no hold"
OTHER_SIDE = (
    "where the plate is touched is not known: the torques fit a contact on the other side of the "
    "force sensor; it tells the force that it exerts, or axis or lever are wrong"
)
NOT_IN_DATA = "not in the data: the force sensor tells nothing across the pressing axis"
NO_LEVER = "where the plate is touched is not known: rig.force.lever is not stated"
NO_TORQUE = "where the plate is touched is not in the data: the force sensor tells no torque"
LEAST_SAMPLES = 20


@dataclass(frozen=True, slots=True)
class Wrench:
    """Samples in contact, (N,) each, in the order of time; zeros taken out.

    Attributes:
        force_n: along the pressing axis, positive when pressing.
        across_n: (N, 2) force along the sensor's two other axes, in the order x, y, z.
        rising: whether a sample belongs to a loading; else it belongs to an unloading.
        held: number of the hold that a sample lies in, 0 between holds.
        noise_n: standard deviation of one reading across, of each of the two.
        torque_n_m: (N, 2) torque about the same two axes; None where the sensor measures none.
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


class Slip(NamedTuple):
    """One slip event: its time, the axial force in N, and the jump of the lateral force in N."""

    time_s: float
    force_n: float
    jump_n: float
    cycle: int
    rising: bool


class BranchShare(NamedTuple):
    """Lateral over axial force of one branch: (2,) for the sensor's two axes across, with sign."""

    cycle: int
    rising: bool
    share: FloatArray

    @property
    def size(self) -> float:
        """Size of the share."""
        return float(np.hypot(*self.share))


class ContactPoint(NamedTuple):
    """Where the plate was touched, in m along the sensor's two axes across in the order x, y, z.

    `sigma_m` is the standard uncertainty of each by noise alone; an error of the lever, times the
    lateral share, adds to it.
    """

    force_n: float
    beside_m: tuple[float, float]
    sigma_m: float

    @property
    def size_m(self) -> float:
        """Distance from the axis."""
        return math.hypot(*self.beside_m)


@dataclass(frozen=True, slots=True)
class ContactQuality:
    """How the contact of one run was made.

    Attributes:
        branches: the lateral share, branch by branch, the first loading first. Where it differs
            between loading and unloading, the contact slides, or its edge slips.
        slips: detected slip events, in the order of time.
        unseen_n: the smallest jump at the top force that is certain to be detected.
        place: of the contact in the loading's hold of largest force; `Missing` gives the reason
            where it is not known.
    """

    branches: tuple[BranchShare, ...]
    slips: tuple[Slip, ...]
    undetected_n: float
    place: ContactPoint | Missing


def contact_quality(wrench: Wrench | None, lever_m: float | None) -> ContactQuality | Missing:
    """Evaluate how the contact of a run was made.

    Args:
        wrench: its samples in contact; None where the sensor has one axis only.
        lever_m: from the sensor's origin to the contact; None where it is not stated.
    """
    if wrench is None:
        return Missing(NOT_IN_DATA)
    wrench = wrench.finite()
    top_n = float(wrench.force_n.max()) if wrench.force_n.size else 0.0
    if wrench.force_n.size < LEAST_SAMPLES or not top_n > 0.0:
        return Missing("not in the data: too few samples in contact")
    branches = _shares(wrench, top_n)
    if not branches or not branches[0].rising:
        return Missing("not in the data: there is no loading")
    period_s = float(np.median(np.diff(wrench.time_s)))
    undetected_n = smallest_seen_n(wrench.noise_n, period_s, top_n) if period_s > 0.0 else math.inf
    return ContactQuality(branches, slips_of(wrench, top_n), undetected_n, _place(wrench, lever_m))


def _shares(wrench: Wrench, top_n: float) -> tuple[BranchShare, ...]:
    """The shares of every branch, loading before unloading."""
    found = []
    high = wrench.force_n >= LEAST_SHARE * top_n
    for cycle in np.unique(wrench.cycle).tolist():
        for rising in (True, False):
            mask = high & (wrench.cycle == cycle) & (wrench.rising == rising)
            if mask.any():
                share = wrench.across_n[mask].sum(axis=0) / wrench.force_n[mask].sum()
                found.append(BranchShare(int(cycle), rising, share))
    return tuple(found)


def _place(wrench: Wrench, lever_m: float | None) -> ContactPoint | Missing:
    """Place of the contact in the loading's hold of largest force.

    The sensor is assumed to report the force that acts on it. For one that reports the force that
    it exerts, the lever is on the other side: where the lateral share varies, the places computed
    with that lever scatter less, and `Missing` is returned.

    Args:
        lever_m: from the sensor's origin to the contact along the pressing axis.
    """
    if wrench.torque_n_m is None:
        return Missing(NO_TORQUE)
    if not lever_m:
        return Missing(NO_LEVER)
    held = np.where(wrench.force_n > 0.0, wrench.held, 0)
    numbers, where, count = np.unique(held, return_inverse=True, return_counts=True)
    used = numbers > 0

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(where, values) / count)[used]

    along, rising = mean(wrench.force_n), mean(wrench.rising.astype(float)) > 0.5
    if not rising.any():
        return Missing(NO_HOLDS)
    (fx, fy), (tx, ty) = (map(mean, each.T) for each in (wrench.across_n, wrench.torque_n_m))

    def places(lever: float) -> FloatArray:
        turn = wrench.turn / along
        return np.stack([-turn * (ty - lever * fx), turn * (tx + lever * fy)], axis=1)

    lever = -wrench.turn * lever_m
    beside, other = places(lever), places(-lever)
    noise_n_m = math.hypot(wrench.torque_noise_n_m, lever_m * wrench.noise_n)
    sigma = noise_n_m / (along * np.sqrt(count[used]))
    high = along > HIGH_SHARE * float(along.max())
    scatter, of_other = (float(np.hypot(*each[high].std(axis=0))) for each in (beside, other))
    if scatter > max(APART * of_other, LEAST_APART_M, SIGMAS * float(sigma[high].max())):
        return Missing(OTHER_SIDE)
    best = int(np.argmax(np.where(rising, along, 0.0)))
    x, y = beside[best].tolist()
    return ContactPoint(float(along[best]), (x, y), float(sigma[best]))


class _Windows(NamedTuple):
    """Lengths in samples: of a mean, of the comparison, of a row, of the ratio."""

    mean: int
    apart: int
    row: int
    ratio: int


def _windows(period_s: float) -> _Windows:
    mean, apart, row, ratio = (
        round(each_s / period_s) for each_s in (MEAN_S, COMPARED_S, LASTS_S, RATIO_S)
    )
    mean = max(mean, 1)
    return _Windows(mean, max(apart, 2 * mean, 2), max(row, 1), max(ratio, 4))


def smallest_seen_n(noise_n: float, period_s: float, force_n: float) -> float:
    """The smallest jump in N that is certain to be detected at an axial force."""
    own = noise_n * math.sqrt(2.0 / _windows(period_s).mean)
    return max(SIGMAS * own, SHARE * force_n) + 2.0 * own


def slips_of(wrench: Wrench, top_n: float) -> tuple[Slip, ...]:
    """Every slip event, in the order of time.

    Evaluated branch by branch: where the load reverses, friction does too, without a jump.
    """
    found: list[Slip] = []
    steps_s = np.diff(wrench.time_s)
    usual_s = float(np.median(steps_s)) if steps_s.size else 0.0
    if not usual_s > 0.0:
        return ()
    new = (np.diff(wrench.cycle) != 0) | (np.diff(wrench.rising.view(np.int8)) != 0)
    new |= steps_s > 10.0 * usual_s
    edges = [0, *(np.flatnonzero(new) + 1).tolist(), wrench.time_s.size]
    windows = _windows(usual_s)
    for begin, end in pairwise(edges):
        found += _in_branch(wrench, slice(begin, end), windows, LEAST_SLIP_SHARE * top_n)
    return tuple(found)


def _in_branch(wrench: Wrench, part: slice, w: _Windows, least_n: float) -> Iterator[Slip]:
    time_s, force_n = wrench.time_s[part], wrench.force_n[part]
    last = force_n.size - w.mean - w.apart
    if last < w.row:
        return
    columns = np.column_stack([force_n, wrench.across_n[part]])
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(columns, axis=0)])
    means = (sums[w.mean :] - sums[: -w.mean]) / w.mean
    change = means[w.apart :] - means[: -w.apart]
    begins = np.maximum(np.arange(change.shape[0]) + w.mean - w.ratio, 0)
    before = sums[w.mean : w.mean + change.shape[0]] - sums[begins]
    load_n = means[w.apart :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(before[:, :1] > 0.0, before[:, 1:] / before[:, :1], 0.0)
    left = change[:, 1:] - ratio * change[:, :1]
    size = np.hypot(left[:, 0], left[:, 1])
    noise = wrench.noise_n * np.sqrt(2.0 / w.mean) * np.hypot(1.0, np.hypot(*ratio.T))
    allowed = np.maximum(SIGMAS * noise, SHARE * load_n)
    over = (size > allowed) & (load_n > least_n) & (means[: -w.apart, 0] > least_n)
    for begin, end in _rows_of(over, w.row):
        peak = begin + int(np.argmax(size[begin:end]))
        sides = left[max(peak - w.apart, 0)], left[min(peak + w.apart, size.size - 1)]
        beside = max(float(np.hypot(*each)) for each in sides)
        if beside > STEADY * size[peak]:
            continue  # it continues: a slide or a corner of the ramp, no jump
        quarter = (end - begin) // 4
        inner = left[begin + quarter : end - quarter].mean(axis=0)
        jump = float(np.hypot(*(inner - 0.5 * (sides[0] + sides[1]))))
        middle = peak + (w.mean + w.apart) // 2
        yield Slip(
            float(time_s[middle]), float(load_n[peak]), jump, int(wrench.cycle[part][0]),
            bool(wrench.rising[part][0]),
        )  # fmt: skip


def _rows_of(over: np.ndarray, least: int) -> Iterator[tuple[int, int]]:
    """Begin and end of every run of at least this many true values."""
    steps = np.flatnonzero(np.diff(over.view(np.int8), prepend=0, append=0))
    for begin, end in zip(steps[::2].tolist(), steps[1::2].tolist(), strict=True):
        if end - begin >= least:
            yield begin, end
