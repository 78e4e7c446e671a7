"""Materials known only as a range: the softest and the stiffest body that they may be.

Every bound of a run must hold at both ends. It then also holds between them: n depends on the shape
only, and K increases with E_eq.
"""

from __future__ import annotations

from dataclasses import replace

from stepload.contact.materials import Material


def is_range(body: Material) -> bool:
    """Whether modulus or Poisson's ratio of a body is stated as a range."""
    return body.youngs_modulus_ends_pa is not None or body.poisson_ratio_ends is not None


def softest(body: Material) -> Material:
    """The body of the least E/(1 - ν²) that a material may be; itself where it is known."""
    low_pa, _ = body.youngs_modulus_ends_pa or (body.youngs_modulus_pa,) * 2
    low, high = body.poisson_ratio_ends or (body.poisson_ratio,) * 2
    return _known(body, low_pa, min(max(0.0, low), high))


def stiffest(body: Material) -> Material:
    """The body of the largest E/(1 - ν²) that a material may be; itself where it is known."""
    _, high_pa = body.youngs_modulus_ends_pa or (body.youngs_modulus_pa,) * 2
    ends = body.poisson_ratio_ends or (body.poisson_ratio,) * 2
    return _known(body, high_pa, max(ends, key=abs))


def _known(body: Material, modulus_pa: float, ratio: float) -> Material:
    """The material at one end: a range becomes its bound, without an uncertainty."""
    if not is_range(body):
        return body
    return replace(
        body,
        youngs_modulus_pa=modulus_pa,
        poisson_ratio=ratio,
        youngs_modulus_sigma_pa=(
            0.0 if body.youngs_modulus_ends_pa else body.youngs_modulus_sigma_pa
        ),
        poisson_ratio_sigma=0.0 if body.poisson_ratio_ends else body.poisson_ratio_sigma,
        youngs_modulus_ends_pa=None,
        poisson_ratio_ends=None,
    )
