"""Plans as labs write them, drawn at random: material, size, shape, rig, levels, holds, distances.

A plan is a text, as a file of a lab. Loads are chosen by what the payload bears, as a lab would.
"""

from __future__ import annotations

import json
import math
import tempfile
from pathlib import Path
from random import Random
from typing import Any

from stepload.plan.load import load_plan
from stepload.plan.model import Plan
from stepload_verify.campaign.plants import log_uniform

MODULUS_PA = (0.5e6, 200e9)
"""Softest and stiffest material: foam, and steel."""
MACHINES = {"one-axis": 5000.0, "stvf": 1000.0}
ARMS = {"ur3e": 105.0, "ur5e": 170.0, "ur10e": 340.0, "ur16e": 450.0, "ur20": 500.0, "ur30": 700.0}
"""Largest push in N of each profile, about: a lab stays well below it."""
ARM_STIFFNESS = {
    "ur3e": 6e4, "ur5e": 1.2e5, "ur10e": 1e5, "ur16e": 2.6e5, "ur20": 1.8e5, "ur30": 2.8e5,
}  # fmt: skip
MEASURED_SHARE = 0.7
"""Share of the arms whose K_s was measured in the pose of the experiment."""
RUBBER_PA = 100e6
"""Modulus up to which a lab states a strain at which a payload is harmed."""
BEARS_N = 40.0
"""A payload that bears less is taken to a smaller machine: an arm's own force is good to 11 N."""
GAUGED_M = {True: 1e-3, False: 0.1e-3}
"""Deformation at the top force below which a lab uses a gauge: on an arm, on a machine."""
LEAST_GIVE_M = 5e-6
"""A payload that gives way by less is not pressed: a gauge resolves 0.05 µm."""
MOST_STRENGTH_PA = 800e6
"""A harder payload would harm the steel plate first."""
POISSON = 0.4
Text = dict[str, Any]


def lab_text(chance: Random, six: bool) -> Text:
    """A plan for an arm, or for a machine with one axis."""
    profiles = ARMS if six else MACHINES
    profile = chance.choice(sorted(profiles))
    bears_n = gives_m = 0.0
    while bears_n < BEARS_N or gives_m < LEAST_GIVE_M:
        payload, bears_n, m_per_n, power = _payload(chance, log_uniform(chance, *MODULUS_PA))
        top_n = _round(min(bears_n, 0.8 * profiles[profile]) * chance.uniform(0.25, 0.6))
        gives_m = m_per_n * top_n**power
    distance_mm = chance.choice((2.0, 3.0, 5.0, 8.0, 10.0))
    return {
        "stepload": 1,
        "payload": payload,
        "rig": _rig(chance, profile, six, gives_m < GAUGED_M[six]),
        "procedure": {
            "top_force": f"{top_n:g} N",
            "step": f"{top_n / chance.choice((4, 5, 6, 8, 10)):.9g} N",
            "hold": f"{chance.choice((1, 2, 3, 5))} s",
            "cycles": chance.choice((1, 2, 2, 3)),
            "surface_distance": f"{distance_mm:g} mm",
            "surface_uncertainty": f"{chance.choice((0.1, 0.2)) * distance_mm:g} mm",
        },
    }


def lab_plan(chance: Random, six: bool) -> Plan:
    """The plan of such a text.

    Raises:
        PlanError: it contradicts itself.
    """
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "plan.yaml"
        path.write_text(json.dumps(lab_text(chance, six)), encoding="utf-8")
        return load_plan(path)


def _payload(chance: Random, modulus_pa: float) -> tuple[Text, float, float, float]:
    """A payload, the force F in N that it bears, and c and p of its deformation c F^p in m."""
    shape = chance.choice(("sphere", "sphere", "flat_punch", "cone_tip"))
    radius_m = log_uniform(chance, 5e-3, 50e-3 if shape == "sphere" else 15e-3)
    plane_pa = modulus_pa / (1.0 - POISSON**2)
    strength_pa = min(MOST_STRENGTH_PA, modulus_pa / log_uniform(chance, 30.0, 300.0))
    yields = modulus_pa > RUBBER_PA
    if shape == "flat_punch":
        bears_n = math.pi * radius_m**2 * strength_pa
    elif yields:  # (13)
        bears_n = math.pi**3 * radius_m**2 / (6.0 * plane_pa**2) * (1.6 * strength_pa) ** 3
    else:
        depth_m = chance.uniform(0.05, 0.2) * radius_m
        bears_n = 4.0 / 3.0 * plane_pa * math.sqrt(radius_m) * depth_m**1.5
    material: Text = {
        "name": "drawn", "youngs_modulus": f"{modulus_pa:.4g} Pa", "poisson_ratio": POISSON,
    }  # fmt: skip
    payload: Text = {
        "name": f"{shape} of {modulus_pa:.3g} Pa",
        "geometry": {"shape": shape, "radius": f"{radius_m:.4g} m"},
        "material": material,
        "plate": {"name": "steel", "youngs_modulus": "210 GPa", "poisson_ratio": 0.3,
                  "yield_strength": "900 MPa"},
    }  # fmt: skip
    if shape == "sphere" and yields:
        material["yield_strength"] = f"{strength_pa:.4g} Pa"
    else:
        payload["force_limit"] = f"{bears_n:.3g} N"
    if shape == "flat_punch":
        return payload, bears_n, 0.5 / (plane_pa * radius_m), 1.0
    return payload, bears_n, (0.75 / (plane_pa * math.sqrt(radius_m))) ** (2.0 / 3.0), 2.0 / 3.0


def _rig(chance: Random, profile: str, six: bool, gauged: bool) -> Text:
    rig: Text = {"profile": profile}
    if six:
        rig["arm"] = {"driver": "sim", "options": {}}
        rig["force"] = {"driver": "sim", "options": {}}
        if chance.random() < MEASURED_SHARE:
            value = ARM_STIFFNESS[profile] * chance.uniform(0.8, 1.2)
            rig["system_stiffness"] = {
                "value": f"{value:.4g} N/m", "sigma": f"{0.02 * value:.4g} N/m",
                "damping": "100 N s/m", "msde": "5 µm", "provenance": "measured",
            }  # fmt: skip
    if gauged:
        gauge = {"driver": "sim", "rate": "1 kHz", "resolution": "0.05 µm"}
        rig["displacement"] = gauge | ({"offset": "2 mm"} if six else {})
    return rig


def _round(value: float) -> float:
    """To two digits."""
    return float(f"{value:.2g}")
