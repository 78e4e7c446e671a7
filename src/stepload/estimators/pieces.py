"""A common zero for the pieces of a run, between which set, drift or a touch shifts the travel.

Travel has one zero for the whole run, and from cycle to cycle (or where a pause opened the contact)
it is shifted by what the contact has set and by what the machine has drifted. A fit of stiffness
over several pieces therefore has an intercept for each of them. The shifts are taken where two
pieces have cells of force in common, which is least squares with an intercept per piece and costs
no more than the cells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stepload.errors import DomainError
from stepload.estimators.fit import FloatArray

IntArray = NDArray[np.integer]


def piece_shifts(
    displacement_m: FloatArray, cell: IntArray, piece: IntArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Shift of each sample's piece against the piece with most cells.

    Args:
        displacement_m: (N,) travel.
        cell: (N,) cell of force (and of motion) that the sample belongs to.
        piece: (N,) number of the piece of the run that it belongs to.

    Returns:
        Shift (N,) in m, and (N,) whether it is known: a piece that shares no cell with the one that
        has most of them cannot be placed.

    Raises:
        DomainError: arrays of different lengths.
    """
    if not displacement_m.shape == cell.shape == piece.shape:
        raise DomainError(
            f"travel {displacement_m.shape}, cells {cell.shape} and pieces {piece.shape} must have "
            "one and the same length"
        )
    _, cells = np.unique(cell, return_inverse=True)
    numbers, pieces = np.unique(piece, return_inverse=True)
    shape = numbers.size, int(cells.max(initial=0)) + 1
    flat = np.ravel_multi_index((pieces, cells), shape)
    count = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)
    total = np.bincount(flat, displacement_m, minlength=shape[0] * shape[1]).reshape(shape)
    mean = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    # Of equals the first: the zero of the run is that of its first piece.
    reference = mean[int(np.argmax((count > 0).sum(axis=1)))]
    shared = np.isfinite(mean) & np.isfinite(reference)
    known = shared.any(axis=1)
    apart = np.where(shared, mean - reference, 0.0).sum(axis=1) / np.maximum(shared.sum(axis=1), 1)
    return np.asarray(apart[pieces]), np.asarray(known[pieces])
