"""Gram matrices of a few long rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stepload.estimators.fit import FloatArray


def gram(rows: Sequence[FloatArray] | FloatArray) -> FloatArray:
    """The (m, m) dot products of m rows of L numbers.

    For m of 3 or 4 one by one takes a third of the time of `rows @ rows.T`.
    """
    size = len(rows)
    product = np.empty((size, size))
    for i, row in enumerate(rows):
        for j in range(i, size):
            product[i, j] = product[j, i] = row @ rows[j]
    return product
