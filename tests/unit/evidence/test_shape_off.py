"""A best law that has no deformation along the chord."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from stepload.evidence.shape import _off

from stepload.errors import DomainError


@pytest.mark.parametrize("slope", [-1.0, 0.0])
def test_a_law_that_goes_back_where_the_force_grows_is_no_law(slope: float) -> None:
    best = SimpleNamespace(shape=0.0, coefficients=np.array([slope]))
    fit: Any = SimpleNamespace(
        best=best,
        gradient=lambda _shape, force_n: np.array([force_n]),
        law=SimpleNamespace(name="x"),
    )
    main: Any = SimpleNamespace(to_n=3.0, from_n=1.0, span_m=2.0)
    with pytest.raises(DomainError, match="no deformation along the chord"):
        _off(fit, main)
    best.coefficients = np.array([1.0])
    assert _off(fit, main) == 0.0
