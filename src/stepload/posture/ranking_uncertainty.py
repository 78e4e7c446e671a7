"""Reliability of a ranking that is based on assumed joint stiffness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from stepload.estimators.fit import FloatArray
from stepload.plan.kinematics import JOINTS
from stepload.posture.compliance import compliance, gives_way
from stepload.posture.search import Poses

WRONG_BY = 2.0
"""Factor by which every joint may be softer or stiffer than assumed, independently."""
DRAWS, RANKINGS = 4000, 200
FEW, MANY = 10, 2000
UPPER = 97.5
"""Percentile: the upper end of a 95 % interval."""


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


@dataclass(frozen=True, slots=True)
class Ranking:
    """Agreement of a ranking by assumed joint stiffness with rankings by wrong ones.

    Attributes:
        stiffness, stiffness_worst: rank correlation of K_zz, median and 5 % case of all draws.
        share: median rank correlation of the stuck share.
        off_by: K_zz of the drawn arms over the assumed one, 5 % and 95 % of all poses and draws.
        top_tenth: K_zz of the poses assumed to be the stiffest tenth over the median of all, as
            drawn: median over them, 5 % case of all draws.
    """

    stiffness: float
    stiffness_worst: float
    share: float
    off_by: tuple[float, float]
    top_tenth: float


def ranking(poses: Poses, stiffness: FloatArray, press: FloatArray) -> Ranking | None:
    """Compare rankings for arms of other joint stiffness; None for fewer than ten poses.

    Of very many poses only an evenly spaced part is used.
    """
    jacobians = poses.jacobian[:: 1 + len(poses.jacobian) // MANY]
    if len(jacobians) < FEW:
        return None
    assumed = gives_way(compliance(jacobians, stiffness), press, flat=False)
    top = assumed.free_n_per_m >= np.percentile(assumed.free_n_per_m, 90)
    by_stiffness, by_share, off_by, best = [], [], [], []
    for each in factors(RANKINGS):
        drawn = gives_way(compliance(jacobians, stiffness * each), press, flat=False)
        by_stiffness.append(spearmanr(drawn.free_n_per_m, assumed.free_n_per_m).statistic)
        by_share.append(spearmanr(drawn.stuck_share, assumed.stuck_share).statistic)
        off_by.append(drawn.free_n_per_m / assumed.free_n_per_m)
        best.append(np.median(drawn.free_n_per_m[top]) / np.median(drawn.free_n_per_m))
    low, high = np.percentile(off_by, (5, 95))
    return Ranking(
        float(np.median(by_stiffness)), float(np.percentile(by_stiffness, 5)),
        float(np.median(by_share)), (float(low), float(high)), float(np.percentile(best, 5)),
    )  # fmt: skip
