"""How much of its elastic limit a lateral load leaves a payload."""

from __future__ import annotations

_STEPS = ((0.0, 1.0), (0.1, 0.98), (0.2, 0.93), (0.3, 0.83), (0.4, 0.59), (0.6, 0.20))
_LAST_SHARE, _LAST_LEFT = _STEPS[-1]


def limit_left(lateral_share: float) -> float:
    """g(t) = F_c(t)/F_c(0), t the lateral over the normal force; linear between the points.

    Hertz contact that slides fully, von Mises, ν = 0.3. Beyond the last point yield begins at the
    surface, where the lateral stress alone decides: F_c goes down as 1/t³.
    """
    if lateral_share >= _LAST_SHARE:
        return float(_LAST_LEFT * (_LAST_SHARE / lateral_share) ** 3)
    before, left = _STEPS[0]
    for share, then in _STEPS[1:]:
        if lateral_share < share:
            return left + (then - left) * (lateral_share - before) / (share - before)
        before, left = share, then
    return left
