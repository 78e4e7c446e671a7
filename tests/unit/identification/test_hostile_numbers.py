"""Numbers that LAPACK cannot take: refused before, and nothing on standard output."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from stepload.cli.main import main
from stepload.identification.estimators import fit_all
from stepload.identification.samples import select

KS = 3.49e6


def test_of_stiff_payloads_the_joint_fit_is_always_there(capfd: pytest.CaptureFixture[str]) -> None:
    """Up to thirty times stiffer than the rig: side estimators fail on what K_s has left."""
    lost = 0
    for seed in range(50):
        rng = np.random.default_rng(seed)
        secant, n = rng.uniform(0.7e7, 10e7), rng.uniform(1.2, 2.0)
        force = np.linspace(5.0, 300.0, 60)
        k = 300.0 / (300.0 / secant) ** n
        path = (force / k) ** (1 / n) + force / KS + rng.normal(0, 1e-6, force.size)
        path = np.round(path / 2e-6) * 2e-6
        force = np.round((force + rng.normal(0, 0.7, force.size)) / 1.5) * 1.5
        selected = select(path - force / (KS * rng.normal(1.0, 0.005)), force)
        fits = fit_all(selected, secant_force_n=300.0, sigma_m=0.6e-6, sigma_n=0.8)
        assert "joint" in fits
        lost += 9 - len(fits)
    assert lost > 0, "none of these was as hard as they are meant to be"
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize(
    ("depth", "force"),
    [
        (np.linspace(0, 1e-5, 50), 1e300 * np.linspace(0, 1, 50) ** 1.5),
        (1e200 * np.linspace(0, 1, 50), np.linspace(0, 300, 50)),
        (1e-300 * np.linspace(0, 1, 50), np.linspace(0, 300, 50)),
        (np.linspace(0, 1e-5, 50), np.geomspace(1e-300, 1e300, 50)),
    ],
)
def test_standard_output_is_one_json_object(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    depth: np.ndarray,
    force: np.ndarray,
) -> None:
    path = tmp_path / "hostile.csv"
    header = "displacement_m,force_n"
    np.savetxt(path, np.column_stack([depth, force]), "%.10g", ",", header=header, comments="")
    monkeypatch.setattr(sys, "argv", ["stepload", "identify", str(path), "--json"])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capfd.readouterr()  # of the descriptors, so that LAPACK's own words are among it
    assert ended.value.code in (None, 0, 2), err
    assert isinstance(json.loads(out), dict)
    assert "Traceback" not in err
