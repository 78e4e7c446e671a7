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

UNITS_NM = {
    "lbfin": 0.1129848290276167,
    "lbfft": 1.3558179483314004,
    "Nm": 1.0,
    "Nmm": 1e-3,
    "kgfcm": 0.0980665,
    "kNm": 1000.0,
}
"""Newton metre per unit; devices write them with or without a hyphen, dot or blank."""
