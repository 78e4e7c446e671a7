"""Plausibility of units: values of a file are doubted if they cannot be metres and newtons.

A wrong unit is a factor of a thousand, and no fit shows it: the law is a power, and the interval is
relative.
"""

from __future__ import annotations

import numpy as np

from stepload.estimators.fit import FloatArray
from stepload.units import format_quantity as f

THEORY_FACTOR = 5.0
"""Largest factor between the deformation and that of the payload's law without a doubt."""
LARGEST_DEFORMATION_M, LARGEST_TRAVEL_M = 0.01, 0.1
LARGEST_FORCE_N = 1e6
COARSEST_QUANTUM_M, COARSEST_QUANTUM_N = 1e-4, 1e3
LEAST_SYSTEM_SHARE = 0.005
"""A machine whose deflection is a smaller share of the travel may be left uncorrected."""


def plausibility(
    deformation_m: FloatArray,
    force_n: FloatArray,
    *,
    travel_m: FloatArray | None = None,
    system_stiffness_n_per_m: float | None = None,
    position_quantum_m: float = 0.0,
    force_quantum_n: float = 0.0,
    theory_k: float | None = None,
    theory_n: float | None = None,
) -> tuple[str, ...]:
    """Doubts about the magnitudes of a loading, one sentence each.

    Args:
        deformation_m, force_n: (N,) of the payload while it is pressed, from its touch.
        travel_m: the whole travel of the machine, with its approach.
        system_stiffness_n_per_m: K_s that was stated; None where there was none to state.
        position_quantum_m, force_quantum_n: steps of the channels; 0 where they have none.
        theory_k, theory_n: the payload's law (3) in N/m^n, where it is known: then it alone judges
            the deformation.
    """
    found: list[str] = []
    if not force_n.size:
        return ()
    top_n = float(force_n.max())
    at = int(force_n.argmax())
    deformed_m = float(deformation_m[at])
    if theory_k is not None and theory_n is not None:
        expected_m = (top_n / theory_k) ** (1.0 / theory_n) if top_n > 0.0 else 0.0
        if not expected_m / THEORY_FACTOR <= deformed_m <= expected_m * THEORY_FACTOR:
            found.append(
                f"{f(deformed_m, 'm')} of deformation at {f(top_n, 'N')}, where the payload's law "
                f"gives {f(expected_m, 'm')}: is the unit of a column wrong, or the payload?"
            )
    elif deformed_m > LARGEST_DEFORMATION_M:
        found.append(
            f"the payload is deformed by {f(deformed_m, 'm')}: are these metres? State the "
            "payload (--payload), if its law gives as much"
        )
    span_m = 0.0 if travel_m is None else float(np.ptp(travel_m))
    if span_m > LARGEST_TRAVEL_M:
        found.append(f"a travel of {f(span_m, 'm')}: in metres?")
    if top_n > LARGEST_FORCE_N:
        found.append(f"forces up to {f(top_n, 'N')}: are these newtons?")
    if position_quantum_m >= COARSEST_QUANTUM_M:
        found.append(f"positions in steps of {f(position_quantum_m, 'm')}: are these metres?")
    if force_quantum_n >= COARSEST_QUANTUM_N:
        found.append(f"forces in steps of {f(force_quantum_n, 'N')}: are these newtons?")
    if system_stiffness_n_per_m is not None and theory_k is None:
        bent_m = top_n / system_stiffness_n_per_m
        share = bent_m / (bent_m + deformed_m) if deformed_m > 0.0 else 1.0
        if share < LEAST_SYSTEM_SHARE:
            found.append(
                f"K_s takes {f(bent_m, 'm')} of {f(bent_m + deformed_m, 'm')} of travel: is the "
                "unit of a column wrong? A machine so much stiffer need not be stated"
            )
    return tuple(found)
