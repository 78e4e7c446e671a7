"""Magnitudes that no contact has: the unit of a column is wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from stepload.identification.curve_channels import plausibility

K, N, KS = 6.57e8, 1.5, 3.49e6
FORCE = np.linspace(1.0, 300.0, 50)
DEPTH = (FORCE / K) ** (1 / N)


@pytest.mark.parametrize(
    ("scale_m", "scale_n", "more", "word"),
    [
        (1e3, 1.0, {}, "deformed by 59.3 mm"),
        (1.0, 1e4, {}, "forces up to 3 MN"),
        (1.0, 1.0, {"travel_m": np.array([0.0, 5.0])}, "a travel of 5 m"),
        (1.0, 1.0, {"position_quantum_m": 1e-3}, "positions in steps of 1 mm"),
        (1.0, 1.0, {"force_quantum_n": 1e3}, "forces in steps of 1 kN"),
        (1e3, 1.0, {"theory_k": K, "theory_n": N}, "law gives 59.3 µm"),
        (1.0, 1e-3, {"theory_k": K, "theory_n": N}, "law gives 593 nm"),
        (1.0, 1e-3, {"system_stiffness_n_per_m": KS}, "K_s takes"),
        (1e2, 1.0, {"system_stiffness_n_per_m": 30 * KS}, "K_s takes"),
    ],
)  # fmt: skip
def test_wrong_units_are_doubted(
    scale_m: float, scale_n: float, more: dict[str, Any], word: str
) -> None:
    found = plausibility(scale_m * DEPTH, scale_n * FORCE, **more)
    assert any(word in doubt for doubt in found), found


def test_a_stated_payload_may_be_soft() -> None:
    force, soft = np.linspace(0.1, 20.0, 50), 1e4
    depth = (force / soft) ** (1 / N)
    assert any("deformed by 15.9 mm" in doubt for doubt in plausibility(depth, force))
    assert plausibility(depth, force, theory_k=2 * soft, theory_n=N) == ()
