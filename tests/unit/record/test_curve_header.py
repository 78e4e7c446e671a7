"""Names of columns: which is which, in which unit, and what is refused rather than guessed."""

from __future__ import annotations

import pytest

from stepload.record.curve_header import find_header
from stepload.record.curve_mapping import CurveMapping, Refusal


def read(*names: str) -> dict[str, tuple[str, float]]:
    """Role to name and scale."""
    lines = ["\t".join(names), "\t".join("1" for _ in names)]
    return {c.role: (c.name, c.scale) for c in find_header(lines, CurveMapping()).columns}


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
    ("names", "message"),
    [
        (("displacement_m", "Force"), "'Force' has no unit that is known"),
        (("displacement_m", "force_kn"), "no unit that is known; is 'kN' meant?"),
        (("displacement_m", "force_mn"), "is 'mN or MN' meant?"),
        (("displacement_m", "Force_n"), "is 'nN or N' meant?|is 'N' meant?"),
        (("displacement_m", "Force (lb)"), "'Force (lb)' is in lb, a mass"),
        (("displacement_m", "Force (%)"), "'Force (%)' has no unit that is known"),
        (("Strain (%)", "Force (N)"), "no column for the travel"),
        (("displacement_m", "Force (V)"), "'Force (V)' has no unit that is known"),
        (("displacement_m", "Force [mm]"), "is in mm, no unit of a force"),
        (("displacement", "force_n"), "'displacement' has no unit that is known"),
        (("Depth (nm)", "Position (nm)", "force_n"), "both 'Position (nm)' and 'Depth (nm)'"),
        (("Depth (nm)", "Raw load (mN)", "Load (mN)"), "2 columns could be the force"),
        (("Depth (nm)", "Time", "force_n"), "'Time' has no unit that is known"),
        (("Depth (nm)", "Force rate (N)"), "no column for the force"),
    ],
)
def test_what_is_not_told_is_refused(names: tuple[str, ...], message: str) -> None:
    with pytest.raises(Refusal) as caught:
        read(*names)
    assert any(part in caught.value.message for part in message.split("|"))
    assert caught.value.remedy
