"""Factors of (10) and (15) on curves, against printed numbers and closed forms."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stepload.contact.limit import elastic_limit
from stepload.contact.materials import FlatPunch
from stepload.contact.plastic import ElasticPlasticSphere
from stepload.errors import BadInputError
from stepload.identification.ls import rs_btls
from stepload.plan.load import load_payload
from stepload.record.curves import Curve
from stepload.report.conditions import Stated
from stepload.report.from_file import results_of_file
from stepload.report.tip_factors import predicted_curve, tip_factors, with_factors

PAYLOADS = Path(__file__).parents[3] / "procedures" / "payloads"
SPHERE, CONE = (load_payload(PAYLOADS / f"plastic-{name}.yaml") for name in ("sphere", "cone"))
SURFACE = "7.5 um, 0.7 GPa"


def test_theory_of_the_plastic_sphere_with_roughness_is_the_row_of_table_two() -> None:
    factors = tip_factors(SPHERE, rough=True, plastic=False, surface=SURFACE)
    rough = with_factors(predicted_curve(SPHERE, 300.0), factors)
    fit = rs_btls(rough.displacement_m, rough.force_n)
    assert (f"{fit.k:.2e}", f"{fit.n:.2f}") == ("1.82e+10", "1.85")
    assert fit.secant_n_per_m == pytest.approx(4.81e6, rel=3e-3)


def test_the_factor_of_yield_turns_the_tip_of_a_cone_into_the_elastic_plastic_one() -> None:
    made = with_factors(predicted_curve(CONE, 300.0), tip_factors(CONE, rough=False, plastic=True))
    onset = elastic_limit(CONE.geometry, CONE.material, CONE.plate)
    assert onset is not None
    law = ElasticPlasticSphere(onset.force_n, onset.deformation_m)
    assert made.displacement_m == pytest.approx([law.deformation(x) for x in made.force_n])
    below = tip_factors(CONE, rough=False, plastic=True, radius_m=33e-3)
    assert below is not None
    assert below.factor(np.array([300.0])) == pytest.approx(1.0)  # F_c 960 N


def test_both_factors_multiply_and_points_out_of_contact_are_left_out() -> None:
    one, other, both = (
        tip_factors(CONE, rough=rough, plastic=plastic, surface=SURFACE if rough else None)
        for rough, plastic in ((True, False), (False, True), (True, True))
    )
    force_n = np.array([-1.0, 0.0, 5.0, 50.0])
    curve = Curve(np.arange(4.0), None, np.array([-1e-6, 0.0, 1e-6, 5e-6]), force_n)
    made = [with_factors(curve, each).displacement_m for each in (one, other, both)]
    assert made[2] * curve.displacement_m[2:] == pytest.approx(made[0] * made[1])
    assert with_factors(curve, both).time_s == pytest.approx([2.0, 3.0])
    assert with_factors(curve, None) is curve


def test_a_factor_without_its_figures_is_refused() -> None:
    smooth, punch = replace(SPHERE, roughness_m=None), replace(SPHERE, geometry=FlatPunch(1e-3))
    for payload, stated in (
        (None, {"rough": True}), (smooth, {"rough": True}), (punch, {"plastic": True}),
        (SPHERE, {"surface": SURFACE}), (SPHERE, {"radius_m": 1e-3}),
        (SPHERE, {"rough": True, "surface": "7.5 N"}),
    ):  # fmt: skip
        with pytest.raises(BadInputError):
            tip_factors(payload, **{"rough": False, "plastic": False} | stated)
    assert tip_factors(None, rough=False, plastic=False) is None


def test_identify_takes_the_factors_of_a_curve_and_none_of_a_record(tmp_path: Path) -> None:
    force_n = np.linspace(5.0, 300.0, 120)
    file = tmp_path / "smooth.csv"
    rows = "".join(f"{(x / 6.57e8) ** (1 / 1.5):.9g},{x:.9g}\n" for x in force_n)
    file.write_text(f"displacement_m,force_n\n{rows}")
    factors = tip_factors(SPHERE, rough=True, plastic=False, surface=SURFACE)
    assert factors is not None
    stated = Stated(secant_force_n=300.0)
    smooth, rough = (results_of_file(file, stated, each).found for each in (None, factors))
    expected = (300.0 / 6.57e8) ** (1 / 1.5) * factors.factor(np.array([300.0]))[0]
    assert rough.deformation_m.max() == pytest.approx(expected, rel=1e-3)
    assert rough.fits["rs_btls"].n > smooth.fits["rs_btls"].n + 0.2
    with pytest.raises(BadInputError, match="record of a run"):
        results_of_file(tmp_path / "run.mcap", stated, factors)
