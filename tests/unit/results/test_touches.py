"""How well touches repeat, in words."""

from __future__ import annotations

import math

from stepload.results.levels import touch_repeatability
from stepload.results.press_data import TouchPoint


def told(*positions_m: float) -> str:
    touches = [
        TouchPoint(
            time_s=float(i),
            position_m=at_m,
            force_n=5.0,
            cycle=1,
            purpose="again" if i else "first",
            travel_m=0.0,
        )
        for i, at_m in enumerate(positions_m)
    ]
    return touch_repeatability(touches, math.nan)


def test_touches_at_one_position_have_no_spread_of_zero() -> None:
    assert "0 m" not in told(4e-3, 4e-3, 4e-3)
    spread = told(4e-3, 4.001e-3, 4.002e-3)
    assert "1 µm" in spread
    assert "2 µm" in spread
