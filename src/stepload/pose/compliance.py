"""Compliance of an arm at its tip, C = J diag(1/k) Jᵀ, and its effect on a press.

Only the joints are compliant here. Links, bearings, tool, sensor and plate are too: a real load
path is softer than its arm.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stepload.identification.fit import FloatArray, IntArray
from stepload.plan.kinematics import JOINTS

WRONG_BY = 2.0
"""Factor by which every joint may be softer or stiffer than assumed, independently."""
DRAWS = 4000
UPPER = 97.5
"""Percentile: the upper end of a 95 % interval."""
_SOFTEST = 1e-12
_FLATTEST = 1e-9
"""Sideways compliance below this share of the largest counts as zero: no motion that way."""


def compliance(jacobian: FloatArray, stiffness: FloatArray) -> FloatArray:
    """C (..., 6, 6) of Jacobians (..., 6, 6) and joint stiffnesses (..., 6) in N·m/rad.

    Motion of the tip (m, rad) per load on it (N, N·m), in the base.
    """
    return (jacobian / stiffness[..., None, :]) @ np.swapaxes(jacobian, -1, -2)


@dataclass(frozen=True, slots=True)
class GivesWay:
    """Stiffness of an arm in a press along `press`; arrays (...,).

    Attributes:
        free_n_per_m: K_zz = 1/C_zz: force over travel while the tip may slide sideways.
        stuck_n_per_m: the same while the tip is held sideways, [C⁻¹]_zz of the three translations.
        flat_n_per_m: the same of a flat contact, whose rotation is held too, [C⁻¹]_zz of all six.
        sideways: sideways over axial motion while the tip may slide.
        tilt_rad_per_n: tilt of the tool per newton, about axes across the press.
        stuck_share: |f_xy|/f_z while the tip is held: below this friction coefficient it slides.
    """

    free_n_per_m: FloatArray
    stuck_n_per_m: FloatArray
    flat_n_per_m: FloatArray
    sideways: FloatArray
    tilt_rad_per_n: FloatArray
    stuck_share: FloatArray

    @property
    def stuck_ratio(self) -> FloatArray:
        """K_stuck/K_zz, at least 1."""
        return self.stuck_n_per_m / self.free_n_per_m

    @property
    def flat_ratio(self) -> FloatArray:
        """K_flat/K_zz, at least K_stuck/K_zz."""
        return self.flat_n_per_m / self.free_n_per_m

    def at(self, index: int | IntArray) -> GivesWay:
        """One pose of many, or some."""
        return GivesWay(*(np.asarray(getattr(self, name))[index] for name in self.__slots__))


def gives_way(c: FloatArray, press: FloatArray) -> GivesWay:
    """The figures of compliance matrices (..., 6, 6) for a press along the unit vector (3,)."""
    across = _across(press)
    linear = c[..., :3, :3]
    axial = np.einsum("i,...ij,j->...", press, linear, press)
    coupled = np.einsum("ki,...ij,j->...k", across, linear, press)
    lateral = np.einsum("ki,...ij,lj->...kl", across, linear, across)
    held = _solved(lateral, coupled)
    tipped = np.einsum("ki,...ij,j->...k", across, c[..., 3:, :3], press)
    return GivesWay(
        free_n_per_m=1.0 / axial,
        stuck_n_per_m=1.0 / (axial - np.einsum("...k,...k->...", coupled, held)),
        flat_n_per_m=_held_whole(c, press),
        sideways=np.linalg.norm(coupled, axis=-1) / axial,
        tilt_rad_per_n=np.linalg.norm(tipped, axis=-1),
        stuck_share=np.linalg.norm(held, axis=-1),
    )


def _held_whole(c: FloatArray, press: FloatArray) -> FloatArray:
    """[C⁻¹]_zz of matrices (..., 6, 6); infinite where C cannot be inverted."""
    values, vectors = np.linalg.eigh(c)
    seen = np.einsum("...kl,k->...l", vectors[..., :3, :], press)
    least = _SOFTEST * values[..., -1:]
    return np.asarray(np.sum(seen**2 / np.maximum(values, least), axis=-1))


def _across(press: FloatArray) -> FloatArray:
    """Two unit vectors across `press`, shape (2, 3)."""
    first = np.cross(press, np.eye(3)[np.argmin(np.abs(press))])
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(press, first)])


def _solved(lateral: FloatArray, coupled: FloatArray) -> FloatArray:
    """lateral⁻¹ coupled, without the directions of zero compliance: no force is needed there."""
    values, vectors = np.linalg.eigh(lateral)
    seen = np.einsum("...kl,...k->...l", vectors, coupled)
    stiff = values < _FLATTEST * values[..., -1:]
    share = np.where(stiff, 0.0, seen / np.where(stiff, 1.0, values))
    return np.asarray(np.einsum("...kl,...l->...k", vectors, share))


def factors(draws: int, seed: int = 1) -> FloatArray:
    """Random factors of the joint stiffnesses, (draws, 6): independent, log-uniform."""
    most = np.log(WRONG_BY)
    return np.exp(np.random.default_rng(seed).uniform(-most, most, (draws, JOINTS)))


@dataclass(frozen=True, slots=True)
class Largest:
    """Upper ends of the 95 % intervals of the stiffening by a held contact, over joint stiffnesses.

    Attributes:
        stuck_ratio: K_stuck/K_zz, a tip held sideways.
        flat_ratio: K_flat/K_zz, a flat contact whose rotation is held too.
    """

    stuck_ratio: float
    flat_ratio: float


def largest(jacobian: FloatArray, stiffness: FloatArray, press: FloatArray) -> Largest:
    """The ratios of a pose (6, 6) with assumed joint stiffness (6,)."""
    drawn = gives_way(compliance(jacobian, stiffness * factors(DRAWS)), press)
    return Largest(
        float(np.percentile(drawn.stuck_ratio, UPPER)),
        float(np.percentile(drawn.flat_ratio, UPPER)),
    )
