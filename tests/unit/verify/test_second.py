"""The product and an implementation from the equations alone say the same of the same samples.

`python -m stepload_verify.trials.second` is the long form.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from stepload_verify.trials.second import agreements

OF_EACH_WORLD = 15


@pytest.fixture(scope="module")
def found() -> Mapping[str, np.ndarray]:
    return agreements(OF_EACH_WORLD)


@pytest.mark.parametrize(
    ("kind", "most", "rms", "narrowest", "widest"),
    [
        ("chord", 0.4, 0.2, 0.85, 1.1),
        ("secant_from_touch", 0.4, 0.2, 0.65, 1.1),
        ("tangent", 0.8, 0.4, 0.55, 1.1),
        ("n", 0.4, 0.2, 0.7, 1.2),
    ],
)
def test_values_and_intervals_agree(
    found: Mapping[str, np.ndarray], kind: str, most: float, rms: float, narrowest: float,
    widest: float,
) -> None:  # fmt: skip
    apart_most, apart_rms, _, ratio, _, *_ = found[kind]
    assert apart_most < most
    assert apart_rms < rms
    assert narrowest < ratio < widest


def test_both_hold_the_truth(found: Mapping[str, np.ndarray]) -> None:
    assert set(found) == {"chord", "secant_from_touch", "tangent", "n"}
    for each in found.values():
        _, _, _, _, _, of_product, of_second, *_ = each
        assert of_product >= 0.8
        assert of_second >= 0.8
