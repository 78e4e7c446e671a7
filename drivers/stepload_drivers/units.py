"""Units used by instruments, in SI."""

from __future__ import annotations

UNITS_N = {
    "N": 1.0,
    "mN": 1e-3,
    "kN": 1e3,
    "gf": 9.80665e-3,
    "kgf": 9.80665,
    "lbf": 4.4482216152605,
    "klbf": 4448.2216152605,
}
"""Newton per unit, by standard gravity and the international pound."""
