"""Names of columns: which is which, in which unit, and what is refused rather than guessed."""

from __future__ import annotations

import pytest

from stepload.record.curve_header import find_header
from stepload.record.curve_mapping import CurveMapping, Refusal
from stepload.record.curve_words import scale_of


def read(*names: str) -> dict[str, tuple[str, float]]:
    """Role to name and scale."""
    lines = ["\t".join(names), "\t".join("1" for _ in names)]
    return {c.role: (c.name, scale_of(c.unit)) for c in find_header(lines, CurveMapping()).columns}


@pytest.mark.parametrize(
    ("name", "scale"),
    [
        ("force_n", 1.0), ("Force [N]", 1.0), ("Force [mN]", 1e-3), ("force (kN)", 1e3),
        ("Load On Sample (mN)", 1e-3), ("force_uN", 1e-6), ("Force / nN", 1e-9), ("Fz pN", 1e-12),
        ("load_micro_N", 1e-6), ("Force (microN)", 1e-6), ("Force [MN]", 1e6), ("LOAD, N", 1.0),
        ("Kraft [N]", 1.0), ("Force (measured) [µN]", 1e-6), ("force in milliNewtons", 1e-3),
    ],
)  # fmt: skip
def test_units_of_force(name: str, scale: float) -> None:
    assert read("displacement_m", name)["force_n"] == (name, pytest.approx(scale))


@pytest.mark.parametrize(
    ("name", "role", "scale"),
    [
        ("displacement_um", "displacement_m", 1e-6), ("Depth (nm)", "displacement_m", 1e-9),
        ("Displacement Into Surface (nm)", "displacement_m", 1e-9), ("Indentation/µm",
        "displacement_m", 1e-6), ("Position [mm]", "position_m", 1e-3),
        ("height (measured) [m]", "position_m", 1.0), ("Tip position (nm)", "displacement_m", 1e-9),
        ("Crosshead cm", "position_m", 1e-2), ("travel_microns", "position_m", 1e-6),
    ],
)  # fmt: skip
def test_units_of_travel(name: str, role: str, scale: float) -> None:
    assert read("time_s", "force_n", name)[role] == (name, pytest.approx(scale))


@pytest.mark.parametrize(
    ("names", "remedy"),
    [
        (("displacement_m", "Force"), {"units": (("force", "?"),)}),
        (("displacement_m", "force_kn"), {"units": (("force", "?"),)}),
        (("displacement_m", "force_mn"), {"units": (("force", "?"),)}),
        (("displacement_m", "Force_n"), {"units": (("force", "?"),)}),
        (("displacement_m", "Force (lb)"), {"units": (("force", "?"),)}),
        (("displacement_m", "Force (%)"), {"units": (("force", "?"),)}),
        (("Strain (%)", "Force (N)"), {"columns": (("position", "?"),)}),
        (("displacement_m", "Force (V)"), {"units": (("force", "?"),)}),
        (("displacement_m", "Force [mm]"), {"units": (("force", "?"),)}),
        (("displacement", "force_n"), {"units": (("displacement", "?"),)}),
        (("Depth (nm)", "Position (nm)", "force_n"), {"columns": (("position", "Position (nm)"),)}),
        (("Depth (nm)", "Raw load (mN)", "Load (mN)"), {"columns": (("force", "Raw load (mN)"),)}),
        (("Depth (nm)", "Time", "force_n"), {"units": (("time", "?"),)}),
        (("Depth (nm)", "Force rate (N)"), {"columns": (("force", "?"),)}),
    ],
)
def test_what_is_not_told_is_refused(names: tuple[str, ...], remedy: dict[str, object]) -> None:
    with pytest.raises(Refusal) as caught:
        read(*names)
    assert caught.value.remedy == remedy
