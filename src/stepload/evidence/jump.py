"""A jump of the deformation at one force of a loading: a slip, a click, a gauge that was pushed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from stepload.evidence.elastic import Elastic
from stepload.evidence.lawfit import LawFit, Whitened
from stepload.evidence.loops import Branch

CHI2 = 25.0
"""χ² that a jump must explain: of noise alone one in 30,000 loadings of 50 places shows one."""

NEAR = 0.1
"""A jump lies in a hold whose force is within this share of its own."""


class Jump(NamedTuple):
    """Size in m, and the force it lies at."""

    size_m: float
    at_n: float


def jump_of(data: Whitened, fit: LawFit) -> Jump | None:
    """The jump that explains most of what a law leaves; None where none does.

    A step is fitted beside the law at every place of the loading.

    Args:
        data: a loading, in the order of time.
        fit: the law that fits it best.
    """
    shape = fit.best.shape
    columns = data.columns(fit.law, [shape])[0]
    if fit.law.grid.size > 1:
        step = 1e-4 * max(shape, 1e-3)
        moved = fit.law.basis(data.u, shape + step) - fit.law.basis(data.u, shape)
        own = moved @ fit.best.coefficients[1:] / (step * data.scale_m)
        columns = np.column_stack([columns, data.whiten(own * data.scale_m)])
    size = data.u.size
    steps = data.whiten(np.tril(np.ones((size, size)))[:, 1:-1] * data.scale_m)
    basis = np.linalg.qr(columns / np.linalg.norm(columns, axis=0))[0]
    left = data.y - basis @ (basis.T @ data.y)
    steps = steps - basis @ (basis.T @ steps)
    square = np.einsum("ij,ij->j", steps, steps)
    along = left @ steps
    explained = np.where(square > 1e-9, along**2 / np.maximum(square, 1e-9), 0.0)
    at = int(np.argmax(explained))
    if not explained[at] > CHI2:
        return None
    return Jump(float(along[at] / square[at]) * data.scale_m, float(data.u[at + 1]) * data.top_n)


def usual_creep(branch: Branch, elastic: Elastic, at_n: float) -> float:
    """What the hold at a force creeps in m if it does as most of the branch's, over what the
    deformation has risen since the hold before; 0 where none is."""
    forces = np.array([hold.force_n for hold in branch.holds])
    near = np.flatnonzero(np.abs(forces - at_n) < NEAR * at_n)
    if not near.size:
        return 0.0
    rises = np.maximum(np.diff(elastic.deformation(forces), prepend=0.0), 1e-12)
    compliance = elastic.compliance(forces).tolist()
    crept = [hold.creep(each) for hold, each in zip(branch.holds, compliance, strict=True)]
    return float(np.median(np.array(crept) / rises) * rises[near].max())
