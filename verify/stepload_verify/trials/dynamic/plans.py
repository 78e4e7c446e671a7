"""Plans drawn at random that preflight does not refuse, each on a rig as declared."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from stepload.envelope.envelope import Envelope, derive
from stepload.envelope.reason import PlanVerdict
from stepload.errors import SteploadError
from stepload.plan.load import load_plan
from stepload_verify.trials.honest.laws import FloatArray
from stepload_verify.trials.honest.rig import between

Rng = np.random.Generator
Text = dict[str, Any]
Extra = Callable[[FloatArray], FloatArray]
"""Forces (N,) in N → metres (N,)."""

ALUMINIUM = {
    "name": "aluminium", "youngs_modulus": "70 GPa", "poisson_ratio": 0.33,
    "yield_strength": "276 MPa",
}  # fmt: skip
DRAWS = 500
ROWS = 12
DRIFT = 0.005
"""Largest drift of a force zero in N/s, as the machine's profile declares it."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A plan as text, and the figures of it that a world needs.

    Attributes:
        family: payload and rig in two words.
        text: the plan.
        sphere: whether n = 1.5 is declared.
        top_n, depth_m: top force, and the deformation that theory gives it.
        cycle_s: how long a cycle takes, about.
        declared_n_per_m: K_s as declared; `stiffness_sigma` is how well, as a share.
    """

    family: str
    text: Text
    sphere: bool
    top_n: float
    depth_m: float = math.nan
    cycle_s: float = math.nan
    declared_n_per_m: float = math.nan
    stiffness_sigma: float = 0.01

    @property
    def gauge(self) -> bool:
        """Whether travel is measured across the contact."""
        return "displacement" in self.text["rig"]

    def simulated(self, **changes: object) -> Draft:
        """The draft with other keys in its `simulation` section."""
        return self.changed("rig", simulation={**self.text["rig"]["simulation"], **changes})

    def changed(self, section: str, **changes: object) -> Draft:
        """The draft with other keys in a section of the plan; None removes a key."""
        keys = {**self.text[section], **changes}
        kept = {key: value for key, value in keys.items() if value is not None}
        return replace(self, text={**self.text, section: kept})


def envelope_in(directory: Path, draft: Draft) -> Envelope:
    """What the plan of a draft means; written into and read from a directory.

    Raises:
        SteploadError: it is no plan, or nothing is known of its elastic limit.
    """
    path = directory / "plan.yaml"
    path.write_text(json.dumps(draft.text))
    return derive(load_plan(path))


def draw(rng: Rng, directory: Path) -> Draft:
    """Draw plans until preflight does not refuse one; its text is left in the directory."""
    for _ in range(DRAWS):
        draft = _with_procedure(FAMILIES[int(rng.integers(len(FAMILIES)))](rng), rng)
        try:
            envelope = envelope_in(directory, draft)
        except SteploadError:
            continue
        if envelope.verdict is not PlanVerdict.REFUSED:
            cycles = draft.text["procedure"]["cycles"]
            cycle_s = envelope.duration_s / cycles
            return replace(draft, depth_m=envelope.deformation_m, cycle_s=cycle_s)
    raise RuntimeError(f"none of {DRAWS} plans may go")


def _plastic_sphere(rng: Rng) -> Draft:
    """A plastic sphere on the paper's machine, up to 690 N, smooth or of stated roughness."""
    sigma_m = between(1e-6, 8e-6, rng) if rng.uniform() < 0.4 else 0.0
    payload = _payload(
        {"shape": "sphere", "radius": metres(rng.uniform(0.02, 0.04))},
        _material(rng, (1.5e9, 4e9), 0.35, (60e6, 110e6)),
        roughness=metres(sigma_m),
    )
    name = "rough sphere" if sigma_m else "plastic sphere"
    return _on_machine(rng, name, payload, between(60.0, 690.0, rng))


def _flat(rng: Rng) -> Draft:
    """A flat plastic face, n = 1."""
    radius_m, modulus = rng.uniform(0.003, 0.01), between(5e7, 6e8, rng)
    payload = _payload(
        {"shape": "flat_punch", "radius": metres(radius_m)},
        _material(rng, (modulus, modulus), 0.4), force_limit="800 N",
    )  # fmt: skip
    return replace(_on_machine(rng, "flat", payload, between(60.0, 600.0, rng)), sphere=False)


def _cone(rng: Rng) -> Draft:
    """The rounded tip of a plastic cone on a fine machine, 5 to 40 N."""
    payload = _payload(
        {"shape": "cone_tip", "radius": metres(between(0.003, 0.01, rng))},
        _material(rng, (1.5e9, 4e9), 0.35, (60e6, 110e6)),
        roughness="0 m",
    )
    return _on_machine(rng, "cone", payload, between(5.0, 40.0, rng), fine=0.05)


def _silicone(rng: Rng) -> Draft:
    """A silicone sphere on an arm like the UR5e, its K_s measured in the pose."""
    top_n = between(15.0, 90.0, rng)
    payload = _payload(
        {"shape": "sphere", "radius": metres(rng.uniform(0.015, 0.03))},
        _material(rng, (1e6, 5e6), 0.49),
        roughness="0 m", force_limit=newtons(1.3 * top_n),
    )  # fmt: skip
    rig = {
        "profile": "ur5e",
        "arm": {
            "driver": "sim",
            "options": {},
            "rate": "250 Hz",
            "structure": "machine",  # the simulated arm has one axis
        },
        "force": {"driver": "sim", "options": {}, "rate": "500 Hz"},
        "second_force": _second(rng, 0.15),
    }
    smooth_m = between(5e-6, 2e-5, rng)
    return _declared(Draft("silicone UR", {"payload": payload, "rig": rig}, True, top_n),
                     rng, 1.2e5, 0.02, smooth_m, 2.0 * DRIFT)  # fmt: skip


FAMILIES = (_plastic_sphere, _flat, _cone, _silicone)


def _on_machine(rng: Rng, name: str, payload: Text, top_n: float, fine: float = 1.0) -> Draft:
    """The paper's machine with errors scaled by `fine`; a third of the rigs gauge the contact."""
    rate = _in(float(rng.choice([250.0, 250.0, 250.0, 500.0])), "Hz")
    quantum_m, force_n = fine * between(2e-7, 2e-6, rng), fine * between(0.2, 1.5, rng)
    noise_n = fine * between(0.1, 0.5, rng)
    rig: Text = {
        "profile": "stvf",
        "arm": {
            "rate": rate, "position_resolution": metres(quantum_m),
            "position_noise": metres(0.2 * quantum_m), "lost_motion": metres(0.5 * quantum_m),
        },
        "force": {
            "rate": rate, "resolution": newtons(force_n), "noise": newtons(noise_n),
            "drift": _in(DRIFT * fine, "N/s"),
        },
        "second_force": _second(rng, noise_n),
    }  # fmt: skip
    if rng.uniform() < 1.0 / 3.0:
        rig["displacement"] = {
            "driver": "sim", "rate": rate, "resolution": metres(0.5 * quantum_m),
            "noise": metres(0.2 * quantum_m),
        }  # fmt: skip
        name += ", gauge"
    draft = Draft(name, {"payload": payload, "rig": rig}, True, top_n)
    return _declared(draft, rng, 3.49e6, 0.01, fine * between(1e-7, 5e-7, rng), fine * DRIFT)


def _declared(
    draft: Draft, rng: Rng, stiffness: float, sigma: float, smooth_m: float, drift: float
) -> Draft:
    """The rig with errors of exactly the sizes that are declared, and a loop of up to 3 %."""
    length_n = draft.top_n * between(1.0 / 12.0, 0.5, rng)
    draft = replace(draft, declared_n_per_m=stiffness, stiffness_sigma=sigma).changed(
        "rig",
        system_stiffness={
            "value": _in(stiffness, "N/m"), "sigma": _in(sigma * stiffness, "N/m"),
            "msde": metres(smooth_m), "smooth_length": newtons(length_n),
            "provenance": "declared",
        },
        simulation={
            "seed": int(rng.integers(2**31)),
            "surface_error": "0 mm",
            "stiffness_factor": 1.0 + sigma * float(rng.standard_normal()),
            "payload_factor": between(1.0 / 1.15, 1.15, rng),
            "hysteresis": percent(rng.uniform(0.0, 0.03)),
            "kinematic_error": metres(smooth_m),
            "kinematic_length": newtons(length_n),
            "force_drift": _in(rng.uniform(-0.6, 0.6) * drift, "N/s"),
        },
    )  # fmt: skip
    return with_table(draft, rng) if rng.uniform() < 0.75 else without_table(draft)


def with_table(draft: Draft, rng: Rng, extra_m: Extra = np.zeros_like) -> Draft:
    """The plan with a table of the load path, which gives way by `extra_m` beyond F/K_s.

    The error that its rows have in common is that of the declared K_s.
    """
    force = draft.top_n * np.linspace(0.04, 1.1, ROWS)
    deflection = force / draft.declared_n_per_m + extra_m(force)
    row_m = 0.002 * float(deflection[-1])
    deflection = np.maximum.accumulate(deflection + 0.2 * row_m * rng.standard_normal(ROWS))
    return _stiffness(
        draft,
        deflection_force=[newtons(each) for each in force],
        deflection=[metres(each) for each in deflection],
        deflection_sigma=[metres(row_m)] * ROWS,
        deflection_common=percent(draft.stiffness_sigma),
    )


def without_table(draft: Draft) -> Draft:
    """The plan with K_s alone."""
    rows = ("deflection_force", "deflection", "deflection_sigma")
    return _stiffness(draft, **{key: [] for key in rows}, deflection_common="0 %")


def _stiffness(draft: Draft, **changes: object) -> Draft:
    stated = draft.text["rig"]["system_stiffness"]
    return draft.changed("rig", system_stiffness={**stated, **changes})


def _with_procedure(draft: Draft, rng: Rng) -> Draft:
    """Four to six levels, one or two cycles, holds of half a second to two."""
    noise_n = float(draft.text["rig"]["force"].get("noise", "0.15 N").split()[0])
    quantum_n = float(draft.text["rig"]["force"].get("resolution", "0.05 N").split()[0])
    touch_n = max(0.01 * draft.top_n, 2.0 * quantum_n, 6.0 * math.hypot(noise_n, 0.3 * quantum_n))
    levels, ramp_s = int(rng.integers(4, 7)), rng.uniform(0.4, 1.0)
    soft = draft.family == "silicone UR"
    procedure = {
        "top_force": newtons(draft.top_n),
        "step": newtons(draft.top_n / levels),
        "load_rate": _in(draft.top_n / levels / ramp_s, "N/s"),
        "hold": _in(float(rng.choice([0.5, 0.5, 1.0, 2.0])), "s"),
        "cycles": int(rng.choice([1, 2, 2, 2, 2])),
        "lift_off": bool(rng.uniform() < 0.85),
        "touch_force": newtons(touch_n),
        "touches": int(rng.choice([1, 2])),
        "surface_distance": "2 mm" if soft else "0.5 mm",
        "surface_uncertainty": "0.3 mm" if soft else "0.1 mm",
        "tare": _in(float(rng.choice([0.5, 1.0])), "s"),
        "warm_up": "0 s",
        "settle_timeout": "2 s",
    }
    return replace(draft, text={"stepload": 1, **draft.text, "procedure": procedure})


def _second(rng: Rng, noise_n: float) -> Text:
    """The second force channel: the arm's own estimate, or none."""
    if rng.uniform() < 0.5:
        return {"source": "none"}
    return {"source": "arm", "noise": newtons(noise_n)}


def _payload(geometry: Text, material: Text, **more: object) -> Text:
    return {
        "name": geometry["shape"], "geometry": geometry, "material": material,
        "plate": ALUMINIUM, **more,
    }  # fmt: skip


def _material(
    rng: Rng, modulus: tuple[float, float], poisson: float, strength: tuple[float, float] = (0, 0)
) -> Text:
    made: Text = {
        "name": "drawn", "youngs_modulus": _in(between(*modulus, rng), "Pa"),
        "poisson_ratio": poisson,
    }  # fmt: skip
    if strength[0]:
        made["yield_strength"] = _in(between(*strength, rng), "Pa")
    return made


def _in(value: float, unit: str) -> str:
    return f"{float(value):.9g} {unit}"


def metres(value_m: float) -> str:
    """A length as a plan writes it."""
    return _in(value_m, "m")


def newtons(value_n: float) -> str:
    """A force as a plan writes it."""
    return _in(value_n, "N")


def percent(share: float) -> str:
    """A share as a plan writes it."""
    return _in(100.0 * share, "%")
