"""Which fit is selected, why, and whether it compares with the paper."""

import numpy as np
import pytest

from stepload.identification.estimators import UNUSABLE, decide
from stepload.identification.fit import Doubt, Fit, Flag


def fit(
    name: str,
    *,
    n: float = 1.5,
    zero_m: float = 0.0,
    sigma_n: float | None = None,
    sigma_zero_m: float = 0.2e-6,
    flag: Flag | None = None,
) -> Fit:
    covariance = None
    if sigma_n is not None:
        covariance = np.diag([1e-4, sigma_n**2, sigma_zero_m**2])
    return Fit(
        estimator=name,
        k=6.57e8,
        n=n,
        zero_m=zero_m,
        secant_n_per_m=5.06e6,
        secant_force_n=300.0,
        covariance=covariance,
        force_rms_n=1.0,
        points=1000,
        doubts=() if flag is None else (Doubt(flag, f"{name}: {flag}"),),
    )


def table(*fits: Fit) -> dict[str, Fit]:
    return {each.estimator: each for each in fits}


PAPER = fit("rs_btls", n=1.32)
JOINT = fit("joint", n=1.49, zero_m=-3.9e-6, sigma_n=0.01)
KNOWN = fit("odr", n=1.31, sigma_n=0.01)


def test_detected_zero_believes_the_joint_fit() -> None:
    decision = decide(table(PAPER, JOINT, KNOWN))
    assert decision.selected == "joint"
    assert "-3.90 µm" in decision.why[0]
    assert not decision.comparable_with_paper
    assert "n = 1.49 against 1.32 of rs_btls" in decision.why[1]


@pytest.mark.parametrize("flag", [Flag.NOT_CONVERGED, Flag.ILL_CONDITIONED])
def test_unusable_joint_fit_falls_back_to_the_paper(flag: Flag) -> None:
    decision = decide(table(PAPER, fit("joint", flag=flag)))
    assert decision.selected == "rs_btls"
    assert decision.comparable_with_paper
    assert f"joint: {flag}" in decision.why[0]


@pytest.mark.parametrize("flag", sorted(UNUSABLE))
def test_where_nothing_is_usable_the_first_is_selected_with_its_doubt(flag: Flag) -> None:
    decision = decide(table(fit("odr", flag=flag), fit("joint", flag=flag)))
    assert decision.selected == "odr"
    assert [doubt.flag for doubt in decision.fits["odr"].doubts] == [flag]


def test_agreeing_fits_compare_with_the_paper() -> None:
    joint = fit("joint", n=1.33, zero_m=0.1e-6, sigma_n=0.01)
    decision = decide(table(PAPER, joint))
    assert decision.comparable_with_paper
    rough = decide(table(PAPER, joint), roughness_m=7.5e-6)
    assert not rough.comparable_with_paper
    assert "roughness (7.5 µm)" in rough.why[-1]


def test_covariance_of_the_residuals_stands_in() -> None:
    joint = fit("joint", n=1.5, sigma_n=0.2)
    assert Flag.EXPONENT_UNDETERMINED in [
        doubt.flag for doubt in decide(table(PAPER, joint)).fits["joint"].doubts
    ]
    assert (
        decide(table(PAPER, joint), covariance=np.diag([0.0, 1e-4, 0.0])).fits["joint"].doubts == ()
    )
